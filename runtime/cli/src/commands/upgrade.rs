//! `qcbus bundle upgrade`: starts the newer program of an added bundle.

use std::path::Path;

use qcbus_disk::write_whole;
use qcbus_messages::Exit;
use qcbus_messages::control::{BundleReadiness, Readiness, Runs};
use qcbus_messages::path_text::to_text;

use super::manifests::{Home, Refusal, said, usage};
use super::programs::command_line;
use super::readiness;
use crate::args::{BundleUpgradeArgs, ManifestArgs};

/// Runs the command.
pub fn run(args: &BundleUpgradeArgs) -> Exit {
    said(upgrade(args))
}

fn upgrade(args: &BundleUpgradeArgs) -> Result<String, Refusal> {
    let name = &args.name;
    let home = Home::find(&ManifestArgs {
        instance: args.instance.clone(),
        bundles_d: None,
        offline: false,
    })?;
    let _alone = home.alone()?;
    let was = before(&home, name)?;
    let path = home.manifest(name);
    let wanted = match (args.shadow, args.no_shadow) {
        (true, _) => Some(true),
        (_, true) => Some(false),
        _ => None,
    };
    let command = match args.command.is_empty() {
        true => was.command.clone().unwrap_or_default(),
        false => command_line(&args.command)?,
    };
    let taken_from = match args.command.is_empty() && wanted.is_none() {
        true => None,
        false => Some(change(&path, name, &command, wanted)?),
    };
    let notices = match home.reload() {
        Ok(notices) => notices.unwrap_or_default(),
        Err((exit, why)) => {
            let then = taken_from.map(|bytes| home.take_back(&path, Some(&bytes)));
            let then = then.map(|it| format!("; {it}")).unwrap_or_default();
            return Err((exit, format!("`{name}` was not upgraded: {why}{then}")));
        }
    };
    match readiness::wait(&home, name, &command, args.timeout) {
        Ok(runs) => Ok(done(&home, name, &was, &runs, &notices)),
        Err((exit, why)) => {
            let taken_from = taken_from.filter(|_| !args.keep);
            let then = taken_from.map(|bytes| home.take_back(&path, Some(&bytes)));
            let then = then.map(|it| format!("; {it}")).unwrap_or_default();
            let goes_on = goes_on(&home, name);
            let why = format!("`{name}` is not upgraded: {why}{then}; {goes_on}");
            Err((exit, why))
        }
    }
}

/// Returns the state of the bundle before the upgrade.
fn before(home: &Home, name: &str) -> Result<BundleReadiness, Refusal> {
    let Some(broker) = home.broker() else {
        return Err((Exit::NoBroker, "no broker runs".to_owned()));
    };
    let readiness = readiness::readiness(broker, name)?;
    let readiness = readiness.filter(|it| it.command.is_some()).map(|it| *it);
    readiness.ok_or_else(|| {
        usage(format!(
            "no manifest contains `{name}`: bundles of qcbus are upgraded with qcbus, bundles that were started \
             by hand must be restarted by hand, and `qcbus bundle add` adds new ones"
        ))
    })
}

/// Sets the command of a manifest and, if given, its shadow flag. Returns the bytes of the manifest
/// before the change.
fn change(
    path: &Path,
    name: &str,
    command: &str,
    shadow: Option<bool>,
) -> Result<Vec<u8>, Refusal> {
    let shown = to_text(path);
    let bytes = std::fs::read(path).map_err(|error| {
        usage(format!(
            "cannot read {shown}: {error}; change the command in the manifest that contains `{name}`"
        ))
    })?;
    let parsed = serde_json::from_slice(&bytes);
    let mut manifest: serde_json::Value =
        parsed.map_err(|error| usage(format!("cannot read {shown}: {error}")))?;
    let modules = manifest.get_mut("module").and_then(|it| it.as_array_mut());
    let mut modules = modules.into_iter().flatten();
    let module = modules.find(|it| it.get("name").is_some_and(|it| it == name));
    let Some(module) = module.and_then(|it| it.as_object_mut()) else {
        return Err(usage(format!("{shown} does not contain `{name}`")));
    };
    module.insert("exec_command".to_owned(), command.into());
    match shadow {
        Some(true) => drop(module.insert("shadow".to_owned(), true.into())),
        Some(false) => drop(module.remove("shadow")),
        None => {}
    }
    let text = format!("{manifest:#}\n");
    write_whole(path, text.as_bytes(), true)
        .map_err(|error| (Exit::Internal, format!("cannot write {shown}: {error}")))?;
    Ok(bytes)
}

fn done(home: &Home, name: &str, was: &BundleReadiness, runs: &Runs, notices: &[String]) -> String {
    let now = home
        .broker()
        .and_then(|it| readiness::readiness(it, name).ok());
    let spec = now.flatten().map(|it| it.spec);
    if spec == Some(was.spec) && was.readiness == Readiness::Ready {
        let nothing = "; nothing has changed: the running program is the current one (`touch` it if a file that \
                       it loads has changed)";
        return readiness::ready(name, runs, nothing, notices);
    }
    let was = match &was.runs {
        Some(before) => {
            let judges = match (before.shadow, runs.shadow) {
                (true, false) => "; it affects verdicts from now on",
                (false, true) => "; it no longer affects verdicts",
                _ => "",
            };
            format!(
                " (was {}, version {} -> {}){judges}",
                before.checkers, before.version, runs.version
            )
        }
        None => " (no process ran before)".to_owned(),
    };
    readiness::ready(name, runs, &was, notices)
}

/// Returns a text about the process that judges now.
fn goes_on(home: &Home, name: &str) -> String {
    let broker = home.broker();
    let readiness = broker.and_then(|it| readiness::readiness(it, name).ok());
    match readiness.flatten().and_then(|it| it.runs) {
        Some(runs) => format!(
            "the previous process continues ({}, version {}, {})",
            runs.pid,
            runs.version,
            readiness::counted(runs.checkers)
        ),
        None => {
            "no process replaces it, so the files that it must check are undetermined".to_owned()
        }
    }
}
