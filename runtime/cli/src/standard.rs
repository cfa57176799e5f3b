//! Tables of the bundles and reporters that come with the program.

use std::collections::BTreeSet;
use std::path::Path;

use qcbus_configuration::Adapter;
use qcbus_document::FileKind;
use qcbus_formats::Text;
use qcbus_formats::config::{Known, KnownBundle, KnownChecker, KnownParam, Names};
use qcbus_messages::Role;
use qcbus_reporter_sdk::{Registration, RulePage, rule_name};
use qcbus_sdk::{Bundle, Checker, LEVELS, MAX_ISSUES, UserFiles};
use qcbus_types::{ChildSpec, Restart};

/// The standard bundles.
pub static BUNDLES: [&Bundle; 3] = [
    &qcbus_xodr::BUNDLE,
    &qcbus_xosc::BUNDLE,
    &qcbus_modular::BUNDLE,
];

/// Returns the standard bundle of this name or alias.
pub fn bundle(name: &str) -> Option<&'static Bundle> {
    BUNDLES
        .iter()
        .copied()
        .find(|bundle| qcbus_formats::config::same_bundle(name, bundle.name, bundle.alias))
}

/// Returns how to start the standard bundles that take any of these kinds of files. The commands
/// include the user's schemas and an optional number of threads.
///
/// # Errors
/// Returns an error if the schemas cannot be used. Otherwise the started bundle would end at once.
pub fn bundle_specs(
    program: &Path,
    kinds: &BTreeSet<FileKind>,
    schema_dir: Option<&Path>,
    threads: Option<usize>,
) -> Result<Vec<ChildSpec>, String> {
    let wanted = BUNDLES
        .iter()
        .filter(|bundle| bundle.kinds.iter().any(|kind| kinds.contains(kind)));
    let specs = wanted.map(|bundle| {
        let mut spec = spec(program, "bundle", bundle.alias, bundle.name, Role::Bundle);
        let takes_files = |_: &&Path| {
            let mut rules = bundle.rules.iter();
            rules.any(|rule| rule.facts().resource.is_some())
        };
        if let Some(directory) = schema_dir.filter(takes_files) {
            let directory = std::path::absolute(directory).map_err(|error| error.to_string())?;
            UserFiles::read(bundle, &directory)
                .map_err(|error| format!("--schema-dir: failed to {error}"))?;
            let directory = directory.to_string_lossy().into_owned();
            spec.command.extend(["--schema-dir".to_owned(), directory]);
        }
        if let Some(threads) = threads {
            let threads = threads.to_string();
            spec.command.extend(["--threads".to_owned(), threads]);
        }
        Ok(spec)
    });
    specs.collect()
}

/// The reporters that come with the program. A new one needs a crate, an entry in `Cargo.toml` and
/// a row here. Everything else follows from its registration (`docs/writing-a-reporter.md`).
pub static REPORTERS: [&Registration; 8] = [
    &qcbus_report_text::REPORTER,
    &qcbus_report_text::CONCISE,
    &qcbus_report_json::REPORTER,
    &qcbus_report_junit::REPORTER,
    &qcbus_report_github::REPORTER,
    &qcbus_report_gitlab::REPORTER,
    &qcbus_report_sarif::REPORTER,
    &qcbus_report_html::REPORTER,
];

/// Returns the checkers of all standard bundles, each with its bundle.
pub fn checkers() -> impl Iterator<Item = (&'static Bundle, Checker)> {
    let bundles = BUNDLES.into_iter();
    bundles.flat_map(|bundle| bundle.checkers().into_iter().map(move |it| (bundle, it)))
}

/// Checks whether a name of `--select` and `--ignore` matches a checker.
pub fn fits(bundle: &Bundle, checker: &Checker, pattern: &str) -> bool {
    let uids = checker.facts.uids.iter();
    let uids: Vec<Text> = uids.map(|uid| Text::from(*uid)).collect();
    let names = Names {
        bundle: bundle.name,
        alias: bundle.alias,
        id: &checker.id,
        uids: &uids,
    };
    names.match_pattern(pattern)
}

/// Checks whether a name of `--select` and `--ignore` matches any checker.
pub fn is_named(pattern: &str) -> bool {
    checkers().any(|(bundle, checker)| fits(bundle, &checker, pattern))
}

/// Returns the name of a checker or rule that is closest to a mistyped one.
fn suggest(word: &str) -> Option<String> {
    let mut names: Vec<String> = Vec::new();
    for (_, checker) in checkers() {
        names.extend(checker.facts.uids.iter().map(|uid| (*uid).to_owned()));
        let rules = checker.facts.uids.iter();
        names.extend(rules.map(|uid| rule_name(uid, &checker.id).to_owned()));
        names.push(checker.id);
    }
    let near = qcbus_formats::distance::closest(word, names.iter().map(String::as_str));
    near.map(str::to_owned)
}

/// Returns a suggestion for a name that matches nothing.
pub fn hint(name: &str) -> String {
    match suggest(name) {
        Some(near) => format!("did you mean `{near}`?"),
        None => match with_word(name).as_slice() {
            [] => "`qcbus rule` lists all rules".to_owned(),
            near => format!("rules with this word: {}", near.join(", ")),
        },
    }
}

