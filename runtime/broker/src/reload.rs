//! The configuration and the bundle manifests: read, validate, compare, apply. The start of a
//! broker is its first reload; a mistake never takes down what is in force.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use qcbus_formats::config::{
    BundleConfig, Config, Known, KnownBundle, Oddity, Parsed, reporter_for,
};
use qcbus_formats::manifest::{self, Mode, Module, ModuleType};
use qcbus_formats::pool::OWN_BUNDLE;
use qcbus_messages::Role;

use crate::core::{ChildSpec, Restart, Stamp};
use crate::stamp::stamp_through_links;

/// Where the configuration and the children come from.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The configuration file.
    pub config: Option<PathBuf>,
    /// Directory of manifests.
    pub bundles_d: Option<PathBuf>,
    /// The children that come with the program.
    pub standard: Vec<ChildSpec>,
    /// Reporters that run when the configuration names them.
    pub reporters: Vec<ChildSpec>,
    /// What can be said beforehand of the bundles that come with the program.
    pub known: Known,
}

/// What was read, valid as a whole.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loaded {
    /// The configuration.
    pub config: Option<Config>,
    /// Everything that is to run.
    pub children: Vec<ChildSpec>,
    /// What is odd about the configuration.
    pub oddities: Vec<Oddity>,
    /// What is odd about anything, that included, for a person.
    pub notices: Vec<String>,
    /// Every file that was read for it, with its stamp from before.
    pub read: Fingerprint,
    /// Which manifest brought which child.
    brought: BTreeMap<String, String>,
    /// Device and inode of the directory of manifests, and how many there were.
    manifests: Option<(u64, u64, usize)>,
}

/// Files with their stamps: differs as soon as any of the files does.
pub type Fingerprint = BTreeMap<PathBuf, Option<Stamp>>;

/// Why nothing was applied.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// The configuration cannot be used.
    #[error("{0}")]
    Config(String),
    /// A manifest cannot be used.
    #[error("{0}")]
    Manifest(String),
}

impl Sources {
    /// Reads everything.
    ///
    /// # Errors
    /// The first thing that cannot be used, with file, row and column where there is one.
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
                Some((path, read_config(path)?))
            }
            None => None,
        };
        if let Some((_, parsed)) = &parsed {
            self.add_reporters(&parsed.config, &mut loaded);
        }
        let manifests = self.manifests(&mut loaded.notices)?;
        loaded.manifests = self
            .directory()
            .map(|(device, inode)| (device, inode, manifests.len()));
        for path in manifests {
            let read = RefCell::new(&mut loaded);
            let modules = read_manifest(&path, &|path| note(&mut read.borrow_mut(), path))?;
            for module in modules {
                add_module(module, &mut loaded)?;
            }
        }
        if let Some((path, parsed)) = parsed {
            loaded.oddities = parsed.all_oddities(&self.known_with(&loaded.children));
            let lines = loaded.oddities.iter().map(|oddity| oddity.line(path));
            loaded.notices.splice(0..0, lines);
            loaded.config = Some(parsed.config);
        }
        Ok(loaded)
    }

    /// What there is to be named: what comes with the program, and what manifests bring.
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
            let name = reporter_for(&report.application).unwrap_or(&report.application);
            let spec = self.reporters.iter().find(|spec| spec.name == name);
            if let Some(spec) = spec
                && loaded.children.iter().all(|child| child.name != name)
            {
                loaded.children.push(spec.clone());
            }
        }
    }

    /// The manifests, by name. What lies beside them and looks as if somebody took it for one is said.
    fn manifests(&self, notices: &mut Vec<String>) -> Result<Vec<PathBuf>, LoadError> {
        let Some(directory) = &self.bundles_d else {
            return Ok(Vec::new());
        };
        let cannot_look = |error: &std::io::Error| {
            LoadError::Manifest(format!("cannot look into {}: {error}", directory.display()))
        };
        let entries = match std::fs::read_dir(directory) {
            Ok(entries) => entries,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(cannot_look(&error)),
        };
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
            let shown = path.display();
            format!("{shown}: is no manifest, those are files of this directory that end in .json")
        }));
        paths.sort();
        Ok(paths)
    }

    /// The directory of manifests, if it is there.
    fn directory(&self) -> Option<(u64, u64)> {
        let data = std::fs::metadata(self.bundles_d.as_ref()?).ok()?;
        Some((data.dev(), data.ino()))
    }

    /// All files that count, as they are now: `loaded` knows those that manifests list.
    pub fn fingerprint(&self, loaded: &Loaded) -> Fingerprint {
        let manifests = self.manifests(&mut Vec::new()).unwrap_or_default();
        let paths = self.config.iter().cloned().chain(manifests);
        paths
            .chain(loaded.read.keys().cloned())
            .map(|path| (path.clone(), stamp_through_links(&path)))
            .collect()
    }

    /// Whether the directory of manifests is away: gone, or an empty one in its place as where nothing
    /// is mounted. Nobody has removed the bundles that it brought.
    ///
    /// # Errors
    /// [`LoadError::Manifest`] when it is.
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
        let shown = directory.display();
        Err(LoadError::Manifest(format!(
            "{shown} is not the directory that it was, and there is no manifest in it; its bundles stay \
             demanded until it is back (to do without them, start the broker anew)"
        )))
    }
}

