//! One module for each command.

mod asam_report;
mod bundle;
mod check;
mod config;
mod doctor;
mod expand;
mod health;
mod manifests;
mod new;
mod offered;
mod pack;
mod programs;
mod readiness;
mod remote;
mod report;
mod reporter;
mod rule;
mod schema;
mod serve;
mod settings;
mod status;
mod stops;
mod timeline;
mod trials;
mod upgrade;

use std::ffi::OsString;

use qcbus_messages::Exit;

use crate::args::{
    Args, BundleCommand, BundleRunArgs, Command, ConfigCommand, ReporterCommand, SchemaCommand,
};
use crate::{standard, talk};

/// Parses the command with which a broker starts a standard bundle: `bundle run NAME … --launch N`.
/// It is parsed by hand, because building the tree of all commands takes as long as the start of a
/// bundle may take. The regular parser handles every other command.
pub fn started_bundle(arguments: impl Iterator<Item = OsString>) -> Option<impl FnOnce() -> Exit> {
    let mut words = arguments;
    let is = |word: Option<OsString>, wanted: &str| word.is_some_and(|it| it == wanted);
    if !is(words.next(), "bundle") || !is(words.next(), "run") {
        return None;
    }
    let name = words.next()?.into_string().ok()?;
    let is_standard = standard::BUNDLES.iter().any(|it| it.alias == name);
    let arguments: Vec<OsString> = words.collect();
    let is_started = arguments.iter().any(|it| it == "--launch");
    let run = BundleRunArgs { name, arguments };
    (is_standard && is_started).then_some(move || bundle::run(run))
}

/// Parses the command with which a broker starts a module of ASAM's framework: `asam-adapter …`. It
/// is parsed by hand, too.
pub fn adapter(arguments: impl Iterator<Item = OsString>) -> Option<impl FnOnce() -> Exit> {
    let mut words = arguments;
    let is_it = words.next().is_some_and(|it| it == standard::ASAM_ADAPTER);
    is_it.then_some(move || {
        talk::log("warn");
        qcbus_asam_adapter::run(&[standard::ASAM_ADAPTER], words, talk::say_lines)
    })
}

/// Parses the command with which a broker starts a report module of ASAM's framework:
/// `asam-reporter …`.
pub fn asam_reporter(arguments: impl Iterator<Item = OsString>) -> Option<impl FnOnce() -> Exit> {
    let mut words = arguments;
    let is_it = words.next().is_some_and(|it| it == standard::ASAM_REPORTER);
    is_it.then_some(move || asam_report::run(words))
}

/// Runs the command of the command line.
pub fn run(args: Args) -> Exit {
    match args.command {
        Command::Check(args) => check::run(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Down(args) => remote::down(&args),
        Command::Status(args) => status::run(&args),
        Command::Wait(args) => remote::wait(&args),
        Command::Reload(args) => remote::reload(&args),
        Command::Bundle(BundleCommand::List(args)) => bundle::list(&args),
        Command::Bundle(BundleCommand::Run(args)) => bundle::run(args),
        Command::Bundle(BundleCommand::Add(args)) => manifests::add(&args),
        Command::Bundle(BundleCommand::Upgrade(args)) => upgrade::run(&args),
        Command::Bundle(BundleCommand::Remove(args)) => manifests::remove(&args),
        Command::Bundle(BundleCommand::Trials(args)) => trials::run(&args),
        Command::Bundle(BundleCommand::New(args)) => new::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Reporter(ReporterCommand::Run { name, bus }) => reporter::run(name, &bus),
        Command::Rule(args) => rule::run(&args),
        Command::Config(ConfigCommand::Check { file, bundles_d }) => {
            config::check(&file, bundles_d.as_deref())
        }
        Command::Schema(SchemaCommand::Compile { path, output }) => schema::compile(&path, &output),
        Command::Timeline(args) => timeline::run(&args),
        Command::Expand(args) => expand::run(&args),
        Command::Pack(args) => pack::run(&args),
        Command::Doctor(args) => doctor::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_commands_are_left_to_the_parser() {
        let is_started = |line: &str| {
            let words = line.split_whitespace().map(OsString::from);
            started_bundle(words).is_some()
        };
        assert!(is_started("bundle run xodr --instance-dir /d --launch 7"));
        assert!(is_started("bundle run xosc --schema-dir s --launch 7"));
        for other in [
            "",
            "check a.xodr",
            "bundle run",
            "bundle run xodr",
            "bundle run xodr --help",
            "bundle run --launch 7",
            "bundle run ./mine --launch 7",
            "bundle add xodr --launch 7",
        ] {
            assert!(!is_started(other), "{other}");
        }
    }
}
