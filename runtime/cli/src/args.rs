//! The command line.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};

use qcbus_reporter_sdk::Registration;
use qcbus_sdk::Permits;

use crate::standard::REPORTERS;

mod bundle;

pub use bundle::{
    BundleAddArgs, BundleCommand, BundleNewArgs, BundleRemoveArgs, BundleRunArgs, BundleTrialsArgs,
    BundleUpgradeArgs, BusArgs, ManifestArgs,
};

/// A checker for OpenDRIVE roads and OpenSCENARIO scenarios that parses every file once and lets
/// independent checker bundles read it in place.
#[derive(Debug, Parser)]
#[command(name = "qcbus", version, about, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 accepted · 1 rejected · 2 usage or configuration · \
3 undetermined or timeout · 4 no broker · 5 internal error"
)]
pub struct Args {
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check files and directories once, and print the findings
    Check(Box<CheckArgs>),
    /// Watch directories and check all files in them
    Serve(Box<ServeArgs>),
    /// Let a running broker finish its work and stop
    Down(InstanceArgs),
    /// Show the state of a running broker
    Status(StatusArgs),
    /// Wait for the verdict on a file's current content
    Wait(WaitArgs),
    /// Make a running broker reload its configuration and bundle manifests
    Reload(InstanceArgs),
    /// List, run, add, upgrade or remove checker bundles
    #[command(subcommand)]
    Bundle(BundleCommand),
    /// Report on existing results, including ASAM's
    Report(ReportArgs),
    /// Run a reporter
    #[command(subcommand, hide = true)]
    Reporter(ReporterCommand),
    /// Explain a rule, or list all of them
    Rule(RuleArgs),
    /// Check a configuration without using it
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Compile XML schemas to tables
    #[command(subcommand)]
    Schema(SchemaCommand),
    /// Show when the elements of a scenario start and end, and why
    Timeline(TimelineArgs),
    /// Convert a modular scenario to a plain scenario
    Expand(ExpandArgs),
    /// Pack a modular scenario and its referenced files into an archive
    Pack(PackArgs),
    /// Look for problems that may affect a broker, and suggest fixes
    Doctor(DoctorArgs),
}

/// Default instance.
pub const DEFAULT_INSTANCE: &str = "default";

/// Selection of the broker.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct InstanceArgs {
    /// Name of the instance
    #[arg(long, value_name = "NAME", default_value = DEFAULT_INSTANCE)]
    pub instance: String,
    /// Runtime directory of the instance, instead of a name
    #[arg(
        long,
        value_name = "DIR",
        conflicts_with = "instance",
        hide_short_help = true
    )]
    pub instance_dir: Option<PathBuf>,
}

/// Options for result files.
#[derive(Debug, Clone, ClapArgs)]
pub struct OutputArgs {
    /// Directory for results (default: qcbus-out)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Format of the .xqar files
    #[arg(long, value_enum, default_value_t = DialectArg::Current)]
    pub xqar_dialect: DialectArg,
}

/// Formats of a result file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DialectArg {
    /// The current format of ASAM's framework
    Current,
    /// The format of QC4OpenX 1.0.0 from 2023
    Qc4openx,
}

/// Limits for input files and bundles.
#[derive(Debug, Clone, ClapArgs)]
#[command(next_help_heading = "Limits")]
pub struct LimitArgs {
    /// Maximum size of a file on disk, in MiB
    #[arg(long, value_name = "MIB", hide_short_help = true)]
    pub max_file: Option<u64>,
    /// Maximum size of a file after unpacking, in MiB
    #[arg(long, value_name = "MIB", hide_short_help = true)]
    pub max_unpacked: Option<u64>,
    /// Maximum ratio of unpacked to packed size
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_ratio: Option<u32>,
    /// Maximum number of members of an archive
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_members: Option<u32>,
    /// Maximum nesting depth of elements
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_depth: Option<u16>,
    /// Time within which a bundle must finish a file
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub job_deadline: Option<Duration>,
    /// Time without a message after which a bundle with work counts as dead
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub silence_limit: Option<Duration>,
    /// Time to wait for a missing required bundle before files become undetermined; at least two
    /// minutes for an ASAM module that is starting
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub absence_limit: Option<Duration>,
    /// Time without any progress for which a file waits for space in shared memory
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub room_limit: Option<Duration>,
    /// Number of threads of a bundle that comes with qcbus (default: the number of processors
    /// available to this process)
    #[arg(long, value_name = "N", value_parser = threads, hide_short_help = true)]
    pub threads: Option<usize>,
    /// Maximum private memory of a bundle, in MiB
    #[arg(long, value_name = "MIB", hide_short_help = true)]
    pub memory_limit: Option<u64>,
    /// Maximum number of restarts of a bundle within a minute before it pauses
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_restarts: Option<u32>,
}

