//! The configuration and the bundle manifests: read, validate, compare, apply. The start of a
//! broker is its first reload. An error never removes the settings in force.

mod demand;
mod differences;
mod hosted;
mod modules;
mod own_program;
mod programs;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use qcbus_disk::trust::{self, TrustError};
use qcbus_formats::config::{
    Choice, Config, Known, KnownBundle, Oddity, Parsed, same_bundle, same_reporter,
};
use qcbus_formats::manifest::Module;
use qcbus_messages::Role;
use qcbus_messages::path_text::to_text;
use qcbus_types::{ChildSpec, Stamp};
use qcbus_watch::stamp::stamp_through_links;

pub use demand::InForce;
pub use differences::differences;
pub use hosted::{Adapter, unwritable};
use modules::{add_module, read_manifest};
pub use own_program::{OwnProgram, RUNNING};
pub use programs::{command_of, ready};

/// Maximum size of a configuration or manifest in bytes.
const MAX_FILE: u64 = 16 << 20;

/// Sources of the configuration and the children.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The configuration file.
    pub config: Option<PathBuf>,
    /// Whether the configuration stays in force for a long time. In that case only the broker's
    /// user may be able to change it, as with manifests.
    pub lasting: bool,
    /// Directory of manifests.
    pub bundles_d: Option<PathBuf>,
    /// Selection among the demanded checkers.
    pub choice: Choice,
    /// Whether findings have the levels of ASAM, whatever the configuration says.
    pub strict: bool,
    /// Whether findings about one fault stay separate issues.
    pub all: bool,
    /// Whether the verdict on a file is independent of the verdicts on the files that it depends on.
    pub own_verdicts: bool,
    /// The children that come with the program.
    pub standard: Vec<ChildSpec>,
    /// Reporters that run if the configuration names them.
    pub reporters: Vec<ChildSpec>,
    /// Known facts about the bundles that come with the program.
    pub known: Known,
    /// Adapter that runs ASAM modules as bundles.
    pub adapter: Adapter,
}

/// Loaded configuration and manifests, valid as a whole.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loaded {
    /// The configuration.
    pub config: Option<Config>,
    /// All children to run.
    pub children: Vec<ChildSpec>,
    /// Oddities of the configuration.
    pub oddities: Vec<Oddity>,
    /// All notices for the user, including the oddities of the configuration.
    pub notices: Vec<String>,
    /// Every file that was read and every program to run, with its stamp from before the reading.
    pub read: Fingerprint,
    /// For each child: the manifest that added it.
    brought: BTreeMap<String, String>,
    /// Device and inode of the directory of manifests, and the number of manifests.
    manifests: Option<(u64, u64, usize)>,
}

/// Files with their stamps. It changes when any of the files changes.
pub type Fingerprint = BTreeMap<PathBuf, Option<Stamp>>;

/// Reason why nothing was applied.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// The configuration cannot be used.
    #[error("{0}")]
    Config(String),
    /// A manifest cannot be used.
    #[error("{0}")]
    Manifest(String),
}

impl Loaded {
    /// Checks whether a child of this name comes with the program, which means that no manifest added it.
    fn comes_with_the_program(&self, name: &str) -> bool {
        let mut children = self.children.iter();
        children.any(|it| it.name == name) && !self.brought.contains_key(name)
    }
}

impl Sources {
    /// Reads the configuration and all manifests.
    ///
    /// # Errors
    /// The first problem, with file, row and column if known.
    pub fn load(&self) -> Result<Loaded, LoadError> {
        let mut loaded = Loaded {
            children: self.standard.clone(),
            ..Loaded::default()
        };
        let note = |loaded: &mut Loaded, path: &Path| {
            let stamp = stamp_through_links(path);
            loaded.read.insert(path.to_path_buf(), stamp);
        };
        let parsed = match &self.config {
            Some(path) => {
                note(&mut loaded, path);
                Some((path, self.read_config(path)?))
            }
            None => None,
        };
        if let Some((_, parsed)) = &parsed {
            self.add_reporters(&parsed.config, &mut loaded);
        }
        if let Some(directory) = &self.bundles_d {
            // The write permissions of the directory are not part of any file's stamp.
            note(&mut loaded, directory);
        }
        let with_the_program = loaded.children.len();
        let manifests = self.manifests(&mut loaded.notices)?;
        loaded.manifests = self
            .directory()
            .map(|(device, inode)| (device, inode, manifests.len()));
        for path in manifests {
            let read = RefCell::new(&mut loaded);
            let modules = read_manifest(&path, &|path| note(&mut read.borrow_mut(), path))?;
            for module in modules {
                if module.shadow && !self.lasting {
                    loaded.notices.push(no_shadow_in_a_run(&module));
                    continue;
                }
                add_module(&module, &self.adapter, &mut loaded)?;
            }
        }
        if let Some((_, parsed)) = &parsed {
            let known = self.known.bundles.iter().map(|it| it.name.as_str());
            let known: Vec<&str> = known.collect();
            self.adapter.add_named(&parsed.config, &known, &mut loaded);
        }
        for child in &mut loaded.children[with_the_program..] {
            let stamped = |path: PathBuf| (path.clone(), stamp_through_links(&path));
            child.programs = programs::files_of(&child.command)
                .into_iter()
                .map(stamped)
                .collect();
            loaded.read.extend(child.programs.iter().cloned());
        }
        if let Some((path, parsed)) = parsed {
            self.compare(path, &parsed, &mut loaded);
            loaded.config = Some(parsed.config);
        }
        Ok(loaded)
    }

