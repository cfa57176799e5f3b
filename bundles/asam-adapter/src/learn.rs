//! Learns the checkers and the accepted files of a module from runs over small valid files.

use std::path::Path;

use qcbus_document::FileKind;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Level;

use crate::hosted::Hosted;
use crate::messages::{Bytes, Document, Request};
use crate::results::{Report, Told, read};
use crate::runners::Runners;
use crate::samples::{SAMPLES, Sample};

/// Learned properties of a module.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Learned {
    /// Name of the module's section in a configuration.
    pub application: String,
    pub version: String,
    pub description: String,
    pub kinds: Vec<FileKind>,
    pub checkers: Vec<Known>,
}

/// A checker of a module.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Known {
    pub id: String,
    pub description: String,
    pub uids: Vec<String>,
    /// Kinds of files for which the module reported this checker.
    pub kinds: Vec<FileKind>,
}

/// Application names in the code of the modules that ASAM publishes.
const PUBLISHED: [&str; 3] = ["xodrBundle", "xoscBundle", "otxBundle"];

/// Prefix of a hosted name that would otherwise be the name of one of qcbus' own bundles.
pub(crate) const PREFIX: &str = "asam.";

/// Pretended directory of the samples.
const NOWHERE: &str = "/sample of qcbus";

/// Learns the properties of the module.
///
/// # Errors
/// The reason why the module is unusable, as text for the user.
pub(crate) fn learn(hosted: &Hosted, runners: &Runners) -> Result<Learned, String> {
    let wanted = |it: &&Sample| {
        hosted
            .kinds
            .as_ref()
            .is_none_or(|kinds| kinds.contains(&it.kind))
    };
    let samples: Vec<&Sample> = SAMPLES.iter().filter(wanted).collect();
    let requests: Vec<(Request, Vec<u8>)> = samples
        .iter()
        .map(|it| (request(it, hosted), it.text.as_bytes().to_vec()))
        .collect();
    let answers = runners
        .ask_all(&requests)
        .map_err(|error| format!("it cannot be run: {error}"))?;
    let mut learned: Option<Learned> = None;
    let mut failures = Vec::new();
    for (sample, answered) in samples.into_iter().zip(answers) {
        let kind = sample.kind.as_str();
        let looked = answered.and_then(|(ran, result)| {
            let report = read(&hosted.name, &ran, &result)?;
            Ok((ran.application.unwrap_or_default(), report))
        });
        match looked {
            Err(why) => failures.push(format!("with a small {kind} file: {why}")),
            Ok((_, report)) if hosted.kinds.is_none() && !takes(&report) => failures.push(format!(
                "with a small {kind} file: the module `{}` did not check it, so it is not used for such files \
                 (set `kinds` in its manifest to change this)",
                hosted.name
            )),
            Ok((application, report)) => add(&mut learned, sample.kind, application, report),
        }
    }
    match learned {
        Some(learned) if !learned.checkers.is_empty() => {
            for why in failures {
                tracing::info!(module = hosted.name, why, "a kind of file is not supported");
            }
            Ok(learned)
        }
        _ => Err(of_no_use(&failures, hosted)),
    }
}

/// Number of output lines that are shown when nothing could be learned from a module.
const LINES: usize = 6;

fn of_no_use(failures: &[String], hosted: &Hosted) -> String {
    let mut text: Vec<String> = failures.iter().map(|it| shortened(it)).collect();
    if hosted.application.is_none() {
        let tried = applications(hosted).join("`, `");
        text.push(format!(
            "if its code uses another name than `{tried}` for its section of a configuration, set the name in \
             its manifest: \"application\": \"NAME\""
        ));
    }
    text.join("\n")
}

/// Returns the first and last lines, because a failing program prints the reason at the end.
fn shortened(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let [first, rest @ ..] = &lines[..] else {
        return String::new();
    };
    let left_out = rest.len().saturating_sub(LINES);
    let mut told = vec![*first];
    if left_out > 0 {
        told.push("[...]");
    }
    told.extend(&rest[left_out..]);
    told.join("\n")
}

