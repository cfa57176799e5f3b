//! The questions that a broker or a bundle asks a configuration.

use super::{
    BundleConfig, CheckerConfig, Config, ConfigParam, INPUT_PARAMS, Levels, Oddity, ReportConfig,
    SCENARIO_PATH_PARAM,
};
use crate::xqar::{Level, Param};

/// ASAM's published bundles: the name in manifests and results, the alias here, and the other
/// names under which configurations know them.
const PUBLISHED: [(&str, &str, &[&str]); 2] = [
    (
        "xodrBundle",
        "xodr",
        &["qc_opendrive", "qc-opendrive", "asam-qc-opendrive"],
    ),
    (
        "xoscBundle",
        "xosc",
        &[
            "qc_openscenario",
            "qc-openscenario",
            "qc_openscenarioxml",
            "qc-openscenarioxml",
            "asam-qc-openscenarioxml",
        ],
    ),
];

/// What a configuration says about one checker of one bundle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selection {
    /// The configuration names the checker.
    Selected(Selected),
    /// The configuration names the bundle and no checker of it: whatever runs by default does.
    ByDefault,
    /// The configuration names the bundle and other checkers of it.
    CheckerNotConfigured,
    /// The configuration does not name the bundle.
    BundleNotConfigured,
}

/// How a configured checker's issues are treated: first re-levelled, then kept or removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Selected {
    /// The levels that are kept.
    pub levels: Levels,
    /// The level that every issue gets.
    pub relevel: Option<Level>,
}

impl Selection {
    /// Whether a checker with this selection is to run.
    pub fn runs(self, default_on: bool) -> bool {
        match self {
            Selection::Selected(_) => true,
            Selection::ByDefault => default_on,
            Selection::CheckerNotConfigured | Selection::BundleNotConfigured => false,
        }
    }
}

/// Whether an `application` in a configuration means the bundle of this name and alias: by name,
/// by alias, or by a name of ASAM's published bundle that it stands for.
pub fn same_bundle(application: &str, name: &str, alias: &str) -> bool {
    if application.is_empty() {
        return false;
    }
    let canonical = canonical_bundle(application);
    application == name
        || application == alias
        || canonical.is_some_and(|(published, short)| {
            name == published || (alias == short && canonical_bundle(name).is_none())
        })
}

/// The name of ASAM's published bundle that an `application` means, if it means one.
pub fn published_name(application: &str) -> Option<&'static str> {
    canonical_bundle(application).map(|(name, _)| name)
}

/// Name and alias of the published bundle that is meant.
pub(super) fn canonical_bundle(application: &str) -> Option<(&'static str, &'static str)> {
    PUBLISHED
        .iter()
        .find(|(name, alias, others)| {
            *name == application || *alias == application || others.contains(&application)
        })
        .map(|(name, alias, _)| (*name, *alias))
}

/// Whether an `application` in a configuration means the reporter of this name: as it is, or as
/// [`reporter_named`] reads it.
pub fn same_reporter(application: &str, name: &str) -> bool {
    application == name || reporter_named(application) == name
}

/// The name of ours that an `application` stands for: `TextReport`, ASAM's `qc_report_text` and
/// plain `text` are `qc-report-text`. Whether there is such a reporter is another question.
pub fn reporter_named(application: &str) -> String {
    let lower = application.to_ascii_lowercase().replace('_', "-");
    let stem = lower.strip_prefix(REPORTER).unwrap_or(&lower);
    let stem = stem.strip_suffix("report").unwrap_or(stem);
    // ASAM's framework has a `GithubCIReport`.
    let stem = stem.strip_suffix("ci").unwrap_or(stem);
    format!("{REPORTER}{stem}")
}

/// What the names of our reporters begin with.
const REPORTER: &str = "qc-report-";

impl Config {
    /// The file to check: `InputFile`, else `XodrFile`, else `XoscFile`; global before a
    /// bundle's. Never empty. Relative paths are as written.
    pub fn input_file(&self) -> Option<&str> {
        let sections = std::iter::once(&self.params).chain(self.bundles.iter().map(|b| &b.params));
        sections
            .flat_map(|params| INPUT_PARAMS.iter().filter_map(|name| value(params, name)))
            .find(|path| !path.is_empty())
    }

    /// The entry for the bundle of this name and alias.
    pub fn bundle(&self, name: &str, alias: &str) -> Option<&BundleConfig> {
        self.bundles
            .iter()
            .find(|bundle| same_bundle(&bundle.application, name, alias))
    }

