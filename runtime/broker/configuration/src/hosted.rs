//! ASAM modules that the adapter runs as bundles.

use std::path::{Path, PathBuf};

use qcbus_disk::{foreign, trust};
use qcbus_formats::config::{Config, same_bundle};
use qcbus_formats::manifest::{May, Module};
use qcbus_messages::Role;
use qcbus_messages::control::ScratchStatus;
use qcbus_messages::path_text::to_text;
use qcbus_types::{ChildSpec, Restart};
use rustix::fs::{Access, access};

use super::{Loaded, programs};

/// Adapter that runs ASAM modules as bundles.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Adapter {
    /// Command that starts the adapter. Empty: there is no adapter.
    pub command: Vec<String>,
    /// Names of the bundles that come with the program, whether they run or not.
    pub reserved: Vec<String>,
    /// Directory of the private directories of the modules.
    pub scratch: PathBuf,
}

/// Prefix of a module name that is already taken.
const PREFIX: &str = "asam.";
/// Options before the command of a module and before its private directory.
const EXEC: &str = "--exec";
const SCRATCH: &str = "--scratch";
/// Word after the name of the program, for a checker bundle and for a report module.
const ADAPTER: &str = "asam-adapter";
const REPORTER: &str = "asam-reporter";

impl Adapter {
    /// Checks whether an adapter exists.
    pub(super) fn is_there(&self) -> bool {
        !self.command.is_empty()
    }

    /// Returns the parent of the private directories, and why none can be created now. Waits for the disk.
    pub fn scratch_status(&self) -> Option<ScratchStatus> {
        self.is_there().then(|| ScratchStatus {
            directory: self.scratch.clone(),
            why: unwritable(&self.scratch),
        })
    }

    /// Returns the name of a module: its own, unless a bundle that comes with the program has this name.
    pub(super) fn name_of(&self, module: &Module, loaded: &mut Loaded) -> String {
        let name = &module.name;
        let is_taken = self.reserved.iter().any(|it| same_bundle(name, it, ""))
            || loaded.comes_with_the_program(name);
        if !is_taken {
            return name.clone();
        }
        let joined = format!("{PREFIX}{name}");
        loaded.notices.push(format!(
            "{}: `{name}` comes with qcbus, so this module of ASAM's framework joins as `{joined}`; use that \
             name in configurations, too",
            to_text(&module.manifest)
        ));
        joined
    }

    /// Returns the command that starts the adapter for a module.
    pub(super) fn words(&self, name: &str, module: &Module, role: Role) -> Vec<String> {
        let mut words = self.command.clone();
        if role == Role::Reporter
            && let Some(word) = words.last_mut()
        {
            REPORTER.clone_into(word);
        }
        let mut add =
            |option: &str, value: &str| words.extend([option.to_owned(), value.to_owned()]);
        add("--name", name);
        add(EXEC, &module.exec_command);
        add(SCRATCH, &self.scratch_of(name).to_string_lossy());
        let once = &module.once;
        if let Some(application) = &once.application {
            add("--application", application);
        }
        if let Some(directory) = &once.working_directory {
            add("--directory", &directory.to_string_lossy());
        }
        for (variable, value) in &once.environment {
            add("--env", &format!("{variable}={value}"));
        }
        for kind in &once.kinds {
            add("--kind", kind);
        }
        if once.cold {
            words.push("--cold".to_owned());
        }
        // A report module gives no verdict, so its program files do not matter.
        if role == Role::Bundle {
            for file in programs::files_of(&words) {
                words.extend(["--program".to_owned(), file.to_string_lossy().into_owned()]);
            }
        }
        let mut add =
            |option: &str, value: &str| words.extend([option.to_owned(), value.to_owned()]);
        for (limit, number) in &once.limits {
            add(
                &format!("--{}", limit.replace('_', "-")),
                &number.to_string(),
            );
        }
        words
    }

    /// Returns the permissions of the adapter in the sandbox: those of its module, and its private directories.
    pub(super) fn may(&self, name: &str, module: &May) -> May {
        let mut may = module.clone();
        may.write.push(self.scratch_of(name));
        may
    }

