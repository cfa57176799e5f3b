//! What a configuration demands, in the state machine's words.

use std::ffi::OsStr;
use std::path::Path;
use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_formats::config::{BundleConfig, Choice, Config, Names, same_bundle};
use qcbus_ingest::modular::SearchPath;
use qcbus_messages::codec;
use qcbus_messages::{Catalogue, Digest};
use sha2::{Digest as _, Sha256};

use crate::core::{ChildSpec, Demand};
use crate::reload::{LoadError, Loaded, Sources};

/// A configuration in force: parsed, encoded for the bus, and with its digest.
#[derive(Debug, Clone)]
pub struct InForce {
    /// The configuration; `None` when there is none and everything runs that is on by default.
    pub config: Option<Arc<Config>>,
    /// The same without the shadows that it names: what results are pooled by, for nobody misses those.
    pub judging: Option<Arc<Config>>,
    /// As it travels on the bus.
    pub encoded: Vec<u8>,
    /// SHA-256 of the encoded form and of the search path.
    pub digest: Digest,
    /// Where the scenarios are looked for that modular scenarios refer to.
    pub search: Arc<SearchPath>,
    /// What of all that was asked for, or left out, for this run.
    pub choice: Choice,
}

impl InForce {
    /// Puts a configuration into force.
    ///
    /// # Errors
    /// When it is too large for the bus.
    pub fn new(config: Option<Config>, search: SearchPath) -> Result<InForce, codec::CodecError> {
        let encoded = codec::encode(&config)?;
        let mut hash = Sha256::new_with_prefix(&encoded);
        for directory in search.directories() {
            // With another search path a verdict may be another, too.
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

    /// What was loaded, with the search path of the configuration before that of the environment.
    /// Relative directories of the former start where the configuration lies.
    ///
    /// # Errors
    /// [`LoadError::Config`] when it is too large for the bus.
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
            .map(|in_force| in_force.beside(&loaded.children))
            .map(|in_force| in_force.narrowed(sources.choice.clone()))
            .map(|in_force| in_force.with_own_verdicts(sources.own_verdicts))
            .map_err(|error| LoadError::Config(error.to_string()))
    }

    /// The same beside these children, some of which may be shadows.
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

    /// The same, but only what `choice` asks for.
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

    /// The same, with or without verdicts that count in those on the files that a file rests on. Verdicts of the
    /// other kind do not stand.
    #[must_use]
    fn with_own_verdicts(mut self, own_verdicts: bool) -> InForce {
        if own_verdicts {
            let mut hash = Sha256::new_with_prefix(self.digest.0);
            hash.update("own verdicts");
            self.digest = Digest(hash.finalize().into());
        }
        self
    }

    /// What it demands.
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

/// Without a configuration: every checker that is on by default.
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
        // What is named and does not apply to this kind is listed as skipped, by the bundle.
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

/// What is chosen of what would be demanded.
#[derive(Debug)]
struct Chosen {
    all: Arc<dyn Demand>,
    choice: Choice,
    /// Whether a configuration says what would be demanded.
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
            // One that is off by default may be asked for by its name, where no configuration speaks.
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
