//! Options of a broker at its start.

use std::path::PathBuf;
use std::time::Duration;

use qcbus_bus::{HostOptions, Instance};
use qcbus_configuration::Adapter;
use qcbus_formats::config::{Choice, Known};
use qcbus_formats::xqar::Dialect;
use qcbus_ingest::Limits;
use qcbus_publish::gate::Outside;
use qcbus_types::{ChildSpec, Settings};

/// Options of a broker at its start.
#[derive(Debug, Clone)]
pub struct Options {
    /// Instance of this broker.
    pub instance: Instance,
    /// Directories to search, absolute and without symbolic links.
    pub roots: Vec<PathBuf>,
    /// Single files to check, absolute.
    pub files: Vec<PathBuf>,
    /// Whether to continue watching after the first scan.
    pub watch: bool,
    /// Interval of scans that replace events.
    pub poll: Option<Duration>,
    /// Interval of scans in addition to events.
    pub rescan: Duration,
    /// Time without changes that a file written in place must have, even after it is closed.
    pub settle: Option<Duration>,
    /// Directory of the results.
    pub out: PathBuf,
    /// Directory of a single run, see [`crate::ResultPaths`].
    pub here: Option<PathBuf>,
    /// Single file for the only result, in place of a directory of results.
    pub single_result: Option<PathBuf>,
    /// Directory of the journal. `None`: no state is stored.
    pub state: Option<PathBuf>,
    /// Retention time of the job history.
    pub retention: Duration,
    /// Selection among the demanded checkers.
    pub choice: Choice,
    /// Whether findings have the levels of ASAM, whatever the configuration says.
    pub strict: bool,
    /// Whether findings about one fault stay separate issues.
    pub all: bool,
    /// Dialect of the results.
    pub dialect: Dialect,
    /// Whether results are flushed to the disk before they are announced.
    pub durable: bool,
    /// Whether a verdict file is written next to every result.
    pub verdict_files: bool,
    /// Directory in which accepted files are published.
    pub gate: Option<PathBuf>,
    /// Treatment of accepted files that depend on files outside of the watched directories.
    pub gate_outside: Outside,
    /// The configuration file.
    pub config: Option<PathBuf>,
    /// Directory of manifests of further bundles and reporters.
    pub bundles_d: Option<PathBuf>,
    /// The bundles and reporters that come with the program.
    pub standard: Vec<ChildSpec>,
    /// Start commands of reporters that the configuration may name, by their qcbus names.
    pub reporters: Vec<ChildSpec>,
    /// Known facts about the bundles that come with the program, used to validate the configuration.
    pub known: Known,
    /// Adapter that runs ASAM modules as bundles.
    pub adapter: Adapter,
    /// Whether children end immediately when the broker ends.
    pub die_with_broker: bool,
    /// Whether bundles run in the sandbox.
    pub sandbox: bool,
    /// Maximum private memory of a child, in bytes.
    pub memory_limit: Option<u64>,
    /// Limits for reading files.
    pub limits: Limits,
    /// Options of the bus.
    pub host: HostOptions,
    /// Settings of the state machine.
    pub settings: Settings,
}
