//! What a broker is told at its start.

use std::path::PathBuf;
use std::time::Duration;

use qcbus_bus::{HostOptions, Instance};
use qcbus_formats::config::{Choice, Known};
use qcbus_formats::xqar::Dialect;
use qcbus_ingest::Limits;

use crate::core::{ChildSpec, Settings};
use crate::gate::Outside;
use crate::reload::Adapter;

/// Everything that a broker is told at its start.
#[derive(Debug, Clone)]
pub struct Options {
    /// The instance that it is.
    pub instance: Instance,
    /// Directories to look through, absolute and without symbolic links.
    pub roots: Vec<PathBuf>,
    /// Single files to check, absolute.
    pub files: Vec<PathBuf>,
    /// Whether to go on watching after the first look.
    pub watch: bool,
    /// Look around this often instead of relying on events.
    pub poll: Option<Duration>,
    /// Look around this often even when events arrive.
    pub rescan: Duration,
    /// How long files must be quiet that are written in place, also once they are closed.
    pub settle: Option<Duration>,
    /// Directory of the results.
    pub out: PathBuf,
    /// The directory of a single run, see [`crate::ResultPaths`].
    pub here: Option<PathBuf>,
    /// One file for the one result, instead of a directory of results.
    pub single_result: Option<PathBuf>,
    /// Directory of the journal; none: nothing is remembered.
    pub state: Option<PathBuf>,
    /// How long the history of jobs is kept.
    pub retention: Duration,
    /// What of all that would be demanded is asked for.
    pub choice: Choice,
    /// The form of the results.
    pub dialect: Dialect,
    /// Whether results are safe on the disk before they are announced.
    pub durable: bool,
    /// Whether a verdict file is written beside every result.
    pub verdict_files: bool,
    /// Directory in which accepted files are published.
    pub gate: Option<PathBuf>,
    /// What becomes there of files that depend on others outside of the watched directories.
    pub gate_outside: Outside,
    /// The configuration file.
    pub config: Option<PathBuf>,
    /// Directory of manifests of further bundles and reporters.
    pub bundles_d: Option<PathBuf>,
    /// The bundles and reporters that come with the program.
    pub standard: Vec<ChildSpec>,
    /// How to start a reporter that the configuration names, by our name for it.
    pub reporters: Vec<ChildSpec>,
    /// What can be said beforehand of the bundles that come with the program, for looking at the
    /// configuration.
    pub known: Known,
    /// Who has one-shot modules of ASAM's framework take part as bundles.
    pub adapter: Adapter,
    /// Whether children die with the broker at once.
    pub die_with_broker: bool,
    /// Whether bundles are confined.
    pub sandbox: bool,
    /// Most private memory of a child, in bytes.
    pub memory_limit: Option<u64>,
    /// Caps on what is read.
    pub limits: Limits,
    /// Shape of the bus.
    pub host: HostOptions,
    /// Shape of the state machine.
    pub settings: Settings,
}
