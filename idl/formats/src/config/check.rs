//! Comparison of a configuration with the known bundles and reporters.

use std::collections::BTreeSet;

use super::lookup::canonical_bundle;
use super::{
    BundleConfig, CheckerConfig, Config, ConfigParam, INPUT_PARAMS, LEVEL_PARAM, Oddity, ParamType,
    Parsed, ReportConfig, SCENARIO_PATH_PARAM, TextPosition, same_bundle, same_reporter,
};
use crate::distance::{DID_YOU_MEAN, did_you_mean};

/// The catalogues of the known bundles and the names of the known reporters.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Known {
    /// The bundles.
    pub bundles: Vec<KnownBundle>,
    /// The names of the reporters, such as `qc-report-text`.
    pub reporters: Vec<String>,
}

/// Known data of a bundle.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct KnownBundle {
    /// Its name, such as `xodrBundle`.
    pub name: String,
    /// Its short name, such as `xodr`.
    pub alias: String,
    /// Its checkers; `None` when only the bundle itself knows them and has not joined yet.
    pub checkers: Option<Vec<KnownChecker>>,
}

/// Known data of a checker.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct KnownChecker {
    /// Its identifier.
    pub id: String,
    /// Its parameters.
    pub params: Vec<KnownParam>,
}

/// Known data of a parameter of a checker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KnownParam {
    /// Its name, such as `tolerance`.
    pub name: String,
    /// Type of its value.
    pub value: ParamType,
}

/// The parameters that one part reads, by name. The same name may be read with several types.
type Names<'a> = BTreeSet<(&'a str, ParamType)>;

/// Bundle parameters that ASAM's framework reads. The next constant is for reports.
const FRAMEWORK_PARAMS: [&str; 4] = ["resultFile", "strResultFile", "InputFile", LEVEL_PARAM];
const REPORT_PARAMS: [&str; 8] = [
    "InputFile",
    "OutputFile",
    "LineWidth",
    "Indent",
    "strInputFile",
    "strReportFile",
    "strResultFile",
    "resultFile",
];

impl Parsed {
    /// Returns all oddities of a configuration before it is used, in the order of the file: odd
    /// content and unknown names. A warning means that something is not done as the file says.
    pub fn all_oddities(&self, known: &Known) -> Vec<Oddity> {
        let mut oddities = self.oddities.clone();
        oddities.extend(self.config.check(known));
        oddities.sort_by_key(|oddity| (oddity.row, oddity.column));
        oddities.dedup();
        oddities
    }
}

impl Config {
    /// Returns the unknown names in the configuration: bundles, checkers, parameters, reports; in
    /// the order of the file.
    pub fn check(&self, known: &Known) -> Vec<Oddity> {
        let mut oddities = Vec::new();
        self.check_global_params(known, &mut oddities);
        for (i, bundle) in self.bundles.iter().enumerate() {
            check_bundle(bundle, known, &mut oddities);
            oddities.extend(named_before(bundle, &self.bundles[..i], known));
        }
        for report in &self.reports {
            oddities.extend(check_report(report, known));
        }
        if let ([], [first, ..]) = (self.bundles.as_slice(), self.reports.as_slice()) {
            let text =
                "no checker bundle is named, so nothing is checked and there is nothing to report";
            oddities.push(Oddity::warning(first.position, text.to_owned()));
        }
        oddities.sort_by_key(|oddity| (oddity.row, oddity.column));
        oddities
    }

    /// Checks the global parameters, which may be meant for any bundle or report.
    fn check_global_params(&self, known: &Known, oddities: &mut Vec<Oddity>) {
        let mut names: Names<'_> = FRAMEWORK_PARAMS
            .into_iter()
            .chain(INPUT_PARAMS)
            .chain(REPORT_PARAMS)
            .chain([SCENARIO_PATH_PARAM])
            .map(|name| (name, ParamType::Text))
            .collect();
        names.retain(|(name, _)| *name != LEVEL_PARAM);
        names.extend(known.bundles.iter().flat_map(KnownBundle::params));
        let what = "no bundle or report reads a global parameter";
        // A bundle with unknown parameters may read any name. A name very similar to a known
        // parameter is still probably a typing error.
        let all_known = known.bundles.iter().all(|it| it.checkers.is_some());
        let mut found = Vec::new();
        check_params(&self.params, &names, what, &mut found);
        found.retain(|oddity| all_known || oddity.text.contains(DID_YOU_MEAN));
        check_values(&self.params, &names, &mut found);
        oddities.append(&mut found);
    }
}

impl KnownBundle {
    fn params(&self) -> impl Iterator<Item = (&str, ParamType)> {
        let checkers = self.checkers.iter().flatten();
        checkers.flat_map(KnownChecker::params)
    }
}

impl KnownChecker {
    fn params(&self) -> impl Iterator<Item = (&str, ParamType)> {
        let params = self.params.iter();
        params.map(|param| (param.name.as_str(), param.value))
    }
}