/// `qcbus check`.
#[derive(Debug, ClapArgs)]
pub struct CheckArgs {
    /// Files and directories; with -c the default is the configuration's InputFile
    #[arg(value_name = "PATH")]
    pub paths: Vec<PathBuf>,
    /// ASAM configuration that selects the bundles and checkers to run
    #[arg(short, long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Skip files that a .qcignore excludes, also if they are named; for hooks and editors
    #[arg(long)]
    pub force_exclude: bool,
    /// Options for result files.
    #[command(flatten)]
    pub output: OutputArgs,
    /// Run only these checkers: ids, rule UIDs, their beginnings or last parts, families, bundles
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub select: Vec<String>,
    /// Do not run these checkers; results and verdicts list them
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub ignore: Vec<String>,
    /// Use the levels of ASAM: what the standard demands is an error, even if no reader suffers
    #[arg(long)]
    pub strict: bool,
    /// List every finding as an issue of its own, even if several are about one fault
    #[arg(long)]
    pub all: bool,
    /// Check each file independently: a rejected map does not reject the scenarios that use it
    #[arg(long)]
    pub own_verdict: bool,
    /// Options for the output and the exit code.
    #[command(flatten)]
    pub print: PrintArgs,
    /// Directory of manifests of additional bundles
    #[arg(long, value_name = "DIR")]
    pub bundles_d: Option<PathBuf>,
    /// Directory of XML schemas (.xsd, .tbl) to use instead of the built-in ones
    #[arg(long, value_name = "DIR")]
    pub schema_dir: Option<PathBuf>,
    /// Do not sandbox bundles: they may write, connect and send signals with your permissions
    #[arg(long, hide_short_help = true)]
    pub no_sandbox: bool,
    /// Do not use a running broker: start separate bundles
    #[arg(long)]
    pub cold: bool,
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Limits for input files and bundles.
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// Options for the output and the exit code of `check`.
#[derive(Debug, Clone, ClapArgs)]
#[command(next_help_heading = "Output")]
pub struct PrintArgs {
    /// Formats to print, or to write to FILE; separate several with commas [default: full for one
    /// file, concise for several]
    #[arg(
        long,
        visible_alias = "format",
        value_name = "FORMAT[=FILE]",
        value_delimiter = ',',
        value_parser = OutputFormats
    )]
    pub output_format: Vec<OutputFormat>,
    /// Print the number of findings by rule, the most frequent first
    #[arg(long)]
    pub statistics: bool,
    /// Print only findings
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print everything about every file, also the skipped checkers and the reasons
    #[arg(short, long)]
    pub verbose: bool,
    /// Exit with code 1 from this level of findings
    #[arg(long, value_name = "LEVEL", value_enum, default_value_t = FailLevel::Error)]
    pub fail_level: FailLevel,
    /// Exit with code 0 despite findings; still with 3 if a check was not possible
    #[arg(long)]
    pub exit_zero: bool,
    /// When to use colour
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = ColorArg::Auto)]
    pub color: ColorArg,
}

/// Lowest level of findings that cause exit code 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FailLevel {
    /// Errors, which cause a rejection
    Error,
    /// Errors and warnings
    Warning,
    /// All findings
    Information,
}

/// When to use colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ColorArg {
    /// On a terminal, unless NO_COLOR is set
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// A format and its output file.
#[derive(Debug, Clone)]
pub struct OutputFormat {
    /// Name as the user typed it.
    name: String,
    /// Reporter that writes the format.
    pub registration: &'static Registration,
    /// Path of the file; `None` for stdout.
    pub file: Option<PathBuf>,
}

impl OutputFormat {
    /// Returns the terminal format if the program prints this format itself.
    pub fn terminal(&self) -> Option<TerminalFormat> {
        match self.registration.alias {
            "text" => Some(TerminalFormat::Full),
            "concise" => Some(TerminalFormat::Concise),
            _ => None,
        }
    }

