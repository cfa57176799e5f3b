//! Arguments of `qcbus bundle`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args as ClapArgs, Subcommand};

use super::{InstanceArgs, StatusArgs, duration};

/// `qcbus bundle …`.
#[derive(Debug, Subcommand)]
pub enum BundleCommand {
    /// List the standard bundles and those of a broker
    List(StatusArgs),
    /// Run a bundle: on the bus, on one FILE, or as an ASAM module with -c
    Run(BundleRunArgs),
    /// Make a running broker start one more bundle, and report whether it is ready
    Add(BundleAddArgs),
    /// Make a running broker switch to a newer program of an added bundle
    Upgrade(BundleUpgradeArgs),
    /// Make a running broker drain an added bundle
    Remove(BundleRemoveArgs),
    /// Show the findings of a shadow, and the verdicts that it would change
    Trials(BundleTrialsArgs),
    /// Create a directory with a new bundle, which runs and has a rule, its page and a test
    New(BundleNewArgs),
}

/// `qcbus bundle run`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "Arguments of a bundle:\n  \
[--instance NAME | --instance-dir DIR]  join the bus of a running broker\n  \
[--no-sandbox]                          with it: do not confine the bundle\n  \
[--format text|json] [--timings] FILE   check one file, print what was found (and timings)\n  \
-c CONFIG                               run as a module of ASAM's framework\n  \
[--schema-dir DIR]                      with each of them: schemas to use instead of the known ones")]
pub struct BundleRunArgs {
    /// A standard bundle (xodr, xosc, modular) or the program of a bundle
    pub name: String,
    /// Arguments for the bundle; without any it joins the bus of the default instance
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENT"
    )]
    pub arguments: Vec<std::ffi::OsString>,
}

/// Options with which a daemon joins the bus.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct BusArgs {
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Number given by the broker that starts this process
    #[arg(long, hide = true)]
    pub launch: Option<u64>,
    /// Exit at once when the parent process dies
    #[arg(long, hide = true)]
    pub die_with_parent: bool,
}

/// `qcbus bundle add`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "A bundle that does not become ready is removed again, because everything that it judges would \
                  be undetermined.\n\nExamples:\n  qcbus bundle add mine /opt/mine/bundle -- --its-own-flag\n  \
                  qcbus bundle add rules ./rules.py       with the python3 beside qcbus, or from PATH"
)]
pub struct BundleAddArgs {
    /// Name of the bundle as the bundle itself reports it
    pub name: String,
    /// The program (or script.py) and its arguments; put `--` before arguments that begin with `-`
    #[arg(required_unless_present = "asam")]
    pub command: Vec<String>,
    /// Shell command of an ASAM module, to be used instead of a program, such as 'qc_opendrive -c
    /// $ASAM_QC_FRAMEWORK_CONFIG_FILE'
    #[arg(long, value_name = "COMMAND", conflicts_with = "command")]
    pub asam: Option<String>,
    /// Let it check every file without effect on any verdict; `qcbus bundle trials` shows the
    /// possible changes
    #[arg(long)]
    pub shadow: bool,
    /// Keep it even if it does not become ready
    #[arg(long)]
    pub keep: bool,
    /// Maximum time to wait until it is ready
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration)]
    pub timeout: Duration,
    /// Selection of the broker and of the manifest directory.
    #[command(flatten)]
    pub manifests: ManifestArgs,
}

/// `qcbus bundle upgrade`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "The previous process continues until the newer one is ready. A program that is replaced at its \
                  path is also detected without this command; this command reports the outcome."
)]
pub struct BundleUpgradeArgs {
    /// The bundle's name
    pub name: String,
    /// New program and its arguments (default: the program at the previous path)
    pub command: Vec<String>,
    /// Let a shadow decide verdicts from now on
    #[arg(long)]
    pub no_shadow: bool,
    /// Let it check without effect on any verdict from now on
    #[arg(long, conflicts_with = "no_shadow")]
    pub shadow: bool,
    /// Keep the changes to the manifest even if it does not become ready
    #[arg(long)]
    pub keep: bool,
    /// Maximum time to wait until it is ready
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration)]
    pub timeout: Duration,
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
}

/// `qcbus bundle trials`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "A shadow is a bundle that was added with --shadow. `qcbus bundle upgrade NAME --no-shadow` \
                  lets it judge.\n\nExit codes: 0 nothing would be rejected or undetermined because of it, 1 \
                  something would be rejected, 3 something would be undetermined, or it has not tried everything \
                  yet, or has tried nothing"
)]
pub struct BundleTrialsArgs {
    /// Name of the shadow
    pub name: String,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
}

/// `qcbus bundle new`.
#[derive(Debug, ClapArgs)]
#[command(group = clap::ArgGroup::new("language").required(true))]
pub struct BundleNewArgs {
    /// Name of the bundle and of the directory
    pub name: String,
    /// Use Python, with the package `qcbus`
    #[arg(long, group = "language")]
    pub python: bool,
    /// Use Rust, with the SDK of a checkout of qcbus
    #[arg(long, group = "language")]
    pub rust: bool,
    /// Checkout of qcbus with the SDK to use (default: the one from which this program was built)
    #[arg(long, value_name = "DIR", conflicts_with = "python")]
    pub sdk: Option<PathBuf>,
}

/// Location of the manifest of a bundle.
#[derive(Debug, ClapArgs)]
pub struct ManifestArgs {
    /// Selection of the broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Directory of bundle manifests (default: the one that the broker watches)
    #[arg(long, value_name = "DIR")]
    pub bundles_d: Option<PathBuf>,
    /// For a broker that is not running (default directory: qcbus-out/.qcbus/bundles.d)
    #[arg(long)]
    pub offline: bool,
}

/// `qcbus bundle remove`.
#[derive(Debug, ClapArgs)]
pub struct BundleRemoveArgs {
    /// The bundle's name
    pub name: String,
    /// Selection of the broker and of the manifest directory.
    #[command(flatten)]
    pub manifests: ManifestArgs,
}
