//! Parsing of the command-line arguments of a bundle.

use std::ffi::OsString;
use std::path::PathBuf;

use lexopt::ValueExt as _;

use super::{BusOptions, Format, Mode};
use crate::Permits;

/// Usage text of a bundle.
pub const USAGE: &str = "\
usage:
  BUNDLE [--instance NAME | --instance-dir DIR] [--launch N] [--die-with-parent]
         [--no-sandbox]
         run on the bus of an instance (`default` unless named), confined unless told otherwise
  BUNDLE [--format text|json] [--timings] FILE
         check one file and print what was found; with --timings, on stderr, what every checker took
  BUNDLE -c CONFIG
         run as a module of ASAM's quality checker framework
  each with [--schema-dir DIR]: XML schemas (.xsd, .tbl) to use instead of those it comes with
  and [--threads N]: how many threads check at the same time; as many as there are processors for
  this process, unless told otherwise
exit codes: 0 accepted, 1 rejected, 2 usage, 3 undetermined, 4 no broker, 5 internal error
";

/// Reason why arguments cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UsageError {
    /// An unknown option, an option without its value, or an invalid value.
    #[error("{0}")]
    Argument(String),
    /// An option that has no effect without another one.
    #[error("`{0}` needs {1}")]
    Lacks(&'static str, &'static str),
    /// Two options that exclude each other.
    #[error("`{0}` and `{1}` cannot be used together")]
    Conflict(&'static str, &'static str),
}

impl From<lexopt::Error> for UsageError {
    fn from(error: lexopt::Error) -> UsageError {
        UsageError::Argument(error.to_string())
    }
}

pub(super) fn parse(arguments: impl Iterator<Item = OsString>) -> Result<Mode, UsageError> {
    use lexopt::Arg::{Long, Short, Value};
    let mut parser = lexopt::Parser::from_args(arguments);
    let mut bus = BusOptions::default();
    let (mut on_bus, mut config, mut file, mut format) = (false, None, None, None);
    let (mut schema_dir, mut timings, mut threads) = (None, false, None);
    while let Some(argument) = parser.next()? {
        on_bus |= matches!(argument, Long("instance" | "instance-dir" | "launch"));
        match argument {
            Short('h') | Long("help") => return Ok(Mode::Help),
            Short('c') | Long("config") => config = Some(PathBuf::from(parser.value()?)),
            Long("format") => {
                let known = |text: &str| Format::of(text).ok_or("expected text or json");
                format = Some(parser.value()?.parse_with(known)?);
            }
            Long("threads") => {
                let number =
                    |text: &str| threads_of(text).ok_or("expected a number from 1 to 1024");
                threads = Some(parser.value()?.parse_with(number)?);
            }
            Long("timings") => timings = true,
            Long("instance") => bus.instance = parser.value()?.string()?,
            Long("instance-dir") => bus.instance_dir = Some(PathBuf::from(parser.value()?)),
            Long("launch") => bus.launch = Some(parser.value()?.parse()?),
            Long("schema-dir") => schema_dir = Some(PathBuf::from(parser.value()?)),
            Long("no-sandbox") => bus.no_sandbox = true,
            Long("die-with-parent") => bus.die_with_parent = true,
            Value(_) if file.is_some() => {
                return Err(UsageError::Conflict("FILE", "a second FILE"));
            }
            Value(path) => file = Some(PathBuf::from(path)),
            Short(_) | Long(_) => return Err(argument.unexpected().into()),
        }
    }
    if timings && file.is_none() {
        return Err(UsageError::Lacks("--timings", "FILE"));
    }
    let threads = threads.unwrap_or_else(Permits::available);
    match (file, config) {
        (Some(_), Some(_)) => Err(UsageError::Conflict("FILE", "-c")),
        (Some(_), None) if on_bus => Err(UsageError::Conflict("FILE", "--instance")),
        (None, Some(_)) if on_bus => Err(UsageError::Conflict("-c", "--instance")),
        (Some(path), None) => Ok(Mode::File {
            path,
            format: format.unwrap_or_default(),
            timings,
            schema_dir,
            threads,
        }),
        (None, Some(config)) => Ok(Mode::Module {
            config,
            schema_dir,
            threads,
        }),
        (None, None) => Ok(Mode::Bus(BusOptions {
            schema_dir,
            threads,
            ..bus
        })),
    }
}

fn threads_of(text: &str) -> Option<usize> {
    let number = text.parse().ok();
    number.filter(|number| (1..=Permits::MOST).contains(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(arguments: &[&str]) -> Result<Mode, UsageError> {
        parse(arguments.iter().map(OsString::from))
    }

    #[test]
    fn arguments_select_one_of_three_modes() {
        assert_eq!(of(&[]), Ok(Mode::Bus(BusOptions::default())));
        assert_eq!(
            of(&["--format", "json", "a.xodr"]),
            Ok(Mode::File {
                path: "a.xodr".into(),
                format: Format::Json,
                timings: false,
                schema_dir: None,
                threads: Permits::available(),
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
                schema_dir: Some("own".into()),
                threads: Permits::available(),
            })
        );
        let Ok(Mode::Bus(options)) =
            of(&["--instance-dir", "/d", "--launch", "7", "--die-with-parent"])
        else {
            panic!("expected the bus mode")
        };
        assert_eq!((options.launch, options.die_with_parent), (Some(7), true));
        assert!(!options.no_sandbox, "sandboxed by default");
        let open = of(&["--no-sandbox"]);
        assert!(matches!(open, Ok(Mode::Bus(options)) if options.no_sandbox));
    }

    #[test]
    fn invalid_arguments_are_refused() {
        for wrong in [
            &["--bad"][..],
            &["-c"],
            &["--schema-dir"],
            &["--launch", "x"],
            &["--threads", "0"],
            &["--threads", "many"],
            &["--timings"],
            &["--timings", "-c", "b"],
            &["a", "b"],
            &["a", "-c", "b"],
        ] {
            assert!(of(wrong).is_err(), "{wrong:?}");
        }
    }
}
