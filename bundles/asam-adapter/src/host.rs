//! The bus process: learns what a module is, and is its bundle from then on.

use std::ffi::OsString;

use qcbus_messages::Exit;
use qcbus_sdk::Mode;
use qcbus_sdk::run::OwnFiles;

use crate::bundle::bundle;
use crate::hosted::{Asked, Hosted, parse};
use crate::learn::learn;
use crate::runner;
use crate::runners::Runners;

/// Runs the adapter. `program` are the words behind the name of the program that lead here, such as `asam-adapter`;
/// `arguments` what follows them. What there is to say goes to the log, and where that ends by itself to `complain`.
pub fn run(
    program: &[&str],
    arguments: impl IntoIterator<Item = OsString>,
    complain: impl Fn(&str),
) -> Exit {
    let Asked {
        hosted,
        is_runner,
        rest,
    } = match parse(arguments) {
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
    // Beside a broker several jobs are under way at the same time; a file is one.
    let count = match &mode {
        Mode::Bus(options) => options.threads,
        _ => 1,
    };
    match begin(hosted, count, program) {
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
) -> Result<&'static qcbus_sdk::Bundle, String> {
    // Before anything is run: each run looks whether they are still the same.
    hosted.programs.iter_mut().for_each(crate::Program::look);
    let name = hosted.name.clone();
    let runners = Runners::start(count, &hosted, program)
        .map_err(|error| format!("`{name}` cannot be run: {error}"))?;
    let learned = learn(&hosted, &runners)
        .map_err(|why| format!("`{name}` is of no use as a bundle: {why}"))?;
    Ok(bundle(hosted, learned, runners))
}

/// It reads nothing of its own, and what its manifest declares is for what the offices run.
fn own() -> OwnFiles {
    OwnFiles {
        restricted: true,
        ..OwnFiles::default()
    }
}
