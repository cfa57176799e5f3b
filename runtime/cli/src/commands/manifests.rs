//! `qcbus bundle add` and `qcbus bundle remove`: change the manifests that a broker watches.
//! Success means that the broker has loaded the change and that an added bundle is ready. With
//! `--offline` the output says that this is not verified.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use qcbus_bus::Instance;
use qcbus_control::{AskError, ask_broker};
use qcbus_disk::write_whole;
use qcbus_messages::Exit;
use qcbus_messages::control::{Request, Response};
use qcbus_messages::path_text::to_text;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;

use super::programs::{asam_module_command, command_line};
use super::readiness;
use super::remote::exit_of;
use super::settings::{absolute, instance, real};
use crate::args::{BundleAddArgs, BundleRemoveArgs, ManifestArgs};
use crate::{standard, talk};

/// Exit code and message: why nothing was done, and what to do.
pub(super) type Refusal = (Exit, String);

pub(super) fn usage(why: impl Into<String>) -> Refusal {
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

pub(super) fn said(done: Result<String, Refusal>) -> Exit {
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
    good_name(&args.name)?;
    let (name, command) = match &args.asam {
        Some(command) => (&joined_as(&args.name), asam_module_command(command)?),
        None => (&args.name, command_line(&args.command)?),
    };
    let home = Home::find(&args.manifests)?;
    // The write below reports a missing directory.
    let _ = std::fs::create_dir_all(&home.directory);
    let _alone = home.alone()?;
    let path = home.manifest(name);
    let before = std::fs::read(&path).ok();
    let shown = to_text(&path);
    let text = match &args.asam {
        Some(_) => asam_module_manifest(name, args, &command),
        None => manifest(args, &command),
    };
    write_whole(&path, text.as_bytes(), true).map_err(|error| {
        let why = format!("cannot write {shown}: {error}; nothing was added");
        (Exit::Internal, why)
    })?;
    let notices = match home.reload() {
        Ok(Some(notices)) => notices,
        Ok(None) => return Ok(format!("{shown} written, but {}", home.unwatched)),
        Err((exit, why)) => {
            put_back(&path, before.as_deref());
            return Err((exit, format!("nothing was added: {why}")));
        }
    };
    match readiness::wait(&home, name, &command, args.timeout) {
        Ok(runs) => Ok(readiness::ready(name, &runs, "", &notices)),
        Err((exit, why)) if args.keep => Err((
            exit,
            format!(
                "`{name}` is not ready: {why}; {shown} stays, and the files that it must check are undetermined \
                 until it is ready (`qcbus bundle remove {name}` removes it)"
            ),
        )),
        Err((exit, why)) => {
            let then = home.take_back(&path, before.as_deref());
            let why = format!("`{name}` is not ready: {why}; {then} (use --keep to leave it in)");
            Err((exit, why))
        }
    }
}

/// Checks that a bundle name is also a valid file name.
pub(super) fn good_name(name: &str) -> Result<(), Refusal> {
    let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if !name.is_empty() && !name.starts_with('.') && name.chars().all(good) {
        return Ok(());
    }
    Err(usage(format!(
        "`{name}` is not a valid bundle name: use A-Z a-z 0-9 . _ -, and no dot at the start"
    )))
}

fn try_remove(args: &BundleRemoveArgs) -> Result<String, Refusal> {
    let home = Home::find(&args.manifests)?;
    let _alone = home.alone()?;
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

/// Restores a manifest. Reports an error if that fails.
fn put_back(path: &Path, before: Option<&[u8]>) {
    let done = match before {
        Some(bytes) => write_whole(path, bytes, true),
        None => std::fs::remove_file(path),
    };
    if let Err(error) = done {
        talk::fail(&format!("cannot restore {}: {error}", to_text(path)));
    }
}

/// The directory of manifests and the broker that watches it.
pub(super) struct Home {
    directory: PathBuf,
    /// Instance directory of the broker that watches the manifests; `None` if no broker does.
    broker: Option<PathBuf>,
    /// Reason why no broker watches the directory; printed after "but".
    unwatched: String,
}

impl Home {
    pub fn find(args: &ManifestArgs) -> Result<Home, Refusal> {
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
                unwatched: format!("no broker of this instance watches it now: {why}"),
            });
        }
        let advice = if exit == Exit::NoBroker {
            "start one with `qcbus serve`, name another one with --instance, or use --offline for a broker that \
             starts later"
        } else {
            "omit --bundles-d, or name another broker with --instance"
        };
        Err((exit, format!("nothing was done: {why}; {advice}")))
    }

    /// Returns the directory that a running broker watches, if it is the given one.
    fn watched(instance: &Instance, given: Option<&Path>) -> Result<Home, Refusal> {
        let name = instance.name();
        let status = match ask_broker(instance.dir(), &Request::Status) {
            Ok(Response::Status(status)) => status,
            Ok(other) => return Err((Exit::Internal, format!("unexpected answer: {other:?}"))),
            Err(AskError::NoAnswer(why)) => return Err((Exit::Internal, why)),
            Err(error @ (AskError::Forbidden { .. } | AskError::Unreachable { .. })) => {
                return Err((exit_of(&error), error.to_string()));
            }
            Err(AskError::NoBroker { .. } | AskError::Left(_)) => {
                let why = format!("no broker runs as instance `{name}`");
                return Err((Exit::NoBroker, why));
            }
        };
        let Some(watched) = status.bundles_d else {
            return Err(usage(format!(
                "the broker of instance `{name}` watches no manifest directory"
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

    /// Returns the instance directory of the broker that watches the manifests.
    pub fn broker(&self) -> Option<&Path> {
        self.broker.as_deref()
    }

    /// Returns the path of the manifest of a bundle.
    pub fn manifest(&self, name: &str) -> PathBuf {
        self.directory.join(format!("{name}.json"))
    }

    /// Locks the directory until the returned file is dropped. Otherwise a command could take a
    /// manifest of another command for its own, or take it back.
    pub fn alone(&self) -> Result<Option<File>, Refusal> {
        let shown = to_text(&self.directory);
        let Ok(directory) = File::open(&self.directory) else {
            // The first writer creates the directory. Until then it contains no manifest that could
            // be mistaken.
            return Ok(None);
        };
        let begin = Instant::now();
        loop {
            match flock(&directory, FlockOperation::NonBlockingLockExclusive) {
                Err(Errno::WOULDBLOCK) if begin.elapsed() < OTHERS => std::thread::sleep(PAUSE),
                Err(Errno::WOULDBLOCK) => {
                    let why = format!(
                        "nothing was done: another command has been changing {shown} for {} s; try \
                         again when it is done",
                        OTHERS.as_secs()
                    );
                    return Err((Exit::Undetermined, why));
                }
                // A file system without locks excludes no other command.
                Ok(()) | Err(_) => return Ok(Some(directory)),
            }
        }
    }

    /// Restores a manifest and returns a text about the state that is now in force.
    pub fn take_back(&self, path: &Path, before: Option<&[u8]>) -> String {
        put_back(path, before);
        match self.reload() {
            Ok(_) if before.is_some() => "its previous manifest is in force again".to_owned(),
            Ok(_) => "it was removed again, and the previous state is in force".to_owned(),
            Err((_, why)) => format!("the change was undone, but {why}"),
        }
    }

    /// Asks the broker to load the change. Returns its notices, or `None` without a broker.
    pub fn reload(&self) -> Result<Option<Vec<String>>, Refusal> {
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

    /// Removes a bundle that no manifest in this directory names.
    fn forget(&self, name: &str, path: &Path) -> Result<String, Refusal> {
        let missing = format!("{} does not exist", to_text(path));
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

/// Directory of manifests of a broker with the default options.
const OFFLINE: &str = "qcbus-out/.qcbus/bundles.d";

/// Maximum time to wait for other commands.
const OTHERS: Duration = Duration::from_secs(60);

const PAUSE: Duration = Duration::from_millis(50);

/// Returns the text of a manifest.
fn manifest(args: &BundleAddArgs, command: &str) -> String {
    let mut module = serde_json::json!({
        "name": args.name,
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": command,
        "mode": "bus",
    });
    if args.shadow {
        module["shadow"] = true.into();
    }
    let manifest = serde_json::json!({"module": [module]});
    format!("{manifest:#}\n")
}

/// Returns the name under which an ASAM module joins the bus: its own name, unless a standard
/// bundle has it.
fn joined_as(name: &str) -> String {
    match standard::bundle(name) {
        Some(_) => format!("asam.{name}"),
        None => name.to_owned(),
    }
}

/// Returns the text of the manifest of an ASAM module. The module finds its section of a
/// configuration by the name given to it.
fn asam_module_manifest(name: &str, args: &BundleAddArgs, command: &str) -> String {
    let mut module = serde_json::json!({
        "name": name,
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": command,
    });
    if name != args.name {
        module["application"] = args.name.as_str().into();
    }
    if args.shadow {
        module["shadow"] = true.into();
    }
    format!("{:#}\n", serde_json::json!({"module": [module]}))
}
