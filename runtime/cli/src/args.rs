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
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check files and directories once, and print what was found
    Check(Box<CheckArgs>),
    /// Watch directories and judge whatever appears in them
    Serve(Box<ServeArgs>),
    /// Let a running broker finish what it has and stop
    Down(InstanceArgs),
    /// Show how a running broker is doing
    Status(StatusArgs),
    /// Wait for the verdict on a file's present content
    Wait(WaitArgs),
    /// Let a running broker read its configuration and bundle manifests again
    Reload(InstanceArgs),
    /// List, run, add, upgrade or remove checker bundles
    #[command(subcommand)]
    Bundle(BundleCommand),
    /// Report on results that are there already, also ASAM's own
    Report(ReportArgs),
    /// Run a reporter
    #[command(subcommand, hide = true)]
    Reporter(ReporterCommand),
    /// Explain a rule, or list all of them
    Rule(RuleArgs),
    /// Look at a configuration without using it
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Compile XML schemas to tables
    #[command(subcommand)]
    Schema(SchemaCommand),
    /// Make a plain scenario of a modular one
    Expand(ExpandArgs),
    /// Pack a modular scenario and what it refers to into an archive
    Pack(PackArgs),
    /// Look for what may keep a broker from working, and say what to do
    Doctor(DoctorArgs),
}

/// The instance that is meant when none is named.
pub const DEFAULT_INSTANCE: &str = "default";

/// Which broker.
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

/// How results are written.
#[derive(Debug, Clone, ClapArgs)]
pub struct OutputArgs {
    /// Directory for results (default: qcbus-out)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Form of the .xqar files
    #[arg(long, value_enum, default_value_t = DialectArg::Current)]
    pub xqar_dialect: DialectArg,
}

/// The forms of a result file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DialectArg {
    /// As ASAM's framework writes today
    Current,
    /// As QC4OpenX 1.0.0 wrote in 2023
    Qc4openx,
}

/// Caps on what is read.
#[derive(Debug, Clone, ClapArgs)]
#[command(next_help_heading = "Limits")]
pub struct LimitArgs {
    /// Largest file on disk, in MiB
    #[arg(long, value_name = "MIB", hide_short_help = true)]
    pub max_file: Option<u64>,
    /// Largest file after unpacking, in MiB
    #[arg(long, value_name = "MIB", hide_short_help = true)]
    pub max_unpacked: Option<u64>,
    /// Largest ratio of unpacked to packed size
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_ratio: Option<u32>,
    /// Most members of an archive
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_members: Option<u32>,
    /// Deepest nesting of elements
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_depth: Option<u16>,
    /// A bundle must end a file within this time
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub job_deadline: Option<Duration>,
    /// A bundle with work that says nothing for this long is taken for dead
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub silence_limit: Option<Duration>,
    /// A bundle that must judge and is not there is waited for this long, then files are undetermined; an
    /// ASAM module that is being started for two minutes at least
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub absence_limit: Option<Duration>,
    /// A file without room in shared memory is waited for this long while nothing moves
    #[arg(long, value_name = "TIME", value_parser = duration, hide_short_help = true)]
    pub room_limit: Option<Duration>,
    /// Threads with which a bundle that comes with qcbus checks; unless told otherwise, as many as this process may
    /// use processors
    #[arg(long, value_name = "N", value_parser = threads, hide_short_help = true)]
    pub threads: Option<usize>,
    /// Most private memory of a bundle, in MiB
    #[arg(long, value_name = "MIB", hide_short_help = true)]
    pub memory_limit: Option<u64>,
    /// Restarts of a bundle within a minute before it rests
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub max_restarts: Option<u32>,
}

