//! Description of a hosted module and its limits.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use lexopt::ValueExt as _;
use qcbus_document::FileKind;
use qcbus_sdk::run::UsageError;

use crate::program::Program;

/// An ASAM module that takes part as a bundle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Hosted {
    /// Name under which the module joins, and name of the bundle in results and configurations.
    pub name: String,
    /// Shell command of the module: `qc_opendrive -c $ASAM_QC_FRAMEWORK_CONFIG_FILE`.
    pub command: String,
    /// The `application` name of the module's section in a configuration, if known. Otherwise it is
    /// learned. Modules have it fixed in their code, and it may differ from the name in their
    /// manifest.
    pub application: Option<String>,
    /// Working directory of the module, if it is not the private directory of the job.
    pub directory: Option<PathBuf>,
    /// Additional environment variables of the module.
    pub environment: Vec<(String, String)>,
    /// Kinds of files that the module accepts, or `None` if they must be learned.
    pub kinds: Option<Vec<FileKind>>,
    /// Resource limits of a run.
    pub limits: Limits,
    /// Files that the command runs, as far as they are known.
    pub programs: Vec<Program>,
    /// Directory in which private directories are created.
    pub scratch: PathBuf,
    /// Whether every run starts without a fork server that has loaded the module already.
    pub is_cold: bool,
}

/// Resource limits of a run. A run that exceeds a limit is killed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Limits {
    /// Wall-clock time.
    pub time: Duration,
    /// Memory of all processes together, and private memory of each process, in bytes.
    pub memory: u64,
    /// Printed output and size of the largest written file, in bytes.
    pub output: u64,
    /// Number of simultaneous processes.
    pub processes: usize,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            // This is below the broker's `--job-deadline`. At that deadline the broker ends the
            // whole bundle without naming a limit.
            time: Duration::from_secs(50),
            memory: 4096 << 20,
            output: 256 << 20,
            processes: 256,
        }
    }
}

/// Returns the default directory for the private directories of this user.
pub fn usual_scratch() -> PathBuf {
    let user = rustix::process::geteuid().as_raw();
    std::env::temp_dir().join(format!("qcbus-asam-{user}"))
}

/// Parsed command line: the hosted module and the arguments for the SDK.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Asked {
    pub hosted: Hosted,
    /// Whether this process is a runner.
    pub is_runner: bool,
    pub rest: Vec<OsString>,
}

/// Parses the arguments of the adapter.
///
/// # Errors
/// [`UsageError`] describes the invalid argument.
pub(crate) fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Asked, UsageError> {
    use lexopt::Arg::{Long, Short, Value};
    let mut parser = lexopt::Parser::from_args(arguments);
    let (mut name, mut command, mut digests) = (None, None, Vec::new());
    let mut asked = Asked {
        hosted: Hosted {
            name: String::new(),
            command: String::new(),
            application: None,
            directory: None,
            environment: Vec::new(),
            kinds: None,
            limits: Limits::default(),
            programs: Vec::new(),
            scratch: usual_scratch(),
            is_cold: false,
        },
        is_runner: false,
        rest: Vec::new(),
    };
    let hosted = &mut asked.hosted;
    let limits = &mut hosted.limits;
    while let Some(argument) = parser.next()? {
        match argument {
            Long("name") => name = Some(parser.value()?.string()?),
            Long("exec") => command = Some(parser.value()?.string()?),
            Long("application") => hosted.application = Some(parser.value()?.string()?),
            Long("directory") => hosted.directory = Some(parser.value()?.into()),
            Long("program") => hosted.programs.push(Program::at(parser.value()?.into())),
            // An unreadable program has a digest that cannot be parsed.
            Long("digest") => digests.push(parser.value()?.parse().ok()),
            Long("scratch") => hosted.scratch = parser.value()?.into(),
            Long("env") => hosted
                .environment
                .push(variable(&parser.value()?.string()?)?),
            Long("kind") => {
                let kind = kind(&parser.value()?.string()?)?;
                hosted.kinds.get_or_insert_default().push(kind);
            }
            Long("seconds") => limits.time = Duration::from_secs(positive(&mut parser)?),
            Long("memory-mb") => limits.memory = positive(&mut parser)?.saturating_mul(1 << 20),
            Long("output-mb") => limits.output = positive(&mut parser)?.saturating_mul(1 << 20),
            Long("cold") => hosted.is_cold = true,
            Long("runner") => asked.is_runner = true,
            Long(option @ ("instance" | "instance-dir" | "launch" | "threads" | "format")) => {
                asked.rest.push(format!("--{option}").into());
                asked.rest.push(parser.value()?);
            }
            Long(option @ ("die-with-parent" | "no-sandbox" | "timings")) => {
                asked.rest.push(format!("--{option}").into());
            }
            Short('c') => asked.rest.extend(["-c".into(), parser.value()?]),
            Value(file) => asked.rest.push(file),
            Short(_) | Long(_) => return Err(argument.unexpected().into()),
        }
    }
    for (program, digest) in hosted.programs.iter_mut().zip(digests) {
        program.digest = digest;
    }
    hosted.name = name.ok_or(UsageError::Lacks("asam-adapter", "--name"))?;
    hosted.command = command.ok_or(UsageError::Lacks("asam-adapter", "--exec"))?;
    Ok(asked)
}