fn request(sample: &Sample, hosted: &Hosted) -> Request {
    Request {
        files: vec![Document {
            path: Path::new(NOWHERE).join(sample.name),
            bytes: Bytes::Here(sample.text.len() as u64),
            packed: None,
        }],
        config: None,
        applications: applications(hosted),
        report: None,
    }
}

/// Returns the names under which a module may look for its section. The actual name is fixed in the
/// module's code.
fn applications(hosted: &Hosted) -> Vec<String> {
    if let Some(application) = &hosted.application {
        return vec![application.clone()];
    }
    let name = hosted.name.as_str();
    let names = [name, name.strip_prefix(PREFIX).unwrap_or(name)];
    let mut all: Vec<String> = Vec::new();
    for name in names.into_iter().chain(PUBLISHED) {
        if !all.iter().any(|it| it == name) {
            all.push(name.to_owned());
        }
    }
    all
}

/// Checks whether a module accepts a valid sample of a kind. It must find no error, or most of its
/// checkers must complete. A module for another standard reports a wrong root element and skips the
/// other checkers.
fn takes(report: &Report) -> bool {
    let completed = |it: &&Told| it.ending == Ending::Completed;
    let count = report.checkers.iter().filter(completed).count();
    let mut issues = report.checkers.iter().flat_map(|it| &it.issues);
    let finds_errors = issues.any(|it| it.level == Level::Error);
    count > 0 && (!finds_errors || 2 * count > report.checkers.len())
}

fn add(learned: &mut Option<Learned>, kind: FileKind, application: String, report: Report) {
    let learned = learned.get_or_insert_with(|| Learned {
        application,
        version: report.version,
        description: report.description,
        kinds: Vec::new(),
        checkers: Vec::new(),
    });
    learned.kinds.push(kind);
    for told in report.checkers {
        match learned.checkers.iter_mut().find(|it| it.id == told.id) {
            Some(known) => {
                known.kinds.push(kind);
                for uid in told.uids {
                    if !known.uids.contains(&uid) {
                        known.uids.push(uid);
                    }
                }
            }
            None => learned.checkers.push(Known {
                id: told.id,
                description: told.description,
                uids: told.uids,
                kinds: vec![kind],
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use qcbus_formats::xqar::Issue;

    use super::*;

    fn told(ending: Ending, level: Option<Level>) -> Told {
        let issue = |level| Issue {
            id: 0,
            description: String::new(),
            level,
            rule_uid: String::new(),
            locations: Vec::new(),
            domain_info: Vec::new(),
        };
        Told {
            id: String::new(),
            description: String::new(),
            uids: Vec::new(),
            issues: level.map(issue).into_iter().collect(),
            ending,
            metadata: Vec::new(),
        }
    }

    #[test]
    fn long_output_is_shortened_to_first_and_last_lines() {
        assert_eq!(shortened("why\none"), "why\none");
        let many: Vec<String> = (0..40).map(|it| it.to_string()).collect();
        assert_eq!(
            shortened(&many.join("\n")),
            "0\n[...]\n34\n35\n36\n37\n38\n39"
        );
    }

    #[test]
    fn kind_is_supported_only_if_some_checker_completes_cleanly() {
        let skipped = || {
            let reason = String::new();
            told(Ending::NotApplicable { reason }, None)
        };
        let done = |level| told(Ending::Completed, level);
        let takes = |checkers| {
            takes(&Report {
                version: String::new(),
                description: String::new(),
                checkers,
            })
        };
        assert!(
            takes(vec![done(None), skipped(), skipped()]),
            "the outcomes are valid"
        );
        assert!(
            takes(vec![done(Some(Level::Error)), done(None), skipped()]),
            "strict"
        );
        assert!(!takes(vec![done(Some(Level::Error)), skipped(), skipped()]));
        assert!(!takes(vec![skipped()]));
        assert!(!takes(Vec::new()));
    }
}
