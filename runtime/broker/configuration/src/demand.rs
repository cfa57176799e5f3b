//! Demand of a configuration in the form for the state machine.

use std::ffi::OsStr;
use std::path::Path;
use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_formats::config::{BundleConfig, Choice, Config, Names, same_bundle};
use qcbus_ingest::modular::SearchPath;
use qcbus_messages::{Catalogue, Digest, codec};
use qcbus_types::{ChildSpec, Demand};
use sha2::{Digest as _, Sha256};

use crate::{LoadError, Loaded, Sources};

/// The configuration in force: parsed, encoded for the bus and with its digest.
#[derive(Debug, Clone)]
pub struct InForce {
    /// The configuration. `None` if there is none, so that every checker that is on by default runs.
    pub config: Option<Arc<Config>>,
    /// The configuration without the named shadows. Results are pooled with it, because shadows are not required.
    pub judging: Option<Arc<Config>>,
    /// Encoded form for the bus.
    pub encoded: Vec<u8>,
    /// SHA-256 of the encoded form and of the search path.
    pub digest: Digest,
    /// Search path for the files that modular scenarios refer to.
    pub search: Arc<SearchPath>,
    /// Selection of checkers for this run.
    pub choice: Choice,
}

impl InForce {
    /// Puts a configuration into force.
    ///
    /// # Errors
    /// Returns an error if it is too large for the bus.
    pub fn new(config: Option<Config>, search: SearchPath) -> Result<InForce, codec::CodecError> {
        let encoded = codec::encode(&config)?;
        let mut hash = Sha256::new_with_prefix(&encoded);
        for directory in search.directories() {
            // Another search path may also lead to another verdict.
            hash.update([0]);
            hash.update(directory.as_os_str().as_encoded_bytes());
        }
        let digest = Digest(hash.finalize().into());
        let config = config.map(Arc::new);
        Ok(InForce {
            judging: config.clone(),
            config,
            encoded,
            digest,
            search: Arc::new(search),
            choice: Choice::default(),
        })
    }

    /// Returns the loaded configuration in force. Its own search path precedes that of the
    /// environment. Relative directories in it start at the directory of the configuration.
    ///
    /// # Errors
    /// [`LoadError::Config`] if it is too large for the bus.
    pub fn of(sources: &Sources, loaded: &Loaded) -> Result<InForce, LoadError> {
        let of_environment = SearchPath::of_environment();
        let written = loaded.config.as_ref().and_then(Config::scenario_path);
        let search = match written {
            Some(text) => {
                let file = sources.config.as_deref().unwrap_or(Path::new(""));
                let base = file.parent().unwrap_or(Path::new(""));
                SearchPath::parse(OsStr::new(text), base).then(&of_environment)
            }
            None => of_environment,
        };
        InForce::new(loaded.config.clone(), search)
            .and_then(|in_force| in_force.with_levels_of_asam(sources.strict))
            .map(|in_force| in_force.with_separate_findings(sources.all))
            .map(|in_force| in_force.beside(&loaded.children))
            .map(|in_force| in_force.narrowed(sources.choice.clone()))
            .map(|in_force| in_force.with_own_verdicts(sources.own_verdicts))
            .map_err(|error| LoadError::Config(error.to_string()))
    }

    /// Returns the configuration in force, with the levels of ASAM for all findings if `strict`.
    fn with_levels_of_asam(mut self, strict: bool) -> Result<InForce, codec::CodecError> {
        if !strict {
            return Ok(self);
        }
        let config = self.config.as_deref().cloned().unwrap_or_default();
        let config = config.with_levels_of_asam();
        self.encoded = codec::encode(&Some(&config))?;
        if self.config.is_some() {
            self.config = Some(Arc::new(config));
            self.judging = self.config.clone();
        }
        self.digest = extended(self.digest, "levels of ASAM");
        Ok(self)
    }

    /// Returns the configuration in force. Results with separate findings differ from others.
    fn with_separate_findings(mut self, all: bool) -> InForce {
        if all {
            self.digest = extended(self.digest, "separate findings");
        }
        self
    }

    /// Returns the configuration in force for these children, which may contain shadows.
    fn beside(mut self, children: &[ChildSpec]) -> InForce {
        let names_shadow = |it: &BundleConfig| {
            let mut shadows = children.iter().filter(|child| child.shadow);
            shadows.any(|child| same_bundle(&it.application, &child.name, ""))
        };
        if let Some(judging) = &mut self.judging
            && judging.bundles.iter().any(names_shadow)
        {
            Arc::make_mut(judging)
                .bundles
                .retain(|it| !names_shadow(it));
        }
        self
    }

