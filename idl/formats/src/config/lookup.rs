//! Lookups in a configuration for brokers and bundles.

use super::{
    BundleConfig, CheckerConfig, Config, ConfigParam, INPUT_PARAMS, LEVELS_OF_ASAM, LEVELS_PARAM,
    Levels, Oddity, ReportConfig, SCENARIO_PATH_PARAM, TextPosition,
};
use crate::xqar::{Level, Param};

/// ASAM's published bundles: the name in manifests and results, the alias in qcbus, and the other
/// names in configurations.
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

/// Selection state of one checker of one bundle in a configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selection {
    /// The configuration names the checker.
    Selected(Selected),
    /// The configuration names the bundle and none of its checkers: its default checkers run.
    ByDefault,
    /// The configuration names the bundle and other checkers of it.
    CheckerNotConfigured,
    /// The configuration does not name the bundle.
    BundleNotConfigured,
}

/// Treatment of a checker's issues: they first get a new level, then are kept or removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Selected {
    /// The levels that are kept.
    pub levels: Levels,
    /// The level that all issues get, if configured.
    pub relevel: Option<Level>,
}

impl Selection {
    /// Checks whether a checker with this selection runs.
    pub fn runs(self, default_on: bool) -> bool {
        match self {
            Selection::Selected(_) => true,
            Selection::ByDefault => default_on,
            Selection::CheckerNotConfigured | Selection::BundleNotConfigured => false,
        }
    }
}

/// Checks whether an `application` in a configuration means the bundle of this name and alias. It
/// may be the name, the alias, or any name of the ASAM bundle that this bundle replaces.
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

/// Returns the name of ASAM's published bundle that an `application` means, if any.
pub fn published_name(application: &str) -> Option<&'static str> {
    canonical_bundle(application).map(|(name, _)| name)
}

/// Returns name and alias of the published bundle that an `application` means.
pub(super) fn canonical_bundle(application: &str) -> Option<(&'static str, &'static str)> {
    PUBLISHED
        .iter()
        .find(|(name, alias, others)| {
            *name == application || *alias == application || others.contains(&application)
        })
        .map(|(name, alias, _)| (*name, *alias))
}

/// Checks whether an `application` in a configuration means the reporter of this name, either
/// directly or after `reporter_named`.
pub fn same_reporter(application: &str, name: &str) -> bool {
    application == name || reporter_named(application) == name
}

/// Returns the qcbus reporter name for an `application`: `TextReport`, ASAM's `qc_report_text` and
/// plain `text` become `qc-report-text`. It does not check whether the reporter exists.
pub fn reporter_named(application: &str) -> String {
    let lower = application.to_ascii_lowercase().replace('_', "-");
    let stem = lower.strip_prefix(REPORTER).unwrap_or(&lower);
    let stem = stem.strip_suffix("report").unwrap_or(stem);
    // ASAM's framework has a `GithubCIReport`.
    let stem = stem.strip_suffix("ci").unwrap_or(stem);
    format!("{REPORTER}{stem}")
}

/// Prefix of the names of qcbus reporters.
const REPORTER: &str = "qc-report-";

impl Config {
    /// Returns the file to check: `InputFile`, else `XodrFile`, else `XoscFile`; global parameters
    /// before those of a bundle. The result is never empty. Relative paths stay as written.
    pub fn input_file(&self) -> Option<&str> {
        let sections = std::iter::once(&self.params).chain(self.bundles.iter().map(|b| &b.params));
        sections
            .flat_map(|params| INPUT_PARAMS.iter().filter_map(|name| value(params, name)))
            .find(|path| !path.is_empty())
    }

    /// Returns the entry for the bundle of this name and alias.
    pub fn bundle(&self, name: &str, alias: &str) -> Option<&BundleConfig> {
        self.bundles
            .iter()
            .find(|bundle| same_bundle(&bundle.application, name, alias))
    }

    /// Returns the configured selection of a checker.
    pub fn selects(&self, bundle_name: &str, alias: &str, checker_id: &str) -> Selection {
        match self.bundle(bundle_name, alias) {
            None => Selection::BundleNotConfigured,
            Some(bundle) => bundle.selects(checker_id),
        }
    }

    /// Returns the parameters of a checker. Each default gets its effective value: the first of
    /// checker, bundle, global and default. Further parameters of the checker's own section follow.
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