/// Returns the first few names of rules that have a word in common with this name.
fn with_word(name: &str) -> Vec<String> {
    const MOST: usize = 5;
    let words = |text: &str| -> BTreeSet<String> {
        let parts = text.split(|c: char| !c.is_alphanumeric());
        let long = parts.filter(|part| part.len() > 2);
        long.map(str::to_lowercase).collect()
    };
    let wanted = words(name);
    let rules = checkers().flat_map(|(_, checker)| {
        let uids = checker.facts.uids.iter();
        let names = uids.map(|uid| rule_name(uid, &checker.id).to_owned());
        names.collect::<Vec<_>>()
    });
    let mut near: Vec<(usize, String)> = rules
        .map(|rule| (words(&rule).intersection(&wanted).count(), rule))
        .filter(|(common, _)| *common > 0)
        .collect();
    near.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    near.dedup();
    near.into_iter().take(MOST).map(|(_, rule)| rule).collect()
}

/// Returns how to start a standard reporter.
pub fn reporter_spec(program: &Path, reporter: &Registration) -> ChildSpec {
    let (alias, name) = (reporter.alias, reporter.name);
    spec(program, "reporter", alias, name, Role::Reporter)
}

/// Returns how to start the standard reporters.
pub fn reporter_specs(program: &Path) -> Vec<ChildSpec> {
    let reporters = REPORTERS.iter();
    reporters.map(|it| reporter_spec(program, it)).collect()
}

/// Returns the page of a rule of a standard bundle: that of the checker with this id, else of the
/// first one with the UID.
pub fn page(uid: &str, checker: &str) -> Option<RulePage> {
    let all = || BUNDLES.iter().flat_map(|bundle| bundle.checkers());
    let by_id = || all().find(|it| it.id == checker);
    let by_uid = || all().find(|it| it.facts.uids.contains(&uid));
    let found = by_id().or_else(by_uid)?;
    let uids = std::iter::once(uid).chain(found.facts.uids.iter().copied());
    let section = uids.into_iter().find_map(section);
    Some(RulePage {
        checker: found.id.clone(),
        summary: found.description.to_owned(),
        text: found.facts.page,
        link: section.map(|(_, link)| link).unwrap_or_default(),
    })
}

/// Returns the citation and the address of the section in which the standard states a rule.
pub fn section(uid: &str) -> Option<(String, String)> {
    let name = uid.rsplit(':').next()?;
    if uid.starts_with("asam.net:xodr:") {
        qcbus_xodr::section(name)
    } else if uid.starts_with("asam.net:xosc:") {
        let cited = "ASAM OpenSCENARIO XML, annex of checker rules".to_owned();
        Some((cited, OPENSCENARIO.to_owned()))
    } else {
        None
    }
}

/// Address of ASAM OpenSCENARIO XML.
const OPENSCENARIO: &str = "https://publications.pages.asam.net/standards/ASAM_OpenSCENARIO/ASAM_OpenSCENARIO_XML/latest/index.html";

fn spec(program: &Path, command: &str, alias: &str, name: &str, role: Role) -> ChildSpec {
    let program = program.to_string_lossy().into_owned();
    ChildSpec {
        name: name.to_owned(),
        role,
        // A running process of another build is replaced.
        version: Some(env!("CARGO_PKG_VERSION").to_owned()),
        command: vec![
            program,
            command.to_owned(),
            "run".to_owned(),
            alias.to_owned(),
        ],
        restart: Restart::Always,
        may: Default::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    }
}

/// Returns the adapter that runs modules of ASAM's framework as bundles. With `are_there`, the
/// names of the standard bundles are reserved.
pub fn adapter(program: &Path, are_there: bool) -> Adapter {
    let bundles = BUNDLES.iter().filter(|_| are_there);
    Adapter {
        command: vec![
            program.to_string_lossy().into_owned(),
            ASAM_ADAPTER.to_owned(),
        ],
        reserved: bundles.map(|bundle| bundle.name.to_owned()).collect(),
        scratch: qcbus_asam_adapter::usual_scratch(),
    }
}

/// Command that hosts a checker module.
pub const ASAM_ADAPTER: &str = "asam-adapter";
/// Command that hosts a report module.
pub const ASAM_REPORTER: &str = "asam-reporter";

/// Returns the names that a configuration may use: the standard bundles with their checkers and
/// parameters, and the standard reporters.
pub fn known() -> Known {
    let bundle = |bundle: &&Bundle| {
        let checker = |checker: Checker| KnownChecker {
            params: params(&checker),
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
        reporters: REPORTERS.iter().map(|it| it.name.to_owned()).collect(),
    }
}

fn params(checker: &Checker) -> Vec<KnownParam> {
    let declared = checker.facts.params.iter().chain([&MAX_ISSUES, &LEVELS]);
    let known = declared.map(|param| KnownParam {
        name: param.name.to_owned(),
        value: param.value_type(),
    });
    known.collect()
}
