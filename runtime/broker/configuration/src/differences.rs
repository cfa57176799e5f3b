//! Description of the changes of a reload for the user.

use qcbus_formats::config::{BundleConfig, Config};

use super::Loaded;

/// Returns the changes, one per line.
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
        (None, Some(_)) => lines.push("a configuration is now in force".to_owned()),
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
            None => lines.push(format!("{} is required", bundle.application)),
            Some(before) => bundle_differences(before, bundle, lines),
        }
    }
    if new.bundles.is_empty() && !old.bundles.is_empty() {
        lines.push("every bundle is required, because none is named".to_owned());
    }
    for bundle in &old.bundles {
        let is_named = |it: &BundleConfig| it.application == bundle.application;
        if !new.bundles.is_empty() && !new.bundles.iter().any(is_named) {
            lines.push(format!("{} is no longer required", bundle.application));
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
            None => lines.push(format!("{name}: {} is required", checker.id)),
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
    if new.checkers.is_empty() && !old.checkers.is_empty() {
        lines.push(format!(
            "{name}: every checker is required, because none is named"
        ));
    }
    for checker in &old.checkers {
        if !new.checkers.is_empty() && new.checkers.iter().all(|it| it.id != checker.id) {
            lines.push(format!("{name}: {} is no longer required", checker.id));
        }
    }
}