    /// Returns the configuration in force, limited to the checkers in `choice`.
    #[must_use]
    pub fn narrowed(mut self, choice: Choice) -> InForce {
        if !choice.is_everything() {
            let mut hash = Sha256::new_with_prefix(self.digest.0);
            hash.update(choice.to_string());
            self.digest = Digest(hash.finalize().into());
        }
        self.choice = choice;
        self
    }

    /// Returns the configuration in force with or without own verdicts. Own verdicts ignore the
    /// verdicts on the files that a file rests on. Verdicts of the other kind become invalid.
    #[must_use]
    fn with_own_verdicts(mut self, own_verdicts: bool) -> InForce {
        if own_verdicts {
            let mut hash = Sha256::new_with_prefix(self.digest.0);
            hash.update("own verdicts");
            self.digest = Digest(hash.finalize().into());
        }
        self
    }

    /// Returns its demand.
    pub fn demand(&self) -> Arc<dyn Demand> {
        let all: Arc<dyn Demand> = match &self.config {
            Some(config) => Arc::new(Configured(config.clone())),
            None => Arc::new(Everything),
        };
        if self.choice.is_everything() {
            return all;
        }
        let configured = self.config.is_some();
        let choice = self.choice.clone();
        Arc::new(Chosen {
            all,
            choice,
            configured,
        })
    }
}

/// Demand without a configuration: every checker that is on by default.
#[derive(Debug)]
pub struct Everything;

impl Demand for Everything {
    fn wants_bundle(&self, _: &str, _: &str) -> bool {
        true
    }

    fn checkers(&self, _: &str, catalogue: &Catalogue, kind: FileKind) -> Vec<u32> {
        select(catalogue, |checker| {
            checker.default_on && checker.kinds.contains(&kind)
        })
    }

    fn named(&self) -> Vec<String> {
        Vec::new()
    }

    fn means(&self, _: &str, _: &str, _: &str) -> bool {
        false
    }
}

#[derive(Debug)]
struct Configured(Arc<Config>);

impl Demand for Configured {
    fn wants_bundle(&self, name: &str, alias: &str) -> bool {
        self.0.bundle(name, alias).is_some()
    }

    fn checkers(&self, name: &str, catalogue: &Catalogue, _: FileKind) -> Vec<u32> {
        // A named checker that does not apply to this kind is reported as skipped by the bundle.
        select(catalogue, |checker| {
            self.0
                .selects(name, &catalogue.alias, &checker.id)
                .runs(checker.default_on)
        })
    }

    fn named(&self) -> Vec<String> {
        self.0
            .bundles
            .iter()
            .map(|bundle| bundle.application.clone())
            .collect()
    }

    fn means(&self, named: &str, name: &str, alias: &str) -> bool {
        same_bundle(named, name, alias)
    }
}

/// Demand that is limited to a choice.
#[derive(Debug)]
struct Chosen {
    all: Arc<dyn Demand>,
    choice: Choice,
    /// Whether a configuration determines the demand.
    configured: bool,
}

impl Demand for Chosen {
    fn wants_bundle(&self, name: &str, alias: &str) -> bool {
        self.all.wants_bundle(name, alias)
    }

    fn checkers(&self, name: &str, catalogue: &Catalogue, kind: FileKind) -> Vec<u32> {
        let demanded = self.all.checkers(name, catalogue, kind);
        let asks = |index: u32, checker: &qcbus_messages::CheckerInfo| {
            let names = Names {
                bundle: name,
                alias: &catalogue.alias,
                id: &checker.id,
                uids: &checker.rule_uids,
            };
            let is_demanded = demanded.contains(&index);
            // Without a configuration, a checker that is off by default can be requested by name.
            let may_ask = is_demanded || (!self.configured && checker.kinds.contains(&kind));
            may_ask && self.choice.asks(names, is_demanded)
        };
        let checkers = (0..).zip(&catalogue.checkers);
        let asked = checkers.filter(|&(index, checker)| asks(index, checker));
        asked.map(|(index, _)| index).collect()
    }

    fn named(&self) -> Vec<String> {
        self.all.named()
    }

    fn means(&self, named: &str, name: &str, alias: &str) -> bool {
        self.all.means(named, name, alias)
    }
}

fn select(
    catalogue: &Catalogue,
    wanted: impl Fn(&qcbus_messages::CheckerInfo) -> bool,
) -> Vec<u32> {
    let mut selected = Vec::new();
    for (index, checker) in (0_u32..).zip(&catalogue.checkers) {
        if wanted(checker) {
            selected.push(index);
        }
    }
    selected
}

/// Returns the digest of a configuration and a setting of the command line.
fn extended(digest: Digest, setting: &str) -> Digest {
    let mut hash = Sha256::new_with_prefix(digest.0);
    hash.update(setting);
    Digest(hash.finalize().into())
}
