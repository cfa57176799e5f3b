//! Manifests: modules that run in addition to those that come with the program.

use std::path::Path;

use qcbus_disk::trust;
use qcbus_formats::manifest::{self, Mode, Module, ModuleType};
use qcbus_formats::pool::OWN_BUNDLE;
use qcbus_messages::Role;
use qcbus_messages::path_text::to_text;
use qcbus_types::{ChildSpec, Restart};

use super::{Adapter, LoadError, Loaded, MAX_FILE, programs};

/// Returns the modules of a manifest. Passes every file to `note` before reading it.
pub(super) fn read_manifest(path: &Path, note: &dyn Fn(&Path)) -> Result<Vec<Module>, LoadError> {
    let sources = manifest::Sources {
        read: &|path| {
            note(path);
            trust::read(path, MAX_FILE).map_err(|error| error.to_string())
        },
        variable: &|name| std::env::var(name).ok(),
    };
    manifest::load(path, &sources).map_err(|error| LoadError::Manifest(error.to_string()))
}

/// Adds the module of a manifest to the children to run.
///
/// # Errors
/// [`LoadError::Manifest`] when its name is taken, or when it is a required bundle that cannot be
/// run.
pub(super) fn add_module(
    module: &Module,
    adapter: &Adapter,
    loaded: &mut Loaded,
) -> Result<(), LoadError> {
    let manifest = to_text(&module.manifest);
    let role = match module.module_type {
        ModuleType::CheckerBundle => Role::Bundle,
        ModuleType::ReportModule => Role::Reporter,
        ModuleType::ResultPooling => {
            let name = &module.name;
            let notice = format!("{manifest}: `{name}` is not started: qcbus pools results itself");
            loaded.notices.push(notice);
            return Ok(());
        }
    };
    let is_hosted = module.mode != Mode::Bus && adapter.is_there();
    if module.mode != Mode::Bus && !is_hosted {
        return not_on_the_bus(module, role, loaded);
    }
    let name = match is_hosted && role == Role::Bundle {
        true => adapter.name_of(module, loaded),
        false => module.name.clone(),
    };
    if let Some(other) = loaded.brought.get(&name) {
        return Err(LoadError::Manifest(format!(
            "{manifest}: `{name}` is also the name of a module in {other}, so one of them would not run; give it \
             another name"
        )));
    }
    if name == OWN_BUNDLE || loaded.children.iter().any(|child| child.name == name) {
        return Err(LoadError::Manifest(format!(
            "{manifest}: `{name}` comes with qcbus and would be replaced; give it another name (to run without \
             the bundles that come with qcbus, start it with --no-standard-bundles)"
        )));
    }
    programs::look_at(&module.exec_command).map_err(|why| {
        LoadError::Manifest(format!("{manifest}: `{name}` is not started: {why}"))
    })?;
    let mut spec = spec_of(module, role);
    if is_hosted {
        spec.command = adapter.words(&name, module, role);
        spec.slow_start = true;
        spec.may = adapter.may(&name, &module.may);
        spec.name.clone_from(&name);
    }
    loaded.brought.insert(name, manifest);
    loaded.children.push(spec);
    Ok(())
}

/// Skips a reporter that cannot join the bus. A bundle is an error, because it would be required.
fn not_on_the_bus(module: &Module, role: Role, loaded: &mut Loaded) -> Result<(), LoadError> {
    let (manifest, name) = (to_text(&module.manifest), &module.name);
    if role == Role::Bundle {
        return Err(LoadError::Manifest(format!(
            "{manifest}: `{name}` has no \"mode\": \"bus\", so it cannot be used, and files that it would reject \
             would be accepted; add the mode if it supports the bus, or remove the manifest"
        )));
    }
    loaded.notices.push(format!(
        "{manifest}: `{name}` has no \"mode\": \"bus\" and is not started: it does not support the bus"
    ));
    Ok(())
}

fn spec_of(module: &Module, role: Role) -> ChildSpec {
    let extra = |key: &str| {
        let mut found = module.extra.iter().filter(|(name, _)| name == key);
        found.next().map(|(_, value)| value.as_str())
    };
    let restart = match extra("restart") {
        Some("never") => Restart::Never,
        Some("on-failure") => Restart::OnFailure,
        _ => Restart::Always,
    };
    ChildSpec {
        version: extra("version").map(str::to_owned),
        command: programs::shell_command(&module.exec_command),
        name: module.name.clone(),
        role,
        restart,
        may: module.may.clone(),
        programs: Vec::new(),
        shadow: module.shadow,
        slow_start: false,
    }
}