fn variable(text: &str) -> Result<(String, String), UsageError> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err(UsageError::Argument(format!(
            "--env: expected NAME=VALUE, found `{text}`"
        ))),
    }
}

fn kind(text: &str) -> Result<FileKind, UsageError> {
    let known = FileKind::ALL.into_iter().find(|it| it.as_str() == text);
    known.ok_or_else(|| UsageError::Argument(format!("--kind: unknown file kind `{text}`")))
}

fn positive(parser: &mut lexopt::Parser) -> Result<u64, UsageError> {
    let number = |text: &str| text.parse().ok().filter(|it| *it > 0);
    let read = |text: &str| number(text).ok_or("expected a number greater than 0");
    Ok(parser.value()?.parse_with(read)?)
}

#[cfg(test)]
mod tests {
    use qcbus_messages::Digest;

    use super::*;

    #[test]
    fn arguments_of_runner_are_parsed_with_those_of_sdk_apart() {
        let seven = "07".repeat(32);
        let line = format!(
            "--name a --exec x --application b --directory /d --env K=V=W --kind xodr --seconds 7 --memory-mb 8 \
             --output-mb 9 --program /p --program /q --scratch /s --cold --launch 3 --die-with-parent --digest {seven} \
             --digest - --runner"
        );
        let asked = parse(line.split_whitespace().map(OsString::from)).unwrap();
        assert_eq!(asked.rest, ["--launch", "3", "--die-with-parent"]);
        assert!(asked.is_runner);
        let program = |path: &str, digest| Program {
            path: path.into(),
            digest,
        };
        let expected = Hosted {
            name: "a".into(),
            command: "x".into(),
            application: Some("b".into()),
            directory: Some("/d".into()),
            environment: vec![("K".into(), "V=W".into())],
            kinds: Some(vec![FileKind::Xodr]),
            limits: Limits {
                time: Duration::from_secs(7),
                memory: 8 << 20,
                output: 9 << 20,
                ..Limits::default()
            },
            programs: vec![program("/p", Some(Digest([7; 32]))), program("/q", None)],
            scratch: "/s".into(),
            is_cold: true,
        };
        assert_eq!(asked.hosted, expected);
    }

    #[test]
    fn invalid_arguments_are_named_in_errors() {
        for wrong in [
            "",
            "--name a",
            "--exec x",
            "--name a --exec x --kind pdf",
            "--name a --exec x --env =v",
            "--name a --exec x --seconds 0",
            "--name a --exec x --bad",
        ] {
            let words = wrong.split_whitespace().map(OsString::from);
            assert!(parse(words).is_err(), "{wrong}");
        }
    }
}
