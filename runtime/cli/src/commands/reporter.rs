//! `qcbus reporter run`: a reporter daemon.

use qcbus_bus::Instance;
use qcbus_messages::Exit;
use qcbus_reporter_sdk::{Identity, Registration, Reporter, RunError, Setting};

use super::settings::instance;
use crate::args::BusArgs;
use crate::{standard, talk};

/// Runs the command.
pub fn run(which: &Registration, bus: &BusArgs) -> Exit {
    talk::log("warn");
    let instance = match instance(&bus.instance) {
        Ok(instance) => instance,
        Err(why) => {
            talk::fail(&why);
            return Exit::Usage;
        }
    };
    let mut reporter = (which.make)(&Setting {
        color: talk::color(),
        // A private run reports its own files only, without those of earlier runs.
        keep: !bus.die_with_parent,
        is_run: false,
        pages: standard::page,
    });
    let identity = Identity {
        name: which.name.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        launch: bus.launch,
    };
    serve(&instance, &identity, reporter.as_mut())
}

/// Reports on the bus of an instance until it is asked to stop.
pub fn serve(instance: &Instance, identity: &Identity, reporter: &mut dyn Reporter) -> Exit {
    let runtime = match tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
    {
        Ok(runtime) => runtime,
        Err(error) => {
            talk::fail(&error.to_string());
            return Exit::Internal;
        }
    };
    match runtime.block_on(qcbus_reporter_sdk::run(instance, identity, reporter)) {
        Ok(()) => Exit::Accepted,
        Err(error) => {
            talk::fail(&format!("failed to {error}"));
            match error {
                RunError::Join(_) => Exit::NoBroker,
                RunError::Closed(_) => Exit::Internal,
            }
        }
    }
}
