//! The bus process: learns the properties of a module and then runs as its bundle.

use std::ffi::OsString;

use qcbus_messages::Exit;
use qcbus_sdk::Mode;
use qcbus_sdk::run::OwnFiles;

use crate::bundle::bundle;
use crate::hosted::{Asked, Hosted, parse};
use crate::learn::learn;
use crate::program::Program;
use crate::runner;
use crate::runners::Runners;

/// Runs the adapter. `program` has the words after the program name that select the adapter, such
/// as `asam-adapter`. `arguments` are the words after them. Messages go to the log. Errors that
/// prevent the start go to `complain`.
pub fn run(
    program: &[&str],
    arguments: impl IntoIterator<Item = OsString>,
    complain: impl Fn(&str),
) -> Exit {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let Asked {
        hosted,
        is_runner,
        rest,
    } = match parse(arguments.clone()) {
        Ok(asked) => asked,
        Err(error) => {
            complain(&format!("asam-adapter: {error}"));
            return Exit::Usage;
        }
    };
    if is_runner {
        return runner::serve(&hosted);
    }
    let mode = match Mode::parse(rest) {
        Ok(mode) => mode,
        Err(error) => {
            complain(&format!("asam-adapter: {error}"));
            return Exit::Usage;
        }
    };
    // With a broker several jobs run at the same time. A single file is one job.
    let count = match &mode {
        Mode::Bus(options) => options.threads,
        _ => 1,
    };
    match begin(hosted, count, program, &arguments) {
        Ok(bundle) => qcbus_sdk::run::run(bundle, mode.reading(own())),
        Err(why) => {
            complain(&why);
            Exit::Internal
        }
    }
}

fn begin(
    mut hosted: Hosted,
    count: usize,
    program: &[&str],
    arguments: &[OsString],
) -> Result<&'static qcbus_sdk::Bundle, String> {
    // The digests are taken before the first run, and each run compares them.
    hosted.programs.iter_mut().for_each(Program::look);
    let name = hosted.name.clone();
    let runners = Runners::start(count, &hosted, program, arguments)
        .map_err(|error| format!("`{name}` cannot be run: {error}"))?;
    let learned = learn(&hosted, &runners)
        .map_err(|why| format!("`{name}` cannot be used as a bundle: {why}"))?;
    Ok(bundle(hosted, learned, runners))
}

/// Returns the bus process's permissions. The files in the manifest are for the runners.
fn own() -> OwnFiles {
    OwnFiles {
        restricted: true,
        ..OwnFiles::default()
    }
}