/// `qcbus check`.
#[derive(Debug, ClapArgs)]
pub struct CheckArgs {
    /// Files and directories; with -c the default is the configuration's InputFile
    #[arg(value_name = "PATH")]
    pub paths: Vec<PathBuf>,
    /// ASAM configuration: run what it demands, as it demands it
    #[arg(short, long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Pass over files that a .qcignore excludes, also those that are named: for hooks and editors
    #[arg(long)]
    pub force_exclude: bool,
    /// How results are written.
    #[command(flatten)]
    pub output: OutputArgs,
    /// Ask only these checkers: ids, rule UIDs, their beginnings or last parts, families, bundles
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub select: Vec<String>,
    /// Do not ask these checkers; results and verdicts say what was left out
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub ignore: Vec<String>,
    /// Judge each file by itself: a rejected map does not reject the scenarios on it
    #[arg(long)]
    pub own_verdict: bool,
    /// What is printed, and what ends how.
    #[command(flatten)]
    pub print: PrintArgs,
    /// Directory of manifests of further bundles
    #[arg(long, value_name = "DIR")]
    pub bundles_d: Option<PathBuf>,
    /// Directory of XML schemas (.xsd, .tbl) to use instead of those that come with qcbus
    #[arg(long, value_name = "DIR")]
    pub schema_dir: Option<PathBuf>,
    /// Do not confine bundles: they may write, connect and signal as you may
    #[arg(long, hide_short_help = true)]
    pub no_sandbox: bool,
    /// Do not ask a broker that runs already: start bundles of its own
    #[arg(long)]
    pub cold: bool,
    /// Whom to ask.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Caps.
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// What `check` prints, and with which exit code it ends.
#[derive(Debug, Clone, ClapArgs)]
#[command(next_help_heading = "Output")]
pub struct PrintArgs {
    /// What to print, or to write to FILE; several with commas [default: full for one file, concise for
    /// several]
    #[arg(
        long,
        visible_alias = "format",
        value_name = "FORMAT[=FILE]",
        value_delimiter = ',',
        value_parser = OutputFormats
    )]
    pub output_format: Vec<OutputFormat>,
    /// Count findings by rule, the most frequent first
    #[arg(long)]
    pub statistics: bool,
    /// Print findings and nothing else
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print everything of every file, also what was skipped and why
    #[arg(short, long)]
    pub verbose: bool,
    /// End with 1 from this level of findings on
    #[arg(long, value_name = "LEVEL", value_enum, default_value_t = FailLevel::Error)]
    pub fail_level: FailLevel,
    /// End with 0 whatever is found; with 3 still when something could not be checked
    #[arg(long)]
    pub exit_zero: bool,
    /// Whether to colour
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = ColorArg::Auto)]
    pub color: ColorArg,
}

/// From which level on findings end in exit code 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FailLevel {
    /// Errors: what is rejected
    Error,
    /// Warnings, too
    Warning,
    /// Everything that is found
    Information,
}

/// Whether to colour what is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ColorArg {
    /// On a terminal, unless NO_COLOR is set
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// A format, and the file that it goes to.
#[derive(Debug, Clone)]
pub struct OutputFormat {
    /// As it was typed.
    name: String,
    /// Who writes it.
    pub registration: &'static Registration,
    /// The file; `None` for stdout.
    pub file: Option<PathBuf>,
}

impl OutputFormat {
    /// How the program itself prints it, if it does.
    pub fn terminal(&self) -> Option<TerminalFormat> {
        match self.registration.alias {
            "text" => Some(TerminalFormat::Full),
            "concise" => Some(TerminalFormat::Concise),
            _ => None,
        }
    }

    /// Whether it is a page to look at, which nobody wants on a terminal.
    pub fn is_page(&self) -> bool {
        self.registration.is_page
    }
}

impl std::fmt::Display for OutputFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name)
    }
}

/// Formats that the program prints itself, as results come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TerminalFormat {
    /// Each finding with its line of the file.
    Full,
    /// A line for each finding.
    Concise,
}

/// Takes `FORMAT` and `FORMAT=FILE`.
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
                // It says which there are, and which is near.
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

/// The text report is called `full` beside `concise`.
fn standard_alias(name: &str) -> &str {
    match name {
        "full" => "text",
        name => name,
    }
}

/// How a rule is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people
    Text,
    /// One JSON document per file and line
    Json,
}

