//! `qcbus`: the main program. It connects broker, standard bundles and reporters and contains no
//! logic of its own.

mod args;
mod commands;
mod standard;
mod talk;

use std::ffi::CString;
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    name_as_called();
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
            // A closed pipe is not an error.
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

/// Sets the name of the process. A broker starts its own program as `/proc/self/exe`, so `ps` and
/// `top` would list it as `exe`.
fn name_as_called() {
    let called = std::env::args_os().next().unwrap_or_default();
    let name = Path::new(&called).file_name().unwrap_or_default();
    if let Ok(name) = CString::new(name.as_encoded_bytes()) {
        // The process works under another name as well.
        let _ = rustix::thread::set_name(&name);
    }
}