    /// What the configuration says about a checker.
    pub fn selects(&self, bundle_name: &str, alias: &str, checker_id: &str) -> Selection {
        match self.bundle(bundle_name, alias) {
            None => Selection::BundleNotConfigured,
            Some(bundle) => bundle.selects(checker_id),
        }
    }

    /// The parameters of a checker: each default with the value that counts (checker before
    /// bundle before global before default), then what the checker's own section has besides.
    pub fn effective_params(
        &self,
        bundle: Option<&BundleConfig>,
        checker_id: &str,
        defaults: &[Param],
    ) -> Vec<Param> {
        let own = bundle
            .and_then(|bundle| bundle.checker(checker_id))
            .map_or(&[][..], |checker| &checker.params);
        let shared = bundle.map_or(&[][..], |bundle| &bundle.params);
        let sections = [own, shared, &self.params];
        let mut params: Vec<Param> = Vec::with_capacity(defaults.len());
        for default in defaults {
            let set = sections
                .iter()
                .find_map(|section| value(section, &default.name));
            push_once(&mut params, &default.name, set.unwrap_or(&default.value));
        }
        for param in own {
            push_once(&mut params, &param.name, &param.value);
        }
        params
    }

    /// The parameters of a bundle: its own, then the global ones that it does not set itself.
    /// The names of the file to check are left out: see [`Config::input_file`].
    pub fn bundle_params(&self, bundle: Option<&BundleConfig>) -> Vec<Param> {
        let mut params = merged(bundle.map_or(&[], |bundle| &bundle.params), &self.params);
        params.retain(|param| !INPUT_PARAMS.contains(&param.name.as_str()));
        params
    }

    /// The directories in which referenced scenarios are looked for, as they are written.
    pub fn scenario_path(&self) -> Option<&str> {
        value(&self.params, SCENARIO_PATH_PARAM)
    }

    /// The parameters of a report: its own, then the global ones that it does not set itself.
    pub fn report_params(&self, report: &ReportConfig) -> Vec<Param> {
        merged(&report.params, &self.params)
    }

    /// The information that the old order of `minLevel` and `maxLevel` was read as an interval,
    /// one for each checker concerned.
    pub fn old_order_oddities(&self) -> Vec<Oddity> {
        let checkers = self.bundles.iter().flat_map(|bundle| &bundle.checkers);
        checkers
            .filter(|checker| checker.old_order)
            .map(CheckerConfig::old_order_oddity)
            .collect()
    }
}

impl BundleConfig {
    /// What the entry says about a checker.
    pub fn selects(&self, checker_id: &str) -> Selection {
        if self.checkers.is_empty() {
            return Selection::ByDefault;
        }
        match self.checker(checker_id) {
            Some(checker) => Selection::Selected(checker.selected()),
            None => Selection::CheckerNotConfigured,
        }
    }

    /// The entry of a checker.
    pub fn checker(&self, id: &str) -> Option<&CheckerConfig> {
        self.checkers.iter().find(|checker| checker.id == id)
    }
}

impl CheckerConfig {
    /// How its issues are treated.
    pub fn selected(&self) -> Selected {
        Selected {
            levels: self.levels,
            relevel: self.relevel,
        }
    }

    pub(super) fn old_order_oddity(&self) -> Oddity {
        let (worst, mildest) = (self.levels.worst() as u8, self.levels.mildest() as u8);
        Oddity::information(
            self.position,
            format!(
                "checker `{}`: minLevel=\"{worst}\" maxLevel=\"{mildest}\" is the order of 2023; \
                 read as the levels {worst} to {mildest} (today: minLevel=\"{mildest}\" \
                 maxLevel=\"{worst}\", because 1 is an error and 3 an information)",
                self.id
            ),
        )
    }
}

fn value<'c>(params: &'c [ConfigParam], name: &str) -> Option<&'c str> {
    params
        .iter()
        .find(|param| param.name == name)
        .map(|param| param.value.as_str())
}

fn merged(first: &[ConfigParam], then: &[ConfigParam]) -> Vec<Param> {
    let mut params = Vec::with_capacity(first.len() + then.len());
    for param in first.iter().chain(then) {
        push_once(&mut params, &param.name, &param.value);
    }
    params
}

fn push_once(params: &mut Vec<Param>, name: &str, value: &str) {
    if !params.iter().any(|param| param.name == name) {
        params.push(Param {
            name: name.to_owned(),
            value: value.to_owned(),
        });
    }
}