    /// Checks whether the configuration was written for ASAM's framework: it has no parameter of
    /// qcbus. Findings then have the levels of ASAM.
    pub fn is_of_asam(&self) -> bool {
        !self.all_params().any(|it| it.name.starts_with("qcbus."))
    }

    /// Checks whether a parameter selects the levels of ASAM, for all or for some checkers.
    pub fn selects_levels_of_asam(&self) -> bool {
        self.all_params()
            .any(|it| it.name == LEVELS_PARAM && it.value.trim() == LEVELS_OF_ASAM)
    }

    /// Checks whether results list findings as ASAM's framework does: each is an issue of its own.
    pub fn lists_as_asam(&self) -> bool {
        self.is_of_asam() || self.selects_levels_of_asam()
    }

    /// Returns the global parameters and those of all bundles and checkers.
    fn all_params(&self) -> impl Iterator<Item = &ConfigParam> {
        let in_bundles = self.bundles.iter().flat_map(|bundle| {
            let checkers = bundle.checkers.iter().flat_map(|it| &it.params);
            bundle.params.iter().chain(checkers)
        });
        self.params.iter().chain(in_bundles)
    }

    /// Checks whether the configuration only selects levels. A broker without a configuration file
    /// sends such a one to its bundles; every checker that is on by default is then demanded.
    pub fn sets_only_levels(&self) -> bool {
        let sets_levels = |param: &ConfigParam| param.name == LEVELS_PARAM;
        self.bundles.is_empty() && !self.params.is_empty() && self.params.iter().all(sets_levels)
    }

    /// Returns the configuration with the levels of ASAM for all bundles.
    #[must_use]
    pub fn with_levels_of_asam(mut self) -> Config {
        let bundles = self.bundles.iter_mut();
        let in_bundles = bundles.flat_map(|bundle| {
            let checkers = bundle.checkers.iter_mut().map(|it| &mut it.params);
            checkers.chain([&mut bundle.params])
        });
        for params in in_bundles.chain([&mut self.params]) {
            params.retain(|param| param.name != LEVELS_PARAM);
        }
        self.params.push(ConfigParam {
            name: LEVELS_PARAM.to_owned(),
            value: LEVELS_OF_ASAM.to_owned(),
            position: TextPosition::default(),
        });
        self
    }

    /// Returns the parameters of a bundle: its own, then the global ones that it does not set
    /// itself. The parameters of [`Config::input_file`] are left out.
    pub fn bundle_params(&self, bundle: Option<&BundleConfig>) -> Vec<Param> {
        let mut params = merged(bundle.map_or(&[], |bundle| &bundle.params), &self.params);
        params.retain(|param| !INPUT_PARAMS.contains(&param.name.as_str()));
        params
    }

    /// Returns the search directories for referenced scenarios, as written.
    pub fn scenario_path(&self) -> Option<&str> {
        value(&self.params, SCENARIO_PATH_PARAM)
    }

    /// Returns the parameters of a report: its own, then the global ones that it does not set
    /// itself.
    pub fn report_params(&self, report: &ReportConfig) -> Vec<Param> {
        merged(&report.params, &self.params)
    }

    /// Returns one information for each checker with `minLevel` and `maxLevel` in the old order,
    /// which was read as an interval.
    pub fn old_order_oddities(&self) -> Vec<Oddity> {
        let checkers = self.bundles.iter().flat_map(|bundle| &bundle.checkers);
        checkers
            .filter(|checker| checker.old_order)
            .map(CheckerConfig::old_order_oddity)
            .collect()
    }
}

impl BundleConfig {
    /// Returns the selection of a checker in this entry.
    pub fn selects(&self, checker_id: &str) -> Selection {
        if self.checkers.is_empty() {
            return Selection::ByDefault;
        }
        match self.checker(checker_id) {
            Some(checker) => Selection::Selected(checker.selected()),
            None => Selection::CheckerNotConfigured,
        }
    }

    /// Returns the entry of a checker.
    pub fn checker(&self, id: &str) -> Option<&CheckerConfig> {
        self.checkers.iter().find(|checker| checker.id == id)
    }
}

impl CheckerConfig {
    /// Returns how its issues are treated.
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
                "checker `{}`: minLevel=\"{worst}\" maxLevel=\"{mildest}\" is the order of 2023 and is read as \
                 the levels {worst} to {mildest} (current order: minLevel=\"{mildest}\" maxLevel=\"{worst}\", \
                 because 1 is an error and 3 is information)",
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