fn check_bundle(bundle: &BundleConfig, known: &Known, oddities: &mut Vec<Oddity>) {
    let application = &bundle.application;
    let found = known
        .bundles
        .iter()
        .find(|b| same_bundle(application, &b.name, &b.alias));
    let Some(found) = found else {
        oddities.push(unknown_bundle(application, bundle.position, known));
        return;
    };
    let Some(checkers) = &found.checkers else {
        oddities.push(unknown_catalogue(bundle));
        return;
    };
    let mut names: Names<'_> = FRAMEWORK_PARAMS
        .into_iter()
        .chain(INPUT_PARAMS)
        .filter(|name| *name != LEVEL_PARAM)
        .map(|name| (name, ParamType::Text))
        .collect();
    names.extend(found.params());
    let what = format!("no checker of bundle `{}` reads a parameter", found.name);
    check_params(&bundle.params, &names, &what, oddities);
    check_values(&bundle.params, &names, oddities);
    for checker in &bundle.checkers {
        check_checker(checker, (found, checkers), known, oddities);
    }
}

fn unknown_catalogue(bundle: &BundleConfig) -> Oddity {
    let text = format!(
        "the checkers and parameters of `{}` were not validated, because they are only known once it has joined",
        bundle.application
    );
    Oddity::information(bundle.position, text)
}

/// Returns a warning if an earlier entry names the same bundle, according to its catalogue.
fn named_before(bundle: &BundleConfig, before: &[BundleConfig], known: &Known) -> Option<Oddity> {
    let found = known
        .bundles
        .iter()
        .find(|b| same_bundle(&bundle.application, &b.name, &b.alias))?;
    let first = before
        .iter()
        .find(|b| same_bundle(&b.application, &found.name, &found.alias))?;
    let text = format!(
        "`{}` in row {} is the same bundle as `{}`; move everything to the first one, because only that one is \
         used",
        first.application, first.position.row, bundle.application
    );
    Some(Oddity::warning(bundle.position, text))
}

fn unknown_bundle(application: &str, position: TextPosition, known: &Known) -> Oddity {
    let names = known
        .bundles
        .iter()
        .flat_map(|b| [b.name.as_str(), b.alias.as_str()]);
    let mut there: Vec<&str> = known.bundles.iter().map(|b| b.name.as_str()).collect();
    there.sort_unstable();
    let hint = did_you_mean(application, names);
    let there = if !hint.is_empty() {
        hint
    } else if there.is_empty() {
        String::from("; no bundle is known")
    } else {
        format!("; known bundles: {}", there.join(", "))
    };
    let meant = match canonical_bundle(application) {
        Some((name, _)) if name != application => format!(" (ASAM's `{name}`)"),
        _ => String::new(),
    };
    Oddity::warning(
        position,
        format!("no bundle has the name `{application}`{meant}{there}"),
    )
}

fn check_checker(
    checker: &CheckerConfig,
    (bundle, checkers): (&KnownBundle, &[KnownChecker]),
    known: &Known,
    oddities: &mut Vec<Oddity>,
) {
    let Some(found) = checkers.iter().find(|c| c.id == checker.id) else {
        oddities.push(unknown_checker(checker, (bundle, checkers), known));
        return;
    };
    let mut names: Names<'_> = found.params().collect();
    names.insert((LEVEL_PARAM, ParamType::Text));
    let what = format!("checker `{}` reads no parameter", found.id);
    check_params(&checker.params, &names, &what, oddities);
    check_values(&checker.params, &names, oddities);
}

fn unknown_checker(
    checker: &CheckerConfig,
    (bundle, checkers): (&KnownBundle, &[KnownChecker]),
    known: &Known,
) -> Oddity {
    let elsewhere = known
        .bundles
        .iter()
        .find(|b| b.checkers.iter().flatten().any(|c| c.id == checker.id));
    let hint = match elsewhere {
        Some(other) => format!("; bundle `{}` has it", other.name),
        None => did_you_mean(&checker.id, checkers.iter().map(|c| c.id.as_str())),
    };
    let text = format!(
        "bundle `{}` has no checker `{}`{hint}",
        bundle.name, checker.id
    );
    Oddity::warning(checker.position, text)
}

fn check_params(params: &[ConfigParam], names: &Names<'_>, what: &str, oddities: &mut Vec<Oddity>) {
    for param in params
        .iter()
        .filter(|param| names.iter().all(|(name, _)| *name != param.name))
    {
        // Sorted, so that the hint is always the same when several names are equally near.
        let near: BTreeSet<&str> = names.iter().map(|(name, _)| *name).collect();
        let hint = did_you_mean(&param.name, near);
        oddities.push(Oddity::warning(
            param.position,
            format!("{what} `{}`{hint}", param.name),
        ));
    }
}

/// Checks parameter values. A checker that cannot read its parameter checks nothing.
fn check_values(params: &[ConfigParam], names: &Names<'_>, oddities: &mut Vec<Oddity>) {
    for param in params {
        let unread = names
            .iter()
            .find(|(name, value)| *name == param.name && value.read(&param.value).is_none());
        if let Some((name, value)) = unread {
            let text = format!(
                "the parameter `{name}` is `{}`, but must be {}: checkers that read it check nothing",
                param.value,
                value.expected()
            );
            oddities.push(Oddity::warning(param.position, text));
        }
    }
}

fn check_report(report: &ReportConfig, known: &Known) -> Option<Oddity> {
    let name = report.application.as_str();
    let is_it = |known: &String| same_reporter(name, known);
    if known.reporters.iter().any(is_it) {
        return None;
    }
    let names: Vec<&str> = known.reporters.iter().map(String::as_str).collect();
    let hint = match did_you_mean(name, names.iter().copied()) {
        hint if hint.is_empty() && !names.is_empty() => {
            format!("; known reporters: {}", names.join(", "))
        }
        hint => hint,
    };
    Some(Oddity::warning(
        report.position,
        format!("no reporter has the name `{name}`{hint}"),
    ))
}