/// Reads one configuration file.
///
/// # Errors
/// [`LoadError::Config`] with path, row and column.
pub fn read_config(path: &Path) -> Result<Parsed, LoadError> {
    let bytes = std::fs::read(path)
        .map_err(|error| LoadError::Config(format!("cannot read {}: {error}", path.display())))?;
    Config::parse(&bytes).map_err(|error| LoadError::Config(format!("{}:{error}", path.display())))
}

fn read_manifest(path: &Path, note: &dyn Fn(&Path)) -> Result<Vec<Module>, LoadError> {
    let sources = manifest::Sources {
        read: &|path| {
            note(path);
            std::fs::read(path).map_err(|error| error.to_string())
        },
        variable: &|name| std::env::var(name).ok(),
    };
    manifest::load(path, &sources).map_err(|error| LoadError::Manifest(error.to_string()))
}

fn add_module(module: Module, loaded: &mut Loaded) -> Result<(), LoadError> {
    let manifest = module.manifest.display().to_string();
    let role = match module.module_type {
        ModuleType::CheckerBundle => Role::Bundle,
        ModuleType::ReportModule => Role::Reporter,
        ModuleType::ResultPooling => {
            loaded.notices.push(format!(
                "{manifest}: `{}`: qcbus pools results itself",
                module.name
            ));
            return Ok(());
        }
    };
    if module.mode != Mode::Bus {
        loaded.notices.push(format!(
            "{manifest}: `{}` has no \"mode\": \"bus\" and is not started: it does not speak on the bus",
            module.name
        ));
        return Ok(());
    }
    let extra = |key: &str| {
        module
            .extra
            .iter()
            .find(|(name, _)| name == key)
            .map(|(_, value)| value.as_str())
    };
    let restart = match extra("restart") {
        Some("never") => Restart::Never,
        Some("on-failure") => Restart::OnFailure,
        _ => Restart::Always,
    };
    let spec = ChildSpec {
        version: extra("version").map(str::to_owned),
        // As ASAM's framework does, the command is the shell's to take apart.
        command: vec![
            "sh".into(),
            "-c".into(),
            format!("exec {} \"$@\"", module.exec_command),
            "sh".into(),
        ],
        name: module.name,
        role,
        restart,
    };
    let name = &spec.name;
    if let Some(other) = loaded.brought.get(name) {
        return Err(LoadError::Manifest(format!(
            "{manifest}: `{name}` is the name of a module in {other}, too: one of them would not run; give \
             it another name"
        )));
    }
    if name == OWN_BUNDLE || loaded.children.iter().any(|child| child.name == *name) {
        return Err(LoadError::Manifest(format!(
            "{manifest}: `{name}` comes with qcbus and would be replaced; give it another name (to do \
             without the bundles that come with qcbus, start it with --no-standard-bundles)"
        )));
    }
    loaded.brought.insert(name.clone(), manifest);
    loaded.children.push(spec);
    Ok(())
}

/// What changed, line by line.
pub fn differences(old: &Loaded, new: &Loaded) -> Vec<String> {
    let mut lines = Vec::new();
    for child in &new.children {
        match old.children.iter().find(|it| it.name == child.name) {
            None => lines.push(format!("added {}", child.name)),
            Some(before) if before != child => lines.push(format!("changed {}", child.name)),
            Some(_) => {}
        }
    }
    for child in old
        .children
        .iter()
        .filter(|it| new.children.iter().all(|new| new.name != it.name))
    {
        lines.push(format!("removed {}", child.name));
    }
    match (&old.config, &new.config) {
        (Some(old), Some(new)) => config_differences(old, new, &mut lines),
        (None, Some(_)) => lines.push("a configuration is in force".to_owned()),
        (Some(_), None) => lines.push("no configuration is in force any more".to_owned()),
        (None, None) => {}
    }
    lines
}