/// `qcbus serve`.
#[derive(Debug, ClapArgs)]
pub struct ServeArgs {
    /// Directories to watch
    #[arg(value_name = "DIR", required = true)]
    pub directories: Vec<PathBuf>,
    /// Which instance to be.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// ASAM configuration; read again whenever it changes
    #[arg(short, long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// How results are written.
    #[command(flatten)]
    pub output: OutputArgs,
    /// Directory of what must survive a restart (default: OUT/.qcbus)
    #[arg(long, value_name = "DIR")]
    pub state: Option<PathBuf>,
    /// Directory of bundle manifests, watched (default: STATE/bundles.d)
    #[arg(long, value_name = "DIR")]
    pub bundles_d: Option<PathBuf>,
    /// Directory of XML schemas (.xsd, .tbl) to use instead of those that come with qcbus
    #[arg(long, value_name = "DIR")]
    pub schema_dir: Option<PathBuf>,
    /// Publish accepted files here, and only those
    #[arg(long, value_name = "DIR")]
    pub gate: Option<PathBuf>,
    /// Judge each file by itself: a rejected map does not reject the scenarios on it
    #[arg(long)]
    pub own_verdict: bool,
    /// What becomes behind the gate of a file that depends on others outside of DIR
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = OutsideArg::Name, hide_short_help = true)]
    pub gate_outside: OutsideArg,
    /// Run a reporter; may be given several times
    #[arg(long, value_name = "NAME", value_parser = reporter())]
    pub report: Vec<&'static Registration>,
    /// Look around at intervals instead of relying on file events (network file systems)
    #[arg(long, value_name = "TIME", num_args = 0..=1, default_missing_value = "2s", value_parser = duration)]
    pub poll: Option<Duration>,
    /// Judge a file that is written in place when it has rested this long, also once it is closed (uploads that
    /// close and open files again; default: when it is closed, else after 250ms)
    #[arg(long, value_name = "TIME", value_parser = rest)]
    pub settle: Option<Duration>,
    /// How long the history of jobs is kept
    #[arg(long, value_name = "TIME", default_value = "90d", value_parser = duration)]
    pub retention: Duration,
    /// Look through everything this often even when file events arrive
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration, hide_short_help = true)]
    pub rescan: Duration,
    /// Finish within this time when told to stop
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration, hide_short_help = true)]
    pub drain_limit: Duration,
    /// Do not start the standard bundles
    #[arg(long, hide_short_help = true)]
    pub no_standard_bundles: bool,
    /// Do not confine bundles: they may write, connect and signal as you may
    #[arg(long, hide_short_help = true)]
    pub no_sandbox: bool,
    /// Caps.
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// What becomes behind the gate of a file that depends on others outside of what is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OutsideArg {
    /// It is published, and its verdict file names them
    Name,
    /// It is not published
    Refuse,
}

/// `qcbus status`.
#[derive(Debug, ClapArgs)]
pub struct StatusArgs {
    /// Which broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// For programs
    #[arg(long)]
    pub json: bool,
    /// Say only whether it needs a look, and why: ends with 0 when it is healthy, 1 when not, 4 without a broker
    #[arg(long, conflicts_with = "json")]
    pub health: bool,
}

/// `qcbus wait`.
#[derive(Debug, ClapArgs)]
pub struct WaitArgs {
    /// The file
    pub file: PathBuf,
    /// Wait for the reports on it, too: every reporter that the broker runs has written its own
    #[arg(long)]
    pub reports: bool,
    /// Give up after this time (30s, 5m); without it, wait for ever
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub timeout: Option<Duration>,
    /// Which broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// For programs
    #[arg(long)]
    pub json: bool,
    /// Say nothing, only end with the exit code
    #[arg(short, long)]
    pub quiet: bool,
}

/// `qcbus reporter …`.
#[derive(Debug, Subcommand)]
pub enum ReporterCommand {
    /// Run a reporter on the bus
    Run {
        /// Which one
        #[arg(value_parser = reporter())]
        name: &'static Registration,
        /// How to join the bus.
        #[command(flatten)]
        bus: BusArgs,
    },
}

/// `qcbus report`.
#[derive(Debug, ClapArgs)]
pub struct ReportArgs {
    /// Which report
    #[arg(value_parser = reporter())]
    pub format: &'static Registration,
    /// Result files (.xqar)
    #[arg(value_name = "FILE.xqar", required_unless_present = "config")]
    pub results: Vec<PathBuf>,
    /// Where the report goes (default: stdout; a page goes beside the result)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// ASAM configuration: the parameters of this reporter's ReportModule
    #[arg(short, long, value_name = "CONFIG")]
    pub config: Option<PathBuf>,
    /// A parameter of the reporter, such as LineWidth=80; may be given several times
    #[arg(short, long, value_name = "NAME=VALUE", value_parser = name_value)]
    pub param: Vec<(String, String)>,
}

