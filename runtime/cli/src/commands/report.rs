//! `qcbus report`: runs a reporter on existing results.

use std::collections::BTreeMap;

use qcbus_formats::xqar::Param;
use qcbus_messages::Exit;
use qcbus_messages::path_text::to_text;
use qcbus_reporter_sdk::{LoadError, OnceError, OneShot, Setting, report_once};

use super::check::report_place;
use crate::args::ReportArgs;
use crate::{standard, talk};

/// Runs the command.
pub fn run(args: &ReportArgs) -> Exit {
    talk::log("warn");
    let registration = args.format;
    let mut reporter = (registration.make)(&Setting {
        color: talk::color(),
        keep: false,
        is_run: true,
        pages: standard::page,
    });
    let param = |(name, value): &(String, String)| Param {
        name: name.clone(),
        value: value.clone(),
    };
    if let Some(Err((exit, why))) = args.output.as_deref().map(report_place) {
        talk::fail(&why);
        return exit;
    }
    let mut params: Vec<Param> = args.param.iter().map(param).collect();
    if let Some(file) = &args.output {
        params.push(Param {
            name: "OutputFile".to_owned(),
            value: to_text(file),
        });
    }
    let what = OneShot {
        results: args.results.clone(),
        config: args.config.clone(),
        params,
        rules: about(),
    };
    match report_once(reporter.as_mut(), registration, &what) {
        Ok(()) => Exit::Accepted,
        Err(error) => {
            talk::fail(&format!("failed to {error}"));
            match error {
                OnceError::Config { .. } | OnceError::Load(LoadError::Read { .. }) => Exit::Usage,
                OnceError::Load(LoadError::Content { .. }) | OnceError::Report(_) => Exit::Usage,
            }
        }
    }
}

/// Returns the descriptions of the rules of the standard bundles, by UID.
fn about() -> BTreeMap<String, String> {
    let checkers = standard::BUNDLES
        .iter()
        .flat_map(|bundle| bundle.checkers());
    let rules = checkers.flat_map(|checker| {
        let about = checker.description;
        checker
            .facts
            .uids
            .iter()
            .map(move |uid| ((*uid).to_owned(), about.clone()))
    });
    rules.collect()
}
