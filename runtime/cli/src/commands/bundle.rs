//! `qcbus bundle list` and `qcbus bundle run`.

use std::os::unix::process::CommandExt;

use qcbus_control::{AskError, ask_broker};
use qcbus_messages::control::{Request, Response};
use qcbus_messages::{Exit, shown};
use qcbus_sdk::run::Mode;

use crate::args::{BundleRunArgs, StatusArgs};
use crate::{standard, talk};

/// Runs `qcbus bundle list`.
pub fn list(args: &StatusArgs) -> Exit {
    let instance = match super::settings::instance(&args.instance) {
        Ok(instance) => instance,
        Err(why) => {
            talk::fail(&why);
            return Exit::Usage;
        }
    };
    // The list is useful without a broker too.
    let (running, absent) = match ask_broker(instance.dir(), &Request::Status) {
        Ok(Response::Status(status)) => (status.peers, "not running"),
        Err(AskError::NoBroker { .. }) => (Vec::new(), "not running"),
        Ok(other) => {
            talk::fail(&format!("unexpected answer: {other:?}"));
            (Vec::new(), "unknown")
        }
        Err(error) => {
            talk::fail(&format!("the running bundles are unknown: {error}"));
            (Vec::new(), "unknown")
        }
    };
    let mut rows: Vec<[String; 5]> = Vec::new();
    for bundle in standard::BUNDLES {
        let state = running
            .iter()
            .find(|peer| peer.name == bundle.name)
            .map_or(absent, |peer| &peer.state);
        let checkers = bundle.checkers().len().to_string();
        rows.push([
            bundle.name.into(),
            bundle.version.into(),
            checkers,
            state.into(),
            bundle.description.into(),
        ]);
    }
    for peer in running.iter().filter(|peer| peer.role == "bundle") {
        if standard::bundle(&peer.name).is_none() {
            rows.push([
                peer.name.clone(),
                peer.version.clone(),
                peer.checkers.to_string(),
                match peer.trials {
                    Some(_) => format!("{}, a shadow", peer.state),
                    None => peer.state.clone(),
                },
                peer.note.clone(),
            ]);
        }
    }
    if args.json {
        let list: Vec<_> = rows.iter().map(|[name, version, checkers, state, about]| {
            serde_json::json!({"name": name, "version": version, "checkers": checkers, "state": state, "about": about})
        }).collect();
        talk::print(&format!("{}\n", serde_json::Value::from(list)));
    } else {
        for [name, version, checkers, state, about] in rows {
            let row =
                format!("{name:<16} {version:<8} {checkers:>4} checkers  {state:<12} {about}");
            talk::print(&format!("{}\n", shown::line(&row)));
        }
    }
    Exit::Accepted
}

/// Runs `qcbus bundle run`.
pub fn run(args: BundleRunArgs) -> Exit {
    talk::log("warn");
    let Some(bundle) = standard::bundle(&args.name) else {
        return run_program(&args);
    };
    match Mode::parse(args.arguments) {
        Ok(mode) => qcbus_sdk::run::run(bundle, mode),
        Err(error) => {
            talk::fail(&error.to_string());
            talk::say_lines(&format!("\n{}", qcbus_sdk::run::USAGE));
            Exit::Usage
        }
    }
}

/// Replaces this process by the program of a bundle.
fn run_program(args: &BundleRunArgs) -> Exit {
    let is_path = args.name.contains('/');
    let error = std::process::Command::new(&args.name)
        .args(&args.arguments)
        .exec();
    let names: Vec<&str> = standard::BUNDLES
        .iter()
        .map(|bundle| bundle.alias)
        .collect();
    let hint = if is_path {
        String::new()
    } else {
        format!("; the standard bundles are {}", names.join(" and "))
    };
    talk::fail(&format!("cannot run `{}`: {error}{hint}", args.name));
    Exit::Usage
}
