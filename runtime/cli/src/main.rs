//! `qcbus`: the one program. It ties broker, standard bundles and reporters together and holds no
//! logic of its own.

mod args;
mod commands;
mod standard;
mod talk;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    qcbus_broker::memory::join_small_pieces();
    if let Some(run) = commands::started_bundle(std::env::args_os().skip(1)) {
        return talk::exit(run()).into();
    }
    if let Some(run) = commands::adapter(std::env::args_os().skip(1)) {
        return talk::exit(run()).into();
    }
    if let Some(run) = commands::asam_reporter(std::env::args_os().skip(1)) {
        return talk::exit(run()).into();
    }
    let args = match args::Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            let asked_for_it = !error.use_stderr();
            // A closed pipe is no reason to complain.
            let _ = error.print();
            let exit = if asked_for_it {
                qcbus_messages::Exit::Accepted
            } else {
                qcbus_messages::Exit::Usage
            };
            return exit.into();
        }
    };
    talk::exit(commands::run(args)).into()
}
