//! `qcbus config check`.

use std::path::Path;

use qcbus_formats::config::{Config, Known, KnownBundle, KnownChecker};
use qcbus_formats::xqar::Level;
use qcbus_messages::Exit;

use crate::{standard, talk};

/// Runs the command.
pub fn check(file: &Path) -> Exit {
    let shown = file.display();
    let bytes = match std::fs::read(file) {
        Ok(bytes) => bytes,
        Err(error) => {
            talk::fail(&format!("cannot read {shown}: {error}"));
            return Exit::Usage;
        }
    };
    let parsed = match Config::parse(&bytes) {
        Ok(parsed) => parsed,
        Err(error) => {
            talk::fail(&format!("{shown}:{error}"));
            return Exit::Usage;
        }
    };
    let mut notices = parsed.notices.clone();
    notices.extend(parsed.config.check(&known()));
    notices.sort_by_key(|notice| (notice.row, notice.column));
    notices.dedup();
    for notice in &notices {
        let level = format!("{:?}", notice.level).to_lowercase();
        talk::print(&format!(
            "{shown}:{}:{}: {level}: {}\n",
            notice.row, notice.column, notice.text
        ));
    }
    let warnings = notices
        .iter()
        .filter(|notice| notice.level <= Level::Warning)
        .count();
    talk::say(&format!("{shown}: usable, {warnings} warnings"));
    Exit::Accepted
}

/// What this program brings along.
fn known() -> Known {
    let bundle = |bundle: &&qcbus_sdk::Bundle| {
        let checker = |checker: qcbus_sdk::Checker| KnownChecker {
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
            checkers: bundle.checkers().into_iter().map(checker).collect(),
        }
    };
    Known {
        bundles: standard::BUNDLES.iter().map(bundle).collect(),
        ..Known::default()
    }
}
