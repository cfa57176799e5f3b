//! One command, one file.

mod bundle;
mod check;
mod config;
mod doctor;
mod expand;
mod manifests;
mod pack;
mod remote;
mod report;
mod reporter;
mod rule;
mod schema;
mod serve;
mod settings;
mod status;
mod stops;

use qcbus_messages::Exit;

use crate::args::{Args, BundleCommand, Command, ConfigCommand, ReporterCommand, SchemaCommand};

/// Does what the command line says.
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
        Command::Bundle(BundleCommand::Remove(args)) => manifests::remove(&args),
        Command::Report(args) => report::run(&args),
        Command::Reporter(ReporterCommand::Run { name, bus }) => reporter::run(name, &bus),
        Command::Rule(args) => rule::run(&args),
        Command::Config(ConfigCommand::Check { file, bundles_d }) => {
            config::check(&file, bundles_d.as_deref())
        }
        Command::Schema(SchemaCommand::Compile { path, output }) => schema::compile(&path, &output),
        Command::Expand(args) => expand::run(&args),
        Command::Pack(args) => pack::run(&args),
        Command::Doctor(args) => doctor::run(&args),
    }
}
