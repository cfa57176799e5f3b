//! `qcbus bundle …`.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};

use qcbus_messages::Exit;
use qcbus_messages::control::{Request, Response};
use qcbus_sdk::run::Mode;

use super::settings::absolute;
use crate::args::{BundleAddArgs, BundleRemoveArgs, BundleRunArgs, StatusArgs};
use crate::{standard, talk};

/// `qcbus bundle list`.
pub fn list(args: &StatusArgs) -> Exit {
    let instance = match super::settings::instance(&args.instance) {
        Ok(instance) => instance,
        Err(why) => {
            talk::fail(&why);
            return Exit::Usage;
        }
    };
    // The list is of use without a broker, too.
    let running = match qcbus_broker::control::ask_broker(instance.dir(), &Request::Status) {
        Ok(Response::Status(status)) => status.peers,
        _ => Vec::new(),
    };
    let mut rows: Vec<[String; 5]> = Vec::new();
    for bundle in standard::BUNDLES {
        let state = running
            .iter()
            .find(|peer| peer.name == bundle.name)
            .map_or("not running", |peer| &peer.state);
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
                peer.state.clone(),
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
            talk::print(&format!(
                "{name:<16} {version:<8} {checkers:>4} checkers  {state:<12} {about}\n"
            ));
        }
    }
    Exit::Accepted
}

/// `qcbus bundle run`.
pub fn run(args: BundleRunArgs) -> Exit {
    talk::log("warn");
    let Some(bundle) = standard::bundle(&args.name) else {
        return run_program(&args);
    };
    match Mode::parse(args.arguments) {
        Ok(mode) => qcbus_sdk::run::run(bundle, mode),
        Err(error) => {
            talk::fail(&format!("{error}\n\n{}", qcbus_sdk::run::USAGE));
            Exit::Usage
        }
    }
}

/// Becomes a program that is a bundle.
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

fn manifests(given: Option<&Path>) -> PathBuf {
    absolute(given.unwrap_or(Path::new("qcbus-out/.qcbus/bundles.d")))
}

/// `qcbus bundle add`: writes the manifest that the broker watches for.
pub fn add(args: &BundleAddArgs) -> Exit {
    let directory = manifests(args.bundles_d.as_deref());
    let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if args.name.is_empty() || !args.name.chars().all(good) {
        talk::fail(&format!(
            "`{}` is no name for a bundle: use A-Z a-z 0-9 . _ -",
            args.name
        ));
        return Exit::Usage;
    }
    let quoted: Vec<String> = args.command.iter().map(|word| quote(word)).collect();
    let manifest = serde_json::json!({"module": [{
        "name": args.name,
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": quoted.join(" "),
        "mode": "bus",
    }]});
    let path = directory.join(format!("{}.json", args.name));
    match write_manifest(&directory, &path, &format!("{manifest:#}\n")) {
        Ok(()) => {
            talk::say(&format!(
                "{} written; the broker that watches it starts the bundle",
                path.display()
            ));
            Exit::Accepted
        }
        Err(error) => {
            talk::fail(&format!("cannot write {}: {error}", path.display()));
            Exit::Internal
        }
    }
}

fn write_manifest(directory: &Path, path: &Path, text: &str) -> std::io::Result<()> {
    std::fs::create_dir_all(directory)?;
    // The broker must never read half a manifest: temporary names end in .tmp and are passed over.
    let temporary = path.with_extension("json.tmp");
    std::fs::write(&temporary, text)?;
    std::fs::rename(temporary, path)
}

fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-=:,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// `qcbus bundle remove`.
pub fn remove(args: &BundleRemoveArgs) -> Exit {
    let path = manifests(args.bundles_d.as_deref()).join(format!("{}.json", args.name));
    match std::fs::remove_file(&path) {
        Ok(()) => {
            talk::say(&format!(
                "{} removed; the broker that watches it drains the bundle",
                path.display()
            ));
            Exit::Accepted
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            talk::fail(&format!(
                "no bundle `{}` was added: there is no {}",
                args.name,
                path.display()
            ));
            Exit::Usage
        }
        Err(error) => {
            talk::fail(&format!("cannot remove {}: {error}", path.display()));
            Exit::Usage
        }
    }
}