/// `qcbus rule`.
#[derive(Debug, ClapArgs)]
pub struct RuleArgs {
    /// A checker id, a rule UID, or the end of one
    pub id: Option<String>,
    /// How to print it
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Which broker to ask about the rules of other bundles.
    #[command(flatten)]
    pub instance: InstanceArgs,
}

/// `qcbus expand`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Scenarios that are referred to are looked for beside the scenario or in its archive, then in the\n\
directories of SCENARIO_PATH. What is found on the way is said on stderr. Exit code 1, and no file: a\n\
reference leads nowhere, which value is meant is open, or a limit is exceeded."
)]
pub struct ExpandArgs {
    /// A modular scenario (.xosc) or an archive of one (.mosc)
    pub file: PathBuf,
    /// Where the plain scenario goes (default: stdout)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// `qcbus pack`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Files that lie below the directory of the main scenario keep their path from there, others go by \
their\nname alone. What is wrong with the archive is said on stderr; it is written all the same, and errors\n\
end in exit code 1."
)]
pub struct PackArgs {
    /// The main scenario, then what it refers to; in the archive the first is called main.xosc
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// The archive (.mosc)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// `qcbus config …`.
#[derive(Debug, Subcommand)]
pub enum ConfigCommand {
    /// Say what is wrong or odd about a configuration
    Check {
        /// The configuration
        file: PathBuf,
        /// Directory of manifests of further bundles and reporters that it may name
        #[arg(long, value_name = "DIR")]
        bundles_d: Option<PathBuf>,
    },
}

/// `qcbus schema …`.
#[derive(Debug, Subcommand)]
pub enum SchemaCommand {
    /// Compile the .xsd files of a directory to tables for --schema-dir
    ///
    /// All files of the directory are one schema. What tables are for is told by their root element
    /// and the first number such as 1.7 in the name of the directory or file.
    Compile {
        /// Directory of the .xsd files of one schema, or a schema of one file
        path: PathBuf,
        /// Where to write the tables
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
}

/// `qcbus doctor`.
#[derive(Debug, ClapArgs)]
pub struct DoctorArgs {
    /// Which broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Directory of results to look into (default: that of the running broker, else qcbus-out)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// State directory to look into (default: that of the running broker, else OUT/.qcbus)
    #[arg(long, value_name = "DIR")]
    pub state: Option<PathBuf>,
}

/// Takes a standard reporter by its short name.
fn reporter() -> impl TypedValueParser<Value = &'static Registration> {
    let row = |it: &&'static Registration| PossibleValue::new(it.alias).help(it.about);
    let find = |alias: String| REPORTERS.into_iter().find(|it| it.alias == alias);
    PossibleValuesParser::new(REPORTERS.iter().map(row))
        .try_map(move |alias| find(alias).ok_or("there is no such reporter"))
}

/// Reads `NAME=VALUE`.
fn name_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("write NAME=VALUE".to_owned()),
    }
}

/// A number of threads.
fn threads(text: &str) -> Result<usize, String> {
    let number = text.parse().ok();
    let number = number.filter(|it| (1..=Permits::MOST).contains(it));
    number.ok_or_else(|| format!("`{text}` is no number from 1 to {}", Permits::MOST))
}

/// Reads `250ms`, `30s`, `5m`, `2h`, `90d`; a number alone is seconds.
pub fn duration(text: &str) -> Result<Duration, String> {
    let split = text
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let wrong = || format!("`{text}` is no time; write 250ms, 30s, 5m, 2h or 90d");
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

/// The time that files must rest.
fn rest(text: &str) -> Result<Duration, String> {
    let time = duration(text)?;
    let allowed = Duration::from_millis(10)..=Duration::from_secs(3600);
    let wrong = || format!("`{text}` is no time for files to rest; write one from 10ms to 1h");
    allowed.contains(&time).then_some(time).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }

    #[test]
    fn times_are_read_as_people_write_them() {
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