    /// Adds notices about a configuration in comparison with the children to run.
    fn compare(&self, path: &Path, parsed: &Parsed, loaded: &mut Loaded) {
        loaded.oddities = parsed.all_oddities(&self.known_with(&loaded.children));
        let lines = loaded.oddities.iter().map(|oddity| oddity.line(path));
        loaded.notices.splice(0..0, lines);
        let unasked = unasked(path, &parsed.config, loaded);
        loaded.notices.extend(unasked);
        let named_shadows = named_shadows(path, &parsed.config, loaded);
        loaded.notices.extend(named_shadows);
    }

    fn read_config(&self, path: &Path) -> Result<Parsed, LoadError> {
        if !self.lasting {
            return read_config(path);
        }
        let cannot = |error: TrustError| match error {
            TrustError::Io { source, .. } => format!("cannot read {}: {source}", path.display()),
            foreign @ TrustError::Foreign { .. } => foreign.to_string(),
        };
        let bytes = trust::read(path, MAX_FILE).map_err(cannot);
        parse(path, &bytes.map_err(LoadError::Config)?)
    }

    /// Returns the names that come with the program, and the names from manifests.
    fn known_with(&self, children: &[ChildSpec]) -> Known {
        let mut known = self.known.clone();
        for child in children {
            let name = &child.name;
            if child.role == Role::Reporter {
                known.reporters.push(name.clone());
            } else if known.bundles.iter().all(|bundle| bundle.name != *name) {
                known.bundles.push(KnownBundle {
                    name: name.clone(),
                    ..KnownBundle::default()
                });
            }
        }
        known
    }

    fn add_reporters(&self, config: &Config, loaded: &mut Loaded) {
        for report in &config.reports {
            let is_it = |spec: &&ChildSpec| same_reporter(&report.application, &spec.name);
            if let Some(spec) = self.reporters.iter().find(is_it)
                && loaded.children.iter().all(|child| child.name != spec.name)
            {
                loaded.children.push(spec.clone());
            }
        }
    }

    /// Returns the manifests, sorted by name. Adds a notice for each other file that looks like a manifest.
    fn manifests(&self, notices: &mut Vec<String>) -> Result<Vec<PathBuf>, LoadError> {
        let Some(directory) = &self.bundles_d else {
            return Ok(Vec::new());
        };
        let cannot_look = |error: &std::io::Error| {
            LoadError::Manifest(format!(
                "cannot read the directory {}: {error}",
                to_text(directory)
            ))
        };
        match trust::directory(directory) {
            Ok(_) => {}
            Err(error) if error.is_absent() => return Ok(Vec::new()),
            Err(error) => {
                return Err(LoadError::Manifest(format!(
                    "{error}; or choose another directory with --out, --state or --bundles-d"
                )));
            }
        }
        // No other user can replace the directory after this check.
        let entries = std::fs::read_dir(directory).map_err(|error| cannot_look(&error))?;
        let all: Result<Vec<PathBuf>, LoadError> = entries
            .map(|entry| {
                entry
                    .map(|it| it.path())
                    .map_err(|error| cannot_look(&error))
            })
            .collect();
        let hidden = |path: &PathBuf| {
            let name = path.file_name();
            name.is_some_and(|it| it.to_string_lossy().starts_with('.'))
        };
        let is_manifest = |path: &PathBuf| path.extension().is_some_and(|it| it == "json");
        let all = all?.into_iter().filter(|path| !hidden(path));
        let (mut paths, mut others): (Vec<PathBuf>, Vec<PathBuf>) = all.partition(is_manifest);
        others.sort();
        notices.extend(others.iter().map(|path| {
            let shown = to_text(path);
            format!(
                "{shown}: not a manifest; manifests are files of this directory that end in .json"
            )
        }));
        paths.sort();
        Ok(paths)
    }