    /// Checks whether the output is a page for a browser, which is not suitable for a terminal.
    pub fn is_page(&self) -> bool {
        self.registration.is_page
    }
}

impl std::fmt::Display for OutputFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name)
    }
}

/// Formats that the program prints itself as results arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TerminalFormat {
    /// Each finding with its source line.
    Full,
    /// A line for each finding.
    Concise,
}

/// Parser of `FORMAT` and `FORMAT=FILE`.
#[derive(Debug, Clone)]
struct OutputFormats;

impl TypedValueParser for OutputFormats {
    type Value = OutputFormat;

    fn parse_ref(
        &self,
        command: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<OutputFormat, clap::Error> {
        let bytes = value.as_encoded_bytes();
        let split = bytes.iter().position(|byte| *byte == b'=');
        let (name, file) = match split {
            Some(at) => {
                use std::os::unix::ffi::OsStrExt as _;
                let file = std::ffi::OsStr::from_bytes(&bytes[at + 1..]);
                (&bytes[..at], Some(PathBuf::from(file)))
            }
            None => (bytes, None),
        };
        let name = String::from_utf8_lossy(name).into_owned();
        let found = REPORTERS
            .iter()
            .find(|it| it.alias == standard_alias(&name));
        match found {
            Some(registration) => Ok(OutputFormat {
                name,
                registration,
                file,
            }),
            None => {
                let parser = PossibleValuesParser::new(self.values());
                // This parser's error lists the possible values and suggests a similar one.
                let refused = parser.parse_ref(command, arg, std::ffi::OsStr::new(&name));
                Err(refused.err().unwrap_or_else(|| {
                    clap::Error::new(clap::error::ErrorKind::InvalidValue).with_cmd(command)
                }))
            }
        }
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(self.values().into_iter()))
    }
}

impl OutputFormats {
    fn values(&self) -> Vec<PossibleValue> {
        let name = |it: &&'static Registration| match it.alias {
            "text" => PossibleValue::new("full").alias("text"),
            alias => PossibleValue::new(alias),
        };
        REPORTERS.iter().map(name).collect()
    }
}

/// Returns the alias of a format. The text report is called `full`, in contrast to `concise`.
fn standard_alias(name: &str) -> &str {
    match name {
        "full" => "text",
        name => name,
    }
}

/// Output format of a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people
    Text,
    /// One JSON document on one line
    Json,
}

/// `qcbus serve`.
#[derive(Debug, ClapArgs)]
pub struct ServeArgs {
    /// Directories to watch
    #[arg(value_name = "DIR", required = true)]
    pub directories: Vec<PathBuf>,
    /// Instance to start.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// ASAM configuration; reloaded after each change
    #[arg(short, long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Options for result files.
    #[command(flatten)]
    pub output: OutputArgs,
    /// Directory of data that must survive a restart (default: OUT/.qcbus)
    #[arg(long, value_name = "DIR")]
    pub state: Option<PathBuf>,
    /// Directory of bundle manifests; it is watched (default: STATE/bundles.d)
    #[arg(long, value_name = "DIR")]
    pub bundles_d: Option<PathBuf>,
    /// Directory of XML schemas (.xsd, .tbl) to use instead of the built-in ones
    #[arg(long, value_name = "DIR")]
    pub schema_dir: Option<PathBuf>,
    /// Directory in which only accepted files are published
    #[arg(long, value_name = "DIR")]
    pub gate: Option<PathBuf>,
    /// Use the levels of ASAM: what the standard demands is an error, even if no reader suffers
    #[arg(long)]
    pub strict: bool,
    /// List every finding as an issue of its own, even if several are about one fault
    #[arg(long)]
    pub all: bool,
    /// Check each file independently: a rejected map does not reject the scenarios that use it
    #[arg(long)]
    pub own_verdict: bool,
    /// How to publish accepted files that depend on files outside of DIR
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = OutsideArg::Name, hide_short_help = true)]
    pub gate_outside: OutsideArg,
    /// Run a reporter; may be given several times
    #[arg(long, value_name = "NAME", value_parser = reporter())]
    pub report: Vec<&'static Registration>,
    /// Scan at intervals instead of relying on file events (for network file systems)
    #[arg(long, value_name = "TIME", num_args = 0..=1, default_missing_value = "2s", value_parser = duration)]
    pub poll: Option<Duration>,
    /// Check a file only after TIME without changes, even if it was closed. For uploads that close
    /// and reopen files (default: when it is closed; 250ms without close events; 1 minute if it
    /// stays open)
    #[arg(long, value_name = "TIME", value_parser = rest)]
    pub settle: Option<Duration>,
    /// Retention time of the job history
    #[arg(long, value_name = "TIME", default_value = "90d", value_parser = duration)]
    pub retention: Duration,
    /// Interval of a full scan even if file events arrive
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration, hide_short_help = true)]
    pub rescan: Duration,
    /// Maximum time to finish after a request to stop
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration, hide_short_help = true)]
    pub drain_limit: Duration,
    /// Do not start the standard bundles
    #[arg(long, hide_short_help = true)]
    pub no_standard_bundles: bool,
    /// Do not sandbox bundles: they may write, connect and send signals with your permissions
    #[arg(long, hide_short_help = true)]
    pub no_sandbox: bool,
    /// Limits for input files and bundles.
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// Treatment by the gate of a file that depends on files outside of the watched directories.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OutsideArg {
    /// Publish the file, and list the outside files in its verdict file
    Name,
    /// Do not publish the file
    Refuse,
}