fn config_differences(old: &Config, new: &Config, lines: &mut Vec<String>) {
    let params = |config: &Config| {
        config
            .params
            .iter()
            .map(|it| it.to_param())
            .collect::<Vec<_>>()
    };
    if params(old) != params(new) {
        lines.push("global parameters changed".to_owned());
    }
    for bundle in &new.bundles {
        match old
            .bundles
            .iter()
            .find(|it| it.application == bundle.application)
        {
            None => lines.push(format!("{} is demanded", bundle.application)),
            Some(before) => bundle_differences(before, bundle, lines),
        }
    }
    for bundle in &old.bundles {
        if new
            .bundles
            .iter()
            .all(|it| it.application != bundle.application)
        {
            lines.push(format!("{} is no longer demanded", bundle.application));
        }
    }
    let names = |config: &Config| {
        config
            .reports
            .iter()
            .map(|it| it.application.clone())
            .collect::<Vec<_>>()
    };
    if names(old) != names(new) {
        lines.push(format!("reports: {}", names(new).join(", ")));
    }
}

fn bundle_differences(old: &BundleConfig, new: &BundleConfig, lines: &mut Vec<String>) {
    let name = &new.application;
    let params = |it: &BundleConfig| it.params.iter().map(|it| it.to_param()).collect::<Vec<_>>();
    if params(old) != params(new) {
        lines.push(format!("{name}: parameters changed"));
    }
    for checker in &new.checkers {
        match old.checkers.iter().find(|it| it.id == checker.id) {
            None => lines.push(format!("{name}: {} is demanded", checker.id)),
            Some(before)
                if before.levels != checker.levels || before.relevel != checker.relevel =>
            {
                lines.push(format!("{name}: {}: levels changed", checker.id));
            }
            Some(before)
                if before
                    .params
                    .iter()
                    .map(|it| it.to_param())
                    .ne(checker.params.iter().map(|it| it.to_param())) =>
            {
                lines.push(format!("{name}: {}: parameters changed", checker.id));
            }
            Some(_) => {}
        }
    }
    for checker in &old.checkers {
        if new.checkers.iter().all(|it| it.id != checker.id) {
            lines.push(format!("{name}: {} is no longer demanded", checker.id));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sources(directory: &Path) -> Sources {
        Sources {
            config: Some(directory.join("config.xml")),
            bundles_d: Some(directory.join("bundles.d")),
            standard: vec![child("xodrBundle")],
            reporters: vec![child("qc-report-text")],
            known: Known::default(),
        }
    }

    fn child(name: &str) -> ChildSpec {
        ChildSpec {
            name: name.to_owned(),
            role: Role::Bundle,
            version: None,
            command: vec!["program".to_owned()],
            restart: Restart::Always,
        }
    }

    fn put(directory: &Path, config: &str, manifests: &[(&str, &str)]) {
        let bundles_d = directory.join("bundles.d");
        let _ = std::fs::remove_dir_all(&bundles_d);
        std::fs::create_dir(&bundles_d).unwrap();
        std::fs::write(directory.join("config.xml"), config).unwrap();
        for (name, text) in manifests {
            std::fs::write(bundles_d.join(name), text).unwrap();
        }
    }

    fn manifest(name: &str, mode: &str) -> String {
        format!(
            r#"{{"module": [{{"name": "{name}", "exec_type": "executable", "mode": "{mode}",
            "module_type": "checker_bundle", "exec_command": "/opt/{name}"}}]}}"#
        )
    }

    const CONFIG: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\"/>\n</Config>\n";

    #[test]
    fn a_start_reads_the_configuration_and_every_manifest() {
        let dir = tempfile::tempdir().unwrap();
        let mine = manifest("mine", "bus");
        let theirs = manifest("theirs", "once");
        let hidden = (".hidden.json", "no manifest at all");
        put(
            dir.path(),
            CONFIG,
            &[("a.json", &mine), ("b.json", &theirs), hidden],
        );
        let loaded = sources(dir.path()).load().unwrap();
        let names: Vec<&str> = loaded.children.iter().map(|it| it.name.as_str()).collect();
        assert_eq!(names, ["xodrBundle", "mine"], "{:?}", loaded.notices);
        assert!(loaded.notices.iter().any(|it| it.contains("theirs")));
        assert_eq!(loaded.config.unwrap().bundles.len(), 1);
    }

    #[test]
    fn what_cannot_be_read_is_refused_as_a_whole() {
        let dir = tempfile::tempdir().unwrap();
        put(dir.path(), "<Config>", &[]);
        assert!(matches!(
            sources(dir.path()).load(),
            Err(LoadError::Config(_))
        ));
        put(dir.path(), CONFIG, &[("a.json", "{")]);
        assert!(matches!(
            sources(dir.path()).load(),
            Err(LoadError::Manifest(_))
        ));
    }

    #[test]
    fn what_has_changed_is_told_line_by_line() {
        let dir = tempfile::tempdir().unwrap();
        let sources = sources(dir.path());
        let (mine, yours) = (manifest("mine", "bus"), manifest("yours", "bus"));
        put(dir.path(), CONFIG, &[("a.json", &mine)]);
        let old = sources.load().unwrap();
        assert_eq!(sources.fingerprint(&old), old.read);
        assert_eq!(differences(&old, &old), Vec::<String>::new());
        let config = CONFIG.replace("xodrBundle", "xoscBundle");
        put(dir.path(), &config, &[("b.json", &yours)]);
        assert_ne!(sources.fingerprint(&old), old.read);
        let mut lines = differences(&old, &sources.load().unwrap());
        lines.sort();
        let expected = [
            "added yours",
            "removed mine",
            "xodrBundle is no longer demanded",
            "xoscBundle is demanded",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn a_manifest_that_another_lists_is_looked_at_too() {
        let dir = tempfile::tempdir().unwrap();
        let sources = sources(dir.path());
        let listed = dir.path().join("mine.manifest");
        std::fs::write(&listed, manifest("mine", "bus")).unwrap();
        let list = format!(r#"{{"manifest_file_path": ["{}"]}}"#, listed.display());
        put(dir.path(), CONFIG, &[("all.json", &list)]);
        let old = sources.load().unwrap();
        assert!(old.children.iter().any(|it| it.name == "mine"));
        assert_eq!(sources.fingerprint(&old), old.read);
        std::fs::write(&listed, manifest("another", "bus")).unwrap();
        assert_ne!(sources.fingerprint(&old), old.read);
    }

    #[test]
    fn a_directory_of_manifests_that_is_away_takes_no_bundle_along() {
        let dir = tempfile::tempdir().unwrap();
        let sources = sources(dir.path());
        let (bundles_d, aside) = (dir.path().join("bundles.d"), dir.path().join("aside"));
        let mine = manifest("mine", "bus");
        put(dir.path(), CONFIG, &[("a.json", &mine)]);
        let old = sources.load().unwrap();
        let still_has = || sources.still_has(&old, &sources.load().unwrap());
        assert_eq!(still_has(), Ok(()));
        std::fs::rename(&bundles_d, &aside).unwrap();
        assert!(still_has().is_err(), "gone");
        std::fs::create_dir(&bundles_d).unwrap();
        assert!(still_has().is_err(), "an empty one in its place");
        std::fs::write(bundles_d.join("b.json"), &mine).unwrap();
        assert_eq!(still_has(), Ok(()), "somebody has put another there");
        std::fs::remove_dir_all(&bundles_d).unwrap();
        std::fs::rename(&aside, &bundles_d).unwrap();
        std::fs::remove_file(bundles_d.join("a.json")).unwrap();
        assert_eq!(still_has(), Ok(()), "somebody has taken it out");
    }

    #[test]
    fn a_name_is_not_taken_twice() {
        let dir = tempfile::tempdir().unwrap();
        let sources = sources(dir.path());
        let (mine, standard) = (manifest("mine", "bus"), manifest("xodrBundle", "bus"));
        let own = manifest("qcbus", "bus");
        let cases = [
            vec![("a.json", &*mine), ("b.json", &*mine)],
            vec![("a.json", &*standard)],
            vec![("a.json", &*own)],
        ];
        for manifests in cases {
            put(dir.path(), CONFIG, &manifests);
            let refused = sources.load().unwrap_err().to_string();
            assert!(refused.contains("another name"), "{refused}");
        }
    }

    #[test]
    fn what_looks_like_a_manifest_and_is_none_is_said() {
        let dir = tempfile::tempdir().unwrap();
        let mine = manifest("mine", "bus");
        put(dir.path(), CONFIG, &[("mine.JSON", &mine), (".hidden", "")]);
        let notices = sources(dir.path()).load().unwrap().notices;
        let said: Vec<&String> = notices
            .iter()
            .filter(|it| it.contains("no manifest"))
            .collect();
        assert!(
            matches!(said[..], [one] if one.contains("mine.JSON")),
            "{notices:?}"
        );
    }
}
