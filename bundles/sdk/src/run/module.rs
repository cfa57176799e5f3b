//! Runs a bundle as a module of ASAM's quality checker framework: `-c config.xml`.

use std::path::{Path, PathBuf};

use qcbus_formats::config::{Config, LEVELS_OF_ASAM, LEVELS_PARAM};
use qcbus_formats::pool::{self, PoolInput, Scope};
use qcbus_formats::xqar::{self, Dialect};
use qcbus_messages::path_text::to_text;

use super::Exit;
use super::file::{complain, examine_timed};
use crate::{BUILD_DATE, Bundle, Checker, Loaded, Permits, Plan, UserFiles};

/// Parameters of the bundle that name its result file. The framework's name is first.
const RESULT_PARAMS: [&str; 2] = ["strResultFile", "resultFile"];

/// Reason why a module run fails, as a continuation of "failed to ".
#[derive(Debug, thiserror::Error)]
enum ModuleError {
    #[error("read the configuration {}: {source}", to_text(path))]
    Unreadable {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("read the configuration: {path}:{error}")]
    Config {
        path: String,
        error: qcbus_formats::config::ConfigError,
    },
    #[error("find the file to check: the configuration has no Param `InputFile`")]
    NoInput,
    #[error(transparent)]
    Load(#[from] crate::LoadError),
    #[error("write the result {}: {source}", to_text(path))]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
}

/// Runs the module. Exit codes follow the framework: 0 if a result was written, whatever its
/// content.
pub(super) fn run(
    bundle: &'static Bundle,
    config: &Path,
    permits: &Permits,
    given: Option<&UserFiles>,
) -> Exit {
    match module(bundle, config, permits, given) {
        Ok(()) => Exit::Accepted,
        Err(error) => {
            complain(&format!("failed to {error}\n"));
            Exit::Usage
        }
    }
}

fn module(
    bundle: &'static Bundle,
    path: &Path,
    permits: &Permits,
    given: Option<&UserFiles>,
) -> Result<(), ModuleError> {
    let bytes = std::fs::read(path).map_err(|source| ModuleError::Unreadable {
        path: path.to_owned(),
        source,
    })?;
    let parsed = Config::parse(&bytes).map_err(|error| ModuleError::Config {
        path: to_text(path),
        error,
    })?;
    for oddity in &parsed.oddities {
        tracing::warn!(
            "{}:{}:{}: {}",
            to_text(path),
            oddity.row,
            oddity.column,
            oddity.text
        );
    }
    let config = parsed.config;
    let input = PathBuf::from(config.input_file().ok_or(ModuleError::NoInput)?);
    let input = std::path::absolute(&input).unwrap_or(input);
    let loaded = Loaded::from_path(&input, input.parent().unwrap_or(Path::new("/")))?;
    let plan = if bundle.kinds.contains(&loaded.kind()) {
        configured(bundle, Some(&config), given)
    } else {
        Plan::new(bundle, |_| false, |_, _| None)
    };
    let mut bundles = vec![examine_timed(&plan, &loaded, permits)?.0];
    if config.is_of_asam() {
        pool::state_levels_of_asam(&mut bundles);
    }
    let remarks = if bundle.kinds.contains(&loaded.kind()) {
        loaded.remarks(&bundles)?
    } else {
        Vec::new()
    };
    let input = to_text(&input);
    let mut nowhere = pool::NoPlaces;
    let pooled = pool::pool(
        PoolInput {
            input_file: &input,
            config: Some(&config),
            bundles,
            remarks,
            scope: Scope::Alone,
            separate: true,
            version: bundle.version,
            build_date: BUILD_DATE,
        },
        &mut nowhere,
    );
    write(
        &result_path(bundle, &config),
        &xqar::write(&pooled.results, Dialect::Current),
    )
}

/// Returns the plan of a bundle under a configuration. Without one, the plan contains everything
/// that is on by default. Reads the files that the configuration names for rules, unless the
/// command line gave some.
pub(super) fn configured(
    bundle: &'static Bundle,
    config: Option<&Config>,
    given: Option<&UserFiles>,
) -> Plan {
    let Some(config) = config else {
        return Plan::by_default(bundle).with_files(given);
    };
    let section = config.bundle(bundle.name, bundle.alias);
    // A broker that sets only the levels names the demanded checkers itself.
    let everything = config.sets_only_levels();
    let demanded = |checker: &Checker| match everything {
        true => checker.facts.default_on,
        false => config
            .selects(bundle.name, bundle.alias, &checker.id)
            .runs(checker.facts.default_on),
    };
    let levels = || {
        let of_asam = config.is_of_asam();
        of_asam.then(|| LEVELS_OF_ASAM.to_owned())
    };
    let plan = Plan::new(bundle, demanded, |checker, name| {
        // The request has an empty default, so an empty answer means that the parameter is not
        // configured.
        let asked = xqar::Param {
            name: name.to_owned(),
            value: String::new(),
        };
        let params = config.effective_params(section, &checker.id, &[asked]);
        params
            .into_iter()
            .find(|param| param.name == name)
            .map(|p| p.value)
            .filter(|v| !v.is_empty())
            .or_else(|| (name == LEVELS_PARAM).then(levels).flatten())
    });
    match everything {
        true => plan.with_files(given),
        false => plan.following(config).with_files(given),
    }
}

/// Returns the path of the result, as in ASAM's bundles: the bundle's Param, relative to the
/// current directory, or else the bundle's name.
fn result_path(bundle: &Bundle, config: &Config) -> PathBuf {
    let section = config.bundle(bundle.name, bundle.alias);
    let params = section
        .map(|section| section.params.as_slice())
        .unwrap_or_default();
    let named = RESULT_PARAMS.iter().find_map(|name| {
        params
            .iter()
            .find(|param| param.name == *name && !param.value.is_empty())
    });
    named.map_or_else(
        || PathBuf::from(format!("{}.xqar", bundle.name)),
        |param| PathBuf::from(&param.value),
    )
}

fn write(path: &Path, text: &str) -> Result<(), ModuleError> {
    qcbus_disk::write_named(path, text.as_bytes(), true).map_err(|source| ModuleError::Write {
        path: path.to_owned(),
        source,
    })
}