/// `qcbus status`.
#[derive(Debug, ClapArgs)]
pub struct StatusArgs {
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Print JSON for programs
    #[arg(long)]
    pub json: bool,
    /// Print only whether the broker is healthy, and the reasons; exit code 0 if it is healthy, 1
    /// if not, 4 without a broker
    #[arg(long, conflicts_with = "json")]
    pub health: bool,
}

/// `qcbus wait`.
#[derive(Debug, ClapArgs)]
pub struct WaitArgs {
    /// File to wait for
    pub file: PathBuf,
    /// Wait also until every reporter of the broker has written its report on the file
    #[arg(long)]
    pub reports: bool,
    /// Maximum time to wait (30s, 5m); no limit by default
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub timeout: Option<Duration>,
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Print JSON for programs
    #[arg(long)]
    pub json: bool,
    /// Print nothing, only set the exit code
    #[arg(short, long)]
    pub quiet: bool,
}

/// `qcbus reporter …`.
#[derive(Debug, Subcommand)]
pub enum ReporterCommand {
    /// Run a reporter on the bus
    Run {
        /// Name of the reporter
        #[arg(value_parser = reporter())]
        name: &'static Registration,
        /// Options to join the bus.
        #[command(flatten)]
        bus: BusArgs,
    },
}

/// `qcbus report`.
#[derive(Debug, ClapArgs)]
pub struct ReportArgs {
    /// Name of the report
    #[arg(value_parser = reporter())]
    pub format: &'static Registration,
    /// Result files (.xqar)
    #[arg(value_name = "FILE.xqar", required_unless_present = "config")]
    pub results: Vec<PathBuf>,
    /// Output file of the report (default: stdout; a page is written beside the result)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// ASAM configuration with the parameters of this reporter's ReportModule
    #[arg(short, long, value_name = "CONFIG")]
    pub config: Option<PathBuf>,
    /// Parameter of the reporter, such as LineWidth=80; may be given several times
    #[arg(short, long, value_name = "NAME=VALUE", value_parser = name_value)]
    pub param: Vec<(String, String)>,
}

/// `qcbus rule`.
#[derive(Debug, ClapArgs)]
pub struct RuleArgs {
    /// A checker id, a rule UID, or the end of one
    pub id: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Broker to ask about the rules of other bundles.
    #[command(flatten)]
    pub instance: InstanceArgs,
}

/// `qcbus timeline`.
#[derive(Debug, ClapArgs)]
pub struct TimelineArgs {
    /// A scenario (.xosc) or an archive of a modular one (.mosc)
    pub file: PathBuf,
    /// Print JSON for programs
    #[arg(long)]
    pub json: bool,
    /// When to use colour
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = ColorArg::Auto)]
    pub color: ColorArg,
}

