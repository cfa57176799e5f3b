//! Report module of ASAM's framework on the bus: runs for every result and writes its output beside
//! the result.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use qcbus_asam_adapter::ReportModule;
use qcbus_bus::Instance;
use qcbus_messages::path_text::from_text;
use qcbus_messages::{Exit, ResultMessage, Withdrawn};
use qcbus_reporter_sdk::{Identity, ReportError, Reporter, Sources, replace_file};
use qcbus_sdk::Mode;

use super::reporter::serve;
use crate::{standard, talk};

/// Runs the command.
pub fn run(arguments: impl Iterator<Item = OsString>) -> Exit {
    talk::log("warn");
    match begin(arguments) {
        Ok((mut reporter, instance, identity)) => serve(&instance, &identity, &mut reporter),
        Err((exit, why)) => {
            talk::fail(&format!("{}: {why}", standard::ASAM_REPORTER));
            exit
        }
    }
}

fn begin(
    arguments: impl Iterator<Item = OsString>,
) -> Result<(HostedReporter, Instance, Identity), (Exit, String)> {
    // This runs before any thread exists, because the runner is forked from this process.
    let (module, rest) = ReportModule::start(&[standard::ASAM_ADAPTER], arguments)?;
    let usage = |why: String| (Exit::Usage, why);
    let Mode::Bus(bus) = Mode::parse(rest).map_err(|error| usage(error.to_string()))? else {
        return Err(usage("it runs only on the bus".to_owned()));
    };
    let instance = match bus.instance_dir {
        Some(directory) => Ok(Instance::at(directory)),
        None => Instance::named(&bus.instance),
    };
    let instance = instance.map_err(|error| usage(error.to_string()))?;
    let identity = Identity {
        name: module.name().to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        launch: bus.launch,
    };
    Ok((HostedReporter { module }, instance, identity))
}

struct HostedReporter {
    module: ReportModule,
}

impl HostedReporter {
    /// Returns the output directory for a result: `a.xodr.xqar` has `a.xodr.NAME/` beside it.
    fn place(&self, xqar: &str) -> PathBuf {
        let stem = xqar.strip_suffix(".xqar").unwrap_or(xqar);
        from_text(&format!("{stem}.{}", self.module.name()))
    }
}

impl Reporter for HostedReporter {
    fn report(&mut self, result: &ResultMessage, _: &dyn Sources) -> Result<(), ReportError> {
        let xqar = from_text(&result.xqar);
        let files = self.module.report(&xqar, &result.params);
        let files = files.map_err(ReportError::Form)?;
        let place = self.place(&result.xqar);
        let mut written = BTreeSet::new();
        for (name, bytes) in &files {
            let path = place.join(name);
            replace_file(&path, bytes)?;
            written.insert(path);
        }
        // Files of an earlier result that this one did not write again are removed.
        remove_others(&place, &written)
    }

    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError> {
        remove_others(&self.place(&gone.xqar), &BTreeSet::new())
    }
}

/// Removes all files of a directory except `kept`, and all directories that become empty, including
/// the directory itself.
fn remove_others(directory: &Path, kept: &BTreeSet<PathBuf>) -> Result<(), ReportError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| ReportError::Write { path, source }
    };
    let entries = match std::fs::read_dir(directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(failed(directory)(error)),
    };
    for entry in entries {
        let entry = entry.map_err(failed(directory))?;
        let path = entry.path();
        if entry.file_type().is_ok_and(|it| it.is_dir()) {
            remove_others(&path, kept)?;
        } else if !kept.contains(&path) {
            std::fs::remove_file(&path).map_err(failed(&path))?;
        }
    }
    // A directory that is not empty stays.
    let _ = std::fs::remove_dir(directory);
    Ok(())
}
