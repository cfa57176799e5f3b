//! `qcbus bundle add` and `qcbus bundle remove`: the manifests that a broker watches for. Success
//! means that the broker has taken it, or, with `--offline`, is said not to mean that.

use std::path::{Path, PathBuf};

use qcbus_broker::control::{AskError, ask_broker};
use qcbus_bus::Instance;
use qcbus_disk::write_whole;
use qcbus_messages::control::{Request, Response};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Exit, shown};
use rustix::fs::{Access, access};

use super::settings::{absolute, instance, real};
use crate::args::{BundleAddArgs, BundleRemoveArgs, ManifestArgs};
use crate::talk;

/// Why nothing was done, and what to do.
type Refusal = (Exit, String);

fn usage(why: impl Into<String>) -> Refusal {
    (Exit::Usage, why.into())
}

/// `qcbus bundle add`.
pub fn add(args: &BundleAddArgs) -> Exit {
    said(try_add(args))
}

/// `qcbus bundle remove`.
pub fn remove(args: &BundleRemoveArgs) -> Exit {
    said(try_remove(args))
}

fn said(done: Result<String, Refusal>) -> Exit {
    match done {
        Ok(text) => {
            talk::say_lines(&text);
            Exit::Accepted
        }
        Err((exit, why)) => {
            talk::fail(&why);
            exit
        }
    }
}

fn try_add(args: &BundleAddArgs) -> Result<String, Refusal> {
    let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let name = &args.name;
    if name.is_empty() || name.starts_with('.') || !name.chars().all(good) {
        return Err(usage(format!(
            "`{name}` is no name for a bundle: use A-Z a-z 0-9 . _ -, and no dot at the start"
        )));
    }
    let text = manifest(name, &args.command)?;
    let home = Home::find(&args.manifests)?;
    let path = home.manifest(name);
    let before = std::fs::read(&path).ok();
    let shown = to_text(&path);
    write_whole(&path, text.as_bytes(), true).map_err(|error| {
        let why = format!("cannot write {shown}: {error}; nothing was added");
        (Exit::Internal, why)
    })?;
    match home.reload() {
        Ok(Some(notices)) => {
            let about = format!("`{name}`");
            let about = notices.iter().filter(|it| it.contains(&about));
            let said: Vec<String> = about.map(|it| format!("\n{}", shown::line(it))).collect();
            let said = said.concat();
            Ok(format!(
                "{shown} written; the broker starts the bundle{said}"
            ))
        }
        Ok(None) => Ok(format!("{shown} written, but {}", home.unwatched)),
        Err((exit, why)) => {
            put_back(&path, before.as_deref());
            Err((exit, format!("nothing was added: {why}")))
        }
    }
}

fn try_remove(args: &BundleRemoveArgs) -> Result<String, Refusal> {
    let home = Home::find(&args.manifests)?;
    let path = home.manifest(&args.name);
    let shown = to_text(&path);
    let before = match std::fs::read(&path) {
        Ok(before) => before,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return home.forget(&args.name, &path);
        }
        Err(error) => return Err(usage(format!("cannot read {shown}: {error}"))),
    };
    std::fs::remove_file(&path)
        .map_err(|error| usage(format!("cannot remove {shown}: {error}")))?;
    match home.reload() {
        Ok(Some(_)) => Ok(format!("{shown} removed; the broker drains the bundle")),
        Ok(None) => Ok(format!("{shown} removed, but {}", home.unwatched)),
        Err((exit, why)) => {
            put_back(&path, Some(&before));
            Err((exit, format!("nothing was removed: {why}")))
        }
    }
}

/// As it was before; what cannot be put back is said.
fn put_back(path: &Path, before: Option<&[u8]>) {
    let done = match before {
        Some(bytes) => write_whole(path, bytes, true),
        None => std::fs::remove_file(path),
    };
    if let Err(error) = done {
        talk::fail(&format!("cannot put back {}: {error}", to_text(path)));
    }
}

/// The directory of manifests, and who looks at it.
struct Home {
    directory: PathBuf,
    /// Where the broker that watches the directory listens; `None` when none does.
    broker: Option<PathBuf>,
    /// Why nobody watches it, to be put behind "but".
    unwatched: String,
}

impl Home {
    fn find(args: &ManifestArgs) -> Result<Home, Refusal> {
        let given = args.bundles_d.as_deref().map(absolute);
        let instance = instance(&args.instance).map_err(usage)?;
        let (exit, why) = match Home::watched(&instance, given.as_deref()) {
            Ok(home) => return Ok(home),
            Err((Exit::Internal, why)) => return Err((Exit::Internal, why)),
            Err(refusal) => refusal,
        };
        if args.offline {
            return Ok(Home {
                directory: given.unwrap_or_else(|| absolute(Path::new(OFFLINE))),
                broker: None,
                unwatched: format!("no broker watches it now: {why}"),
            });
        }
        let advice = if exit == Exit::NoBroker {
            "start one with `qcbus serve`, name another one with --instance, or use --offline for \
             one that will be started"
        } else {
            "leave --bundles-d away, or name another broker with --instance"
        };
        Err((exit, format!("nothing was done: {why}; {advice}")))
    }

