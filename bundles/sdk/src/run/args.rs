//! The arguments of a bundle, few enough to be read by hand.

use std::ffi::OsString;
use std::path::PathBuf;

use super::{BusOptions, Format, Mode};

/// What a bundle's arguments are.
pub const USAGE: &str = "\
usage:
  BUNDLE [--instance NAME | --instance-dir DIR] [--launch N] [--die-with-parent]
         run on the bus of an instance (`default` unless named)
  BUNDLE [--format text|json] [--timings] FILE
         check one file and print what was found; with --timings, on stderr, what every checker took
  BUNDLE -c CONFIG
         run as a module of ASAM's quality checker framework
  each with [--schema-dir DIR]: XML schemas (.xsd, .tbl) to use instead of those it comes with
exit codes: 0 accepted, 1 rejected, 2 usage, 3 undetermined, 4 no broker, 5 internal error
";

/// Why arguments cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UsageError {
    /// Nothing of that name.
    #[error("there is no option `{0}`")]
    Unknown(String),
    /// An option without its value.
    #[error("`{0}` needs a value")]
    NeedsValue(String),
    /// A value that does not fit.
    #[error("`{value}` is no value of `{option}`")]
    BadValue {
        /// The option.
        option: String,
        /// What it was given.
        value: String,
    },
    /// Something that is of no use without something else.
    #[error("`{0}` needs {1}")]
    Lacks(&'static str, &'static str),
    /// Two things that exclude each other.
    #[error("`{0}` and `{1}` exclude each other")]
    Conflict(&'static str, &'static str),
}

pub(super) fn parse(mut arguments: impl Iterator<Item = OsString>) -> Result<Mode, UsageError> {
    let mut bus = BusOptions::default();
    let (mut on_bus, mut config, mut file, mut format) = (false, None, None, None);
    let (mut schema_dir, mut timings) = (None, false);
    while let Some(argument) = arguments.next() {
        let option = argument.to_string_lossy().into_owned();
        let mut value = || {
            arguments
                .next()
                .ok_or_else(|| UsageError::NeedsValue(option.clone()))
        };
        let bad = |value: String| UsageError::BadValue {
            option: option.clone(),
            value,
        };
        match option.as_str() {
            "-h" | "--help" => return Ok(Mode::Help),
            "-c" | "--config" => config = Some(PathBuf::from(value()?)),
            "--format" => {
                let text = value()?.to_string_lossy().into_owned();
                format = Some(Format::of(&text).ok_or_else(|| bad(text))?);
            }
            "--timings" => timings = true,
            "--instance" => bus.instance = value()?.to_string_lossy().into_owned(),
            "--instance-dir" => bus.instance_dir = Some(PathBuf::from(value()?)),
            "--launch" => {
                let text = value()?.to_string_lossy().into_owned();
                bus.launch = Some(text.parse().map_err(|_| bad(text))?);
            }
            "--schema-dir" => schema_dir = Some(PathBuf::from(value()?)),
            "--die-with-parent" => bus.die_with_parent = true,
            _ if option.len() > 1 && option.starts_with('-') => {
                return Err(UsageError::Unknown(option));
            }
            _ if file.is_some() => return Err(UsageError::Conflict("FILE", "a second FILE")),
            _ => file = Some(PathBuf::from(&argument)),
        }
        on_bus |= matches!(
            option.as_str(),
            "--instance" | "--instance-dir" | "--launch"
        );
    }
    if timings && file.is_none() {
        return Err(UsageError::Lacks("--timings", "FILE"));
    }
    match (file, config) {
        (Some(_), Some(_)) => Err(UsageError::Conflict("FILE", "-c")),
        (Some(_), None) if on_bus => Err(UsageError::Conflict("FILE", "--instance")),
        (None, Some(_)) if on_bus => Err(UsageError::Conflict("-c", "--instance")),
        (Some(path), None) => Ok(Mode::File {
            path,
            format: format.unwrap_or_default(),
            timings,
            schema_dir,
        }),
        (None, Some(config)) => Ok(Mode::Module { config, schema_dir }),
        (None, None) => Ok(Mode::Bus(BusOptions { schema_dir, ..bus })),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(arguments: &[&str]) -> Result<Mode, UsageError> {
        parse(arguments.iter().map(OsString::from))
    }

    #[test]
    fn three_ways_to_run() {
        assert_eq!(of(&[]), Ok(Mode::Bus(BusOptions::default())));
        assert_eq!(
            of(&["--format", "json", "a.xodr"]),
            Ok(Mode::File {
                path: "a.xodr".into(),
                format: Format::Json,
                timings: false,
                schema_dir: None
            })
        );
        let timed = of(&["a.xodr", "--timings"]);
        assert!(
            matches!(timed, Ok(Mode::File { timings: true, .. })),
            "{timed:?}"
        );
        assert_eq!(
            of(&["--schema-dir", "own", "-c", "c.xml"]),
            Ok(Mode::Module {
                config: "c.xml".into(),
                schema_dir: Some("own".into())
            })
        );
        let Ok(Mode::Bus(options)) =
            of(&["--instance-dir", "/d", "--launch", "7", "--die-with-parent"])
        else {
            panic!("the bus was meant")
        };
        assert_eq!((options.launch, options.die_with_parent), (Some(7), true));
    }

    #[test]
    fn mistakes_are_named() {
        for wrong in [
            &["--bad"][..],
            &["-c"],
            &["--schema-dir"],
            &["--launch", "x"],
            &["--timings"],
            &["--timings", "-c", "b"],
            &["a", "b"],
            &["a", "-c", "b"],
        ] {
            assert!(of(wrong).is_err(), "{wrong:?}");
        }
    }
}