    /// Returns device and inode of the directory of manifests, if it exists.
    fn directory(&self) -> Option<(u64, u64)> {
        let data = std::fs::metadata(self.bundles_d.as_ref()?).ok()?;
        Some((data.dev(), data.ino()))
    }

    /// Returns the current stamps of all relevant files. `read` contains the files that manifests list.
    pub fn fingerprint(&self, read: &Fingerprint) -> Fingerprint {
        let manifests = self.manifests(&mut Vec::new()).unwrap_or_default();
        let paths = self.config.iter().cloned().chain(manifests);
        paths
            .chain(read.keys().cloned())
            .map(|path| (path.clone(), stamp_through_links(&path)))
            .collect()
    }

    /// Checks whether the directory of manifests is still available. It may be missing, or replaced
    /// by an empty one because it is not mounted. That does not mean that its bundles were removed.
    ///
    /// # Errors
    /// [`LoadError::Manifest`] when it is not available.
    pub fn still_has(&self, old: &Loaded, new: &Loaded) -> Result<(), LoadError> {
        let (Some(directory), Some((device, inode, 1..))) = (&self.bundles_d, old.manifests) else {
            return Ok(());
        };
        let is_away = match new.manifests {
            None => true,
            Some((other_device, other_inode, count)) => {
                count == 0 && (device, inode) != (other_device, other_inode)
            }
        };
        if !is_away {
            return Ok(());
        }
        let shown = to_text(directory);
        Err(LoadError::Manifest(format!(
            "{shown} is missing, or was replaced by a directory without manifests; its bundles stay required \
             until it is back (to continue without them, restart the broker)"
        )))
    }
}

/// Returns the notice that a run of `check` ignores a shadow: no output of the run is from it.
fn no_shadow_in_a_run(module: &Module) -> String {
    format!(
        "{}: `{}` is a shadow: it is not used in a run, only by a broker (`qcbus serve`)",
        to_text(&module.manifest),
        module.name
    )
}

/// Returns notices about bundles that the configuration names although they are shadows without weight.
fn named_shadows(path: &Path, config: &Config, loaded: &Loaded) -> Vec<String> {
    let named = |name: &str| {
        let mut bundles = config.bundles.iter();
        bundles.any(|it| same_bundle(&it.application, name, ""))
    };
    let shadows = loaded
        .children
        .iter()
        .filter(|it| it.shadow && named(&it.name));
    let shown = to_text(path);
    shadows
        .map(|it| {
            let name = &it.name;
            format!("{shown} names `{name}`, which is a shadow: it is tried as configured, but it is not \
                     required")
        })
        .collect()
}

/// Returns notices about bundles from manifests that the configuration does not name.
fn unasked(path: &Path, config: &Config, loaded: &Loaded) -> Vec<String> {
    let named = |name: &str| {
        let mut bundles = config.bundles.iter();
        bundles.any(|it| same_bundle(&it.application, name, ""))
    };
    let bundles = loaded.children.iter().filter(|it| it.role == Role::Bundle);
    let brought = bundles.filter_map(|it| Some((&it.name, loaded.brought.get(&it.name)?)));
    let unasked = brought.filter(|(name, _)| !config.bundles.is_empty() && !named(name));
    let (shown, note) = (
        to_text(path),
        "it judges nothing until `<CheckerBundle application=\"…\"/>` names it",
    );
    unasked
        .map(|(name, manifest)| format!("{manifest}: {shown} does not name `{name}`: {note}"))
        .collect()
}

/// Reads one configuration file.
///
/// # Errors
/// [`LoadError::Config`] with path, row and column.
pub fn read_config(path: &Path) -> Result<Parsed, LoadError> {
    let bytes = std::fs::read(path)
        .map_err(|error| LoadError::Config(format!("cannot read {}: {error}", to_text(path))))?;
    parse(path, &bytes)
}

fn parse(path: &Path, bytes: &[u8]) -> Result<Parsed, LoadError> {
    Config::parse(bytes).map_err(|error| LoadError::Config(format!("{}:{error}", to_text(path))))
}

#[cfg(test)]
mod tests;