    /// The directory that a running broker watches, if it is the one that is meant.
    fn watched(instance: &Instance, given: Option<&Path>) -> Result<Home, Refusal> {
        let name = instance.name();
        let status = match ask_broker(instance.dir(), &Request::Status) {
            Ok(Response::Status(status)) => status,
            Ok(other) => return Err((Exit::Internal, format!("unexpected answer: {other:?}"))),
            Err(AskError::NoAnswer(why)) => return Err((Exit::Internal, why)),
            Err(AskError::NoBroker { .. } | AskError::Left(_)) => {
                let why = format!("no broker runs as instance `{name}`");
                return Err((Exit::NoBroker, why));
            }
        };
        let Some(watched) = status.bundles_d else {
            return Err(usage(format!(
                "the broker of instance `{name}` watches no directory of manifests"
            )));
        };
        if given.is_some_and(|given| real(given) != real(&watched)) {
            return Err(usage(format!(
                "the broker of instance `{name}` watches {}",
                to_text(&watched)
            )));
        }
        Ok(Home {
            directory: watched,
            broker: Some(instance.dir().to_path_buf()),
            unwatched: String::new(),
        })
    }

    fn manifest(&self, name: &str) -> PathBuf {
        self.directory.join(format!("{name}.json"))
    }

    /// Whether a broker has taken what was done, and what it has to say then.
    fn reload(&self) -> Result<Option<Vec<String>>, Refusal> {
        let Some(broker) = &self.broker else {
            return Ok(None);
        };
        match ask_broker(broker, &Request::Reload) {
            Ok(Response::Reloaded { notices, .. }) => Ok(Some(notices)),
            Ok(Response::Failed { reason }) => Err(usage(reason)),
            Ok(other) => Err((Exit::Internal, format!("unexpected answer: {other:?}"))),
            Err(error) => Err((Exit::NoBroker, error.to_string())),
        }
    }

    /// Removes a bundle that no manifest here names.
    fn forget(&self, name: &str, path: &Path) -> Result<String, Refusal> {
        let missing = format!("there is no {}", to_text(path));
        let Some(broker) = &self.broker else {
            let unwatched = &self.unwatched;
            return Err(usage(format!(
                "no bundle `{name}` was added: {missing}, and {unwatched}"
            )));
        };
        let request = Request::RemoveBundle {
            name: name.to_owned(),
        };
        match ask_broker(broker, &request) {
            Ok(Response::Removed { what }) => Ok(what),
            Ok(Response::Failed { reason }) => Err(usage(format!("{missing}, and {reason}"))),
            Ok(other) => Err((Exit::Internal, format!("unexpected answer: {other:?}"))),
            Err(error) => Err((Exit::NoBroker, error.to_string())),
        }
    }
}

/// Where manifests lie for a broker with the default options.
const OFFLINE: &str = "qcbus-out/.qcbus/bundles.d";

/// The text of a manifest. The program is named by its whole path: the broker may run elsewhere
/// and search elsewhere.
fn manifest(name: &str, command: &[String]) -> Result<String, Refusal> {
    let Some((program, arguments)) = command.split_first() else {
        return Err(usage("no program is named"));
    };
    let program = find_program(program).map_err(usage)?;
    let Some(program) = program.to_str() else {
        let shown = to_text(&program);
        return Err(usage(format!("{shown}: a manifest takes UTF-8 only")));
    };
    let words = std::iter::once(program).chain(arguments.iter().map(String::as_str));
    let quoted: Vec<String> = words.map(quote).collect();
    let manifest = serde_json::json!({"module": [{
        "name": name,
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": quoted.join(" "),
        "mode": "bus",
    }]});
    Ok(format!("{manifest:#}\n"))
}

/// Where a program lies that can be run.
fn find_program(program: &str) -> Result<PathBuf, String> {
    if program.contains('/') {
        let path = absolute(Path::new(program));
        return match executable(&path) {
            Ok(()) => Ok(path),
            Err(why) => Err(format!("cannot run {}: {why}", to_text(&path))),
        };
    }
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let mut found = std::env::split_paths(&paths).map(|directory| directory.join(program));
    let found = found.find(|path| executable(path).is_ok());
    found.map(|path| absolute(&path)).ok_or_else(|| {
        format!("cannot run `{program}`: no directory of PATH has such a program; name its path")
    })
}

fn executable(path: &Path) -> Result<(), String> {
    let metadata = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !metadata.is_file() {
        return Err("it is no file".to_owned());
    }
    access(path, Access::EXEC_OK).map_err(|error| format!("it is not executable ({error})"))
}

fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-=:,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