/// `qcbus expand`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Referenced scenarios are searched next to the scenario or in its archive, then in \
                  the\ndirectories of SCENARIO_PATH. Findings are written to stderr. Exit code 1 and no output \
                  file: a\nreference cannot be resolved, a value is ambiguous, or a limit is exceeded."
)]
pub struct ExpandArgs {
    /// A modular scenario (.xosc) or an archive of one (.mosc)
    pub file: PathBuf,
    /// Output file of the plain scenario (default: stdout)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// `qcbus pack`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Files below the directory of the main scenario keep their path from there, other files keep \
                  only their\nname. Problems of the archive are written to stderr; it is written anyway, and \
                  errors\nlead to exit code 1."
)]
pub struct PackArgs {
    /// The main scenario, then its referenced files; in the archive the first is called main.xosc
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// The archive (.mosc)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// `qcbus config …`.
#[derive(Debug, Subcommand)]
pub enum ConfigCommand {
    /// Print the errors and oddities of a configuration
    Check {
        /// The configuration
        file: PathBuf,
        /// Directory of manifests of additional bundles and reporters that it may name
        #[arg(long, value_name = "DIR")]
        bundles_d: Option<PathBuf>,
    },
}

/// `qcbus schema …`.
#[derive(Debug, Subcommand)]
pub enum SchemaCommand {
    /// Compile the .xsd files of a directory to tables for --schema-dir
    ///
    /// All files of the directory are one schema. Its root element and the first number such as 1.7
    /// in the name of the directory or file select the use of the tables.
    Compile {
        /// Directory of the .xsd files of one schema, or a schema of one file
        path: PathBuf,
        /// Output file of the tables
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
}

/// `qcbus doctor`.
#[derive(Debug, ClapArgs)]
pub struct DoctorArgs {
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Directory of results to examine (default: that of the running broker, else qcbus-out)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// State directory to examine (default: that of the running broker, else OUT/.qcbus)
    #[arg(long, value_name = "DIR")]
    pub state: Option<PathBuf>,
}

/// Returns a parser of the short names of standard reporters.
fn reporter() -> impl TypedValueParser<Value = &'static Registration> {
    let row = |it: &&'static Registration| PossibleValue::new(it.alias).help(it.about);
    let find = |alias: String| REPORTERS.into_iter().find(|it| it.alias == alias);
    PossibleValuesParser::new(REPORTERS.iter().map(row))
        .try_map(move |alias| find(alias).ok_or("unknown reporter"))
}

/// Parses `NAME=VALUE`.
fn name_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("write NAME=VALUE".to_owned()),
    }
}

/// Parses a number of threads.
fn threads(text: &str) -> Result<usize, String> {
    let number = text.parse().ok();
    let number = number.filter(|it| (1..=Permits::MOST).contains(it));
    number.ok_or_else(|| format!("`{text}` is not a number from 1 to {}", Permits::MOST))
}

/// Parses `250ms`, `30s`, `5m`, `2h`, `90d`; a number without a unit is seconds.
pub fn duration(text: &str) -> Result<Duration, String> {
    let split = text
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let wrong = || format!("`{text}` is not a duration; write 250ms, 30s, 5m, 2h or 90d");
    let number: f64 = number.parse().map_err(|_| wrong())?;
    let seconds = match unit {
        "ms" => number / 1000.0,
        "" | "s" => number,
        "m" | "min" => number * 60.0,
        "h" => number * 3600.0,
        "d" => number * 86400.0,
        _ => return Err(wrong()),
    };
    Duration::try_from_secs_f64(seconds).map_err(|_| wrong())
}

/// Parses the time that files must stay unchanged.
fn rest(text: &str) -> Result<Duration, String> {
    let time = duration(text)?;
    let allowed = Duration::from_millis(10)..=Duration::from_secs(3600);
    let wrong = || format!("`{text}` is not a valid time for files to settle; use 10ms to 1h");
    allowed.contains(&time).then_some(time).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_line_definition_is_consistent() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }

    #[test]
    fn durations_with_common_units_are_parsed() {
        assert_eq!(duration("250ms"), Ok(Duration::from_millis(250)));
        assert_eq!(rest("30s"), Ok(Duration::from_secs(30)));
        for text in ["0s", "9ms", "61m", "soon"] {
            assert!(rest(text).is_err(), "{text}");
        }
        assert_eq!(duration("30s"), Ok(Duration::from_secs(30)));
        assert_eq!(duration("30"), Ok(Duration::from_secs(30)));
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("90d"), Ok(Duration::from_secs(90 * 86400)));
        assert!(duration("soon").is_err());
        assert!(duration("3 parsecs").is_err());
    }
}
