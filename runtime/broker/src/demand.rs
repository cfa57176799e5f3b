//! What a configuration demands, in the state machine's words.

use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_formats::config::Config;
use qcbus_ingest::modular::SearchPath;
use qcbus_messages::codec;
use qcbus_messages::{Catalogue, Digest};
use sha2::{Digest as _, Sha256};

use crate::core::Demand;

/// A configuration in force: parsed, encoded for the bus, and with its digest.
#[derive(Debug, Clone)]
pub struct InForce {
    /// The configuration; `None` when there is none and everything runs that is on by default.
    pub config: Option<Arc<Config>>,
    /// As it travels on the bus.
    pub encoded: Vec<u8>,
    /// SHA-256 of the encoded form and of the search path.
    pub digest: Digest,
    /// Where the scenarios are looked for that modular scenarios refer to.
    pub search: Arc<SearchPath>,
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
        Ok(InForce {
            config: config.map(Arc::new),
            encoded,
            digest,
            search: Arc::new(search),
        })
    }

    /// What it demands.
    pub fn demand(&self) -> Arc<dyn Demand> {
        match &self.config {
            Some(config) => Arc::new(Configured(config.clone())),
            None => Arc::new(Everything),
        }
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
        qcbus_formats::config::same_bundle(named, name, alias)
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