    /// Returns the parent of the private directories of one module. It has no access to those of other modules.
    fn scratch_of(&self, name: &str) -> PathBuf {
        self.scratch.join(format!("of-{name}"))
    }

    /// Adds the modules that only the configuration names, if a program of that name is found.
    /// ASAM's framework is configured this way, without manifests.
    pub(super) fn add_named(&self, config: &Config, known: &[&str], loaded: &mut Loaded) {
        for bundle in &config.bundles {
            let name = bundle.application.as_str();
            let mut children = loaded.children.iter().map(|it| it.name.as_str());
            let is_brought = children.any(|it| same_bundle(name, it, ""))
                || known.iter().any(|it| same_bundle(name, it, ""));
            if !self.is_there() || is_brought || !looks_like_a_module(name) {
                continue;
            }
            let Some(program) = programs::find(name) else {
                continue;
            };
            let shown = to_text(&program);
            if let Err(why) = programs::look_at(name) {
                loaded
                    .notices
                    .push(format!("`{name}` is not started as {shown}: {why}"));
                continue;
            }
            loaded.notices.push(format!(
                "no manifest defines `{name}`, which the configuration names: {shown} is run as a one-shot ASAM \
                 module"
            ));
            let module = named_module(name);
            let command = self.words(name, &module, Role::Bundle);
            loaded.children.push(ChildSpec {
                name: name.to_owned(),
                role: Role::Bundle,
                version: None,
                command,
                restart: Restart::Always,
                may: self.may(name, &module.may),
                programs: Vec::new(),
                shadow: false,
                slow_start: true,
            });
        }
    }
}

/// Returns why a directory cannot be written to, for the user. A missing directory is created later.
pub fn unwritable(directory: &Path) -> Option<String> {
    let absent = |place: &&Path| {
        let found = foreign::metadata(place);
        found.is_err_and(|error| error.kind() == std::io::ErrorKind::NotFound)
    };
    let there = directory.ancestors().find(|place| !absent(place))?;
    let why = match access(there, Access::WRITE_OK | Access::EXEC_OK) {
        Err(error) => error.to_string(),
        Ok(()) if there.is_dir() => return None,
        Ok(()) => "it is not a directory".to_owned(),
    };
    Some(format!("{}: {why}", to_text(there)))
}

/// Checks whether a name has the form of a module name. Other names are not searched, because a
/// configuration must not start arbitrary programs.
fn looks_like_a_module(name: &str) -> bool {
    let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let is_one = name.starts_with("qc_") || name.starts_with("qc-") || name.ends_with("Bundle");
    is_one && name.len() <= 64 && name.chars().all(good)
}

fn named_module(name: &str) -> Module {
    Module {
        name: name.to_owned(),
        module_type: qcbus_formats::manifest::ModuleType::CheckerBundle,
        exec_command: format!("{name} -c \"$ASAM_QC_FRAMEWORK_CONFIG_FILE\""),
        mode: qcbus_formats::manifest::Mode::Once,
        may: May::default(),
        once: qcbus_formats::manifest::Once::default(),
        shadow: false,
        extra: Vec::new(),
        manifest: PathBuf::new(),
    }
}

/// Returns the command of a module that the adapter runs, or `None` for other children.
pub(super) fn command_of(words: &[String]) -> Option<&str> {
    value_of(words, EXEC)
}

/// Checks the adapter's command again, and creates the private directory.
///
/// # Errors
/// When another user controls a file, and when the program does not exist.
pub(super) fn ready(words: &[String]) -> Result<(), String> {
    if let Some(command) = command_of(words) {
        programs::look_at(command)?;
    }
    if let Some(scratch) = value_of(words, SCRATCH) {
        // The directory must exist before the process enters the sandbox, which allows writes to it.
        trust::make_private_directory(Path::new(scratch)).map_err(|error| error.to_string())?;
    }
    Ok(())
}

fn value_of<'w>(words: &'w [String], option: &str) -> Option<&'w str> {
    if words
        .get(1)
        .is_none_or(|it| it != ADAPTER && it != REPORTER)
    {
        return None;
    }
    let at = words.iter().position(|it| it == option)?;
    words.get(at + 1).map(String::as_str)
}
