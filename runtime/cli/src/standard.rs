//! The bundles and reporters that come with the program: a table of each.

use std::collections::BTreeSet;
use std::path::Path;

use qcbus_broker::{ChildSpec, Restart};
use qcbus_document::FileKind;
use qcbus_formats::config::{Known, KnownBundle, KnownChecker};
use qcbus_messages::Role;
use qcbus_reporter_sdk::Reporter;
use qcbus_sdk::{Bundle, Checker, UserFiles};

/// The standard bundles.
pub static BUNDLES: [&Bundle; 3] = [
    &qcbus_xodr::BUNDLE,
    &qcbus_xosc::BUNDLE,
    &qcbus_modular::BUNDLE,
];

/// The standard bundle of this name or alias.
pub fn bundle(name: &str) -> Option<&'static Bundle> {
    BUNDLES
        .iter()
        .copied()
        .find(|bundle| qcbus_formats::config::same_bundle(name, bundle.name, bundle.alias))
}

/// How to start the standard bundles that take any of these kinds of files, with the user's
/// schemas.
///
/// # Errors
/// When the schemas are of no use: said here, before a bundle is started that would end at once.
pub fn bundle_specs(
    program: &Path,
    kinds: &BTreeSet<FileKind>,
    schema_dir: Option<&Path>,
) -> Result<Vec<ChildSpec>, String> {
    let wanted = BUNDLES
        .iter()
        .filter(|bundle| bundle.kinds.iter().any(|kind| kinds.contains(kind)));
    let specs = wanted.map(|bundle| {
        let mut spec = spec(program, "bundle", bundle.alias, bundle.name, Role::Bundle);
        let takes_files = bundle
            .rules
            .iter()
            .any(|rule| rule.facts().resource.is_some());
        if let Some(directory) = schema_dir.filter(|_| takes_files) {
            let directory = std::path::absolute(directory).map_err(|error| error.to_string())?;
            UserFiles::read(bundle, &directory)
                .map_err(|error| format!("--schema-dir: failed to {error}"))?;
            let directory = directory.to_string_lossy().into_owned();
            spec.command.extend(["--schema-dir".to_owned(), directory]);
        }
        Ok(spec)
    });
    specs.collect()
}

/// A reporter that comes with the program.
#[derive(Debug)]
pub struct StandardReporter {
    /// What it is called on the command line.
    pub alias: &'static str,
    /// What it is called on the bus and in configurations.
    pub name: &'static str,
    /// What it writes, for the help.
    pub about: &'static str,
    /// Makes one that has written nothing yet, for the bus and for one result alike: whether to
    /// colour what goes to a terminal, and whether earlier reports stay in a file for all.
    pub make: fn(color: bool, keep: bool) -> Box<dyn Reporter>,
}

/// The standard reporters: one more is one more row.
pub static REPORTERS: [StandardReporter; 2] = [
    StandardReporter {
        alias: "text",
        name: qcbus_report_text::NAME,
        about: "NAME.txt beside every result",
        make: |color, keep| Box::new(qcbus_report_text::TextReporter::new(color, keep)),
    },
    StandardReporter {
        alias: "json",
        name: qcbus_report_json::NAME,
        about: "NAME.json beside every result",
        make: |_, keep| Box::new(qcbus_report_json::JsonReporter::new(keep)),
    },
];

impl StandardReporter {
    /// How to start it.
    pub fn spec(&self, program: &Path) -> ChildSpec {
        spec(program, "reporter", self.alias, self.name, Role::Reporter)
    }
}

/// How to start the standard reporters.
pub fn reporter_specs(program: &Path) -> Vec<ChildSpec> {
    REPORTERS.iter().map(|it| it.spec(program)).collect()
}

fn spec(program: &Path, command: &str, alias: &str, name: &str, role: Role) -> ChildSpec {
    let program = program.to_string_lossy().into_owned();
    ChildSpec {
        name: name.to_owned(),
        role,
        // A process of another build that is still about is replaced.
        version: Some(env!("CARGO_PKG_VERSION").to_owned()),
        command: vec![
            program,
            command.to_owned(),
            "run".to_owned(),
            alias.to_owned(),
        ],
        restart: Restart::Always,
        may: Default::default(),
    }
}

/// What a configuration can name: the standard bundles with their checkers and parameters. (The
/// standard reporters are known to the configuration itself.)
pub fn known() -> Known {
    let bundle = |bundle: &&Bundle| {
        let checker = |checker: Checker| KnownChecker {
            params: checker
                .facts
                .params
                .iter()
                .map(|param| param.name.to_owned())
                .collect(),
            id: checker.id,
        };
        KnownBundle {
            name: bundle.name.to_owned(),
            alias: bundle.alias.to_owned(),
            checkers: Some(bundle.checkers().into_iter().map(checker).collect()),
        }
    };
    Known {
        bundles: BUNDLES.iter().map(bundle).collect(),
        ..Known::default()
    }
}
