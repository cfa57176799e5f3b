//! What is said to `qcbus bundle`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args as ClapArgs, Subcommand};

use super::{InstanceArgs, StatusArgs, duration};

/// `qcbus bundle …`.
#[derive(Debug, Subcommand)]
pub enum BundleCommand {
    /// List the standard bundles and those that a broker has
    List(StatusArgs),
    /// Run a bundle: on the bus, on one FILE, or as an ASAM module with -c
    Run(BundleRunArgs),
    /// Let a running broker start one more bundle, and say whether it is ready
    Add(BundleAddArgs),
    /// Let a running broker go over to the newer program of a bundle that was added
    Upgrade(BundleUpgradeArgs),
    /// Let a running broker drain a bundle that was added
    Remove(BundleRemoveArgs),
    /// Show what a shadow has found, and which verdicts it would change
    Trials(BundleTrialsArgs),
    /// Make a directory with a bundle of one's own, which runs and has a rule, its page and a test
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
    /// A standard bundle (xodr, xosc, modular) or a program that is a bundle
    pub name: String,
    /// Arguments for the bundle; without any it joins the bus of the default instance
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENT"
    )]
    pub arguments: Vec<std::ffi::OsString>,
}

/// How a daemon joins the bus.
#[derive(Debug, Clone, Default, ClapArgs)]
pub struct BusArgs {
    /// Which broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Given by the broker that starts this process
    #[arg(long, hide = true)]
    pub launch: Option<u64>,
    /// Leave at once when the process that started this one dies
    #[arg(long, hide = true)]
    pub die_with_parent: bool,
}

/// `qcbus bundle add`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "A bundle that does not become ready is taken out again, for what it would judge would be \
undetermined.\n\nExamples:\n  \
qcbus bundle add mine /opt/mine/bundle -- --its-own-flag\n  \
qcbus bundle add rules ./rules.py       with the python3 beside qcbus, or of PATH"
)]
pub struct BundleAddArgs {
    /// The bundle's name, as it says it itself
    pub name: String,
    /// The program (or script.py) and its arguments; put `--` before arguments that begin with `-`
    #[arg(required_unless_present = "asam")]
    pub command: Vec<String>,
    /// Instead: the command of a one-shot module of ASAM's framework, for a shell, such as
    /// 'qc_opendrive -c $ASAM_QC_FRAMEWORK_CONFIG_FILE'
    #[arg(long, value_name = "COMMAND", conflicts_with = "command")]
    pub asam: Option<String>,
    /// Let it look at every file without weight in any verdict; `qcbus bundle trials` shows what it would change
    #[arg(long)]
    pub shadow: bool,
    /// Leave it in when it does not become ready
    #[arg(long)]
    pub keep: bool,
    /// Wait this long until it is ready
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration)]
    pub timeout: Duration,
    /// Which broker, and which directory.
    #[command(flatten)]
    pub manifests: ManifestArgs,
}

/// `qcbus bundle upgrade`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "The process before goes on until the newer one is ready. A program that is replaced at \
its path is noticed without this command, too; this one says what became of it."
)]
pub struct BundleUpgradeArgs {
    /// The bundle's name
    pub name: String,
    /// Another program and its arguments; without, what lies at the path of the one before
    pub command: Vec<String>,
    /// Let a shadow judge from now on
    #[arg(long)]
    pub no_shadow: bool,
    /// Let it look without weight in any verdict from now on
    #[arg(long, conflicts_with = "no_shadow")]
    pub shadow: bool,
    /// Leave what was changed in the manifest when it does not become ready
    #[arg(long)]
    pub keep: bool,
    /// Wait this long until it is ready
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration)]
    pub timeout: Duration,
    /// Which broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
}

/// `qcbus bundle trials`.
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "A shadow is a bundle that was added with --shadow. `qcbus bundle upgrade NAME --no-shadow` lets it \
judge.\n\nExit codes: 0 nothing would be rejected or undetermined because of it, 1 something would be rejected, 3 something \
would be undetermined, it has not tried everything yet, or nothing at all"
)]
pub struct BundleTrialsArgs {
    /// The shadow's name
    pub name: String,
    /// As JSON
    #[arg(long)]
    pub json: bool,
    /// Which broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
}

/// `qcbus bundle new`.
#[derive(Debug, ClapArgs)]
#[command(group = clap::ArgGroup::new("language").required(true))]
pub struct BundleNewArgs {
    /// The bundle's name; the directory is called so, too
    pub name: String,
    /// In Python, with the package `qcbus`
    #[arg(long, group = "language")]
    pub python: bool,
    /// In Rust, with the SDK of a checkout of qcbus
    #[arg(long, group = "language")]
    pub rust: bool,
    /// The checkout of qcbus whose SDK it is built with (default: the one that this program was built from)
    #[arg(long, value_name = "DIR", conflicts_with = "python")]
    pub sdk: Option<PathBuf>,
}

/// Where the manifest of a bundle lies.
#[derive(Debug, ClapArgs)]
pub struct ManifestArgs {
    /// Which broker.
    #[command(flatten)]
    pub instance: InstanceArgs,
    /// Directory of bundle manifests (default: the one that the broker watches)
    #[arg(long, value_name = "DIR")]
    pub bundles_d: Option<PathBuf>,
    /// For a broker that does not run now (default directory: qcbus-out/.qcbus/bundles.d)
    #[arg(long)]
    pub offline: bool,
}

/// `qcbus bundle remove`.
#[derive(Debug, ClapArgs)]
pub struct BundleRemoveArgs {
    /// The bundle's name
    pub name: String,
    /// Which broker, and which directory.
    #[command(flatten)]
    pub manifests: ManifestArgs,
}
