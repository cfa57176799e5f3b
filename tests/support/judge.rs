//! The judge: checks the state of a farm that has come to rest.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;
use sha2::{Digest, Sha256};

use super::cli::files_below;
use super::content::{Content, STRICT};
use super::farm::Farm;
use super::reports::{reported, torn};
use super::watchdog::until_or;

/// Existing files by name.
pub type Files = BTreeMap<String, Content>;

/// Findings of the judge.
#[derive(Debug, Default)]
pub struct Judgement {
    /// Descriptions of everything that is wrong.
    pub complaints: Vec<String>,
    /// Files that have a result.
    pub with_result: usize,
    /// Number of files condemned for each bundle. A bundle died twice on such a file alone.
    pub condemned: BTreeMap<String, u64>,
}

/// Marker file that a broker puts into its gate directory.
const GATE_MARK: &str = ".qcbus-gate";

/// Words that the broker uses when it condemns a file.
const CONDEMNED: &str = "times in a new process with only this file";

/// Checks the whole farm. `strangers` are bundles with checkers that may be in error.
pub fn judge(farm: &Farm, files: &Files, strangers: &[&str]) -> Judgement {
    judge_with(farm, files, &Files::new(), strangers)
}

/// Works like [`judge`], with additional `parts`: files that others depend on but that are not
/// checked themselves.
pub fn judge_with(farm: &Farm, files: &Files, parts: &Files, strangers: &[&str]) -> Judgement {
    let mut judgement = Judgement::default();
    for (name, content) in files {
        let all = with_their_parts(content, |name| files.get(name).or_else(|| parts.get(name)));
        let spoilt = all.iter().find_map(|(_, part)| match part {
            Some(part) => part.spoils(),
            None => Some(STRICT),
        });
        let under = content.rests_on().into_iter();
        let under = under.filter(|it| files.contains_key(it)).collect();
        let parts = Parts { spoilt, under };
        judgement.file(farm, name, content, &parts, strangers);
    }
    judgement.nothing_else(farm, files);
    judgement
}

/// Effect of the parts of a file on its verdict.
struct Parts {
    /// Checker that finds a fault in the file because of a part.
    spoilt: Option<&'static str>,
    /// Files that it rests on and that have verdicts of their own.
    under: Vec<String>,
}

/// Returns all dependencies of a file by name, including those of its parts. An example is a
/// scenario on a map that includes something. A missing dependency is `None`.
fn with_their_parts<'c>(
    content: &Content,
    get: impl Fn(&str) -> Option<&'c Content>,
) -> BTreeMap<String, Option<&'c Content>> {
    let mut found = BTreeMap::new();
    let mut open = content.parts();
    while let Some(name) = open.pop() {
        let part = get(&name);
        open.extend(part.map(Content::parts).unwrap_or_default());
        found.insert(name, part);
    }
    found
}

impl Judgement {
    /// Fails the running test when there are complaints.
    pub fn demand(&self, log: &str) {
        let count = self.complaints.len();
        let first: Vec<&String> = self.complaints.iter().take(20).collect();
        assert!(count == 0, "{count} complaints: {first:#?}\n{log}");
    }

    fn complain(&mut self, name: &str, what: impl std::fmt::Display) {
        self.complaints.push(format!("{name}: {what}"));
    }

    fn file(
        &mut self,
        farm: &Farm,
        name: &str,
        content: &Content,
        parts: &Parts,
        strangers: &[&str],
    ) {
        let bytes = content.bytes();
        if std::fs::read(farm.root().join(name)).ok().as_ref() != Some(&bytes) {
            return self.complain(name, "the test does not know what is in it");
        }
        if !farm.out().join(format!("{name}.xqar")).exists() {
            return self.complain(name, "it has no result");
        }
        let told = farm.verdict_file(name);
        let digest = hex(&Sha256::digest(&bytes));
        self.with_result += 1;
        if told["sha256"].as_str() != Some(&digest) {
            self.complain(
                name,
                format!("the verdict is about {}, not {digest}", told["sha256"]),
            );
        }
        let (complete, foreign) = self.is_complete(farm, name, strangers);
        let checker = content.checker().or(parts.spoilt);
        if complete && !expected_rule_fired(farm, name, checker) {
            self.complain(name, format!("the fault was not found: {content:?}"));
        }
        let verdict = told["verdict"].as_str().unwrap_or_default();
        let expected = match checker {
            None => Verdict::Accepted,
            Some(_) => Verdict::Rejected,
        };
        let under = parts.under.iter().map(|it| farm.verdict_file(it));
        let under: Vec<serde_json::Value> = under.map(|it| it["verdict"].clone()).collect();
        let has = |verdict: Verdict| under.iter().any(|it| *it == verdict.as_str());
        let allowed = match expected {
            _ if has(Verdict::Rejected) => verdict == Verdict::Rejected.as_str(),
            _ if has(Verdict::Undetermined) => verdict != Verdict::Accepted.as_str(),
            _ if !complete => verdict != Verdict::Accepted.as_str(),
            Verdict::Accepted if foreign => verdict == Verdict::Undetermined.as_str(),
            expected => verdict == expected.as_str(),
        };
        if !allowed {
            self.complain(
                name,
                format!("verdict {verdict}, expected {expected}: {content:?}"),
            );
        }
    }

    /// Returns whether the standard bundles reported everything required, and whether a stranger
    /// failed.
    fn is_complete(&mut self, farm: &Farm, name: &str, strangers: &[&str]) -> (bool, bool) {
        let results = farm.result(name);
        let (mut complete, mut foreign, mut seen) = (true, false, false);
        let mut condemned = BTreeSet::new();
        for bundle in &results.bundles {
            let stranger = strangers.contains(&bundle.name.as_str());
            seen |= bundle.name == Content::bundle(name);
            for checker in &bundle.checkers {
                if matches!(checker.status, Some(Status::Completed | Status::Skipped)) {
                    continue;
                }
                // The checker `qcbus_rests_on` fails if a verdict below is undetermined. That file
                // is judged separately.
                if stranger || &*checker.id == "qcbus_rests_on" {
                    foreign = true;
                } else if checker.summary.contains(CONDEMNED) {
                    complete = false;
                    condemned.insert(bundle.name.clone());
                } else {
                    self.complain(name, format!("{}: {}", checker.id, checker.summary));
                }
            }
        }
        if !seen {
            let what = format!("{} is not in its result", Content::bundle(name));
            self.complain(name, what);
        }
        for bundle in condemned {
            *self.condemned.entry(bundle).or_default() += 1;
        }
        (complete, foreign)
    }

    /// Checks that the gate contains exactly the accepted files and all their dependencies, byte
    /// for byte.
    pub fn gate(&mut self, farm: &Farm, files: &Files, parts: &Files, gate: &Path) {
        let mut needed = BTreeSet::from([GATE_MARK.to_owned()]);
        for (name, content) in files {
            let published = std::fs::read(gate.join(name)).ok();
            let accepted = farm.out().join(format!("{name}.verdict.json")).exists()
                && farm.verdict_file(name)["verdict"] == Verdict::Accepted.as_str();
            match published {
                Some(bytes) if !accepted => {
                    let what = format!("{} bytes behind the gate, and not accepted", bytes.len());
                    self.complain(name, what);
                }
                Some(bytes) if bytes != content.bytes() => {
                    self.complain(name, "other bytes behind the gate");
                }
                None if accepted => self.complain(name, "accepted, and not behind the gate"),
                _ => {}
            }
            if accepted {
                needed.insert(name.clone());
                let get = |name: &str| files.get(name).or_else(|| parts.get(name));
                needed.extend(with_their_parts(content, get).into_keys());
            }
        }
        for (name, content) in parts.iter().filter(|(name, _)| needed.contains(*name)) {
            if std::fs::read(gate.join(name)).ok() != Some(content.bytes()) {
                self.complain(name, "is needed behind the gate, and does not lie there so");
            }
        }
        for path in files_below(gate) {
            let name = path.to_string_lossy().into_owned();
            if !needed.contains(&name) {
                self.complain(&name, "lies behind the gate, and nothing accepted needs it");
            }
        }
    }

    /// Checks that no result exists without a file and that no report is incomplete.
    fn nothing_else(&mut self, farm: &Farm, files: &Files) {
        for path in files_below(&farm.out()) {
            if path.starts_with(".qcbus") {
                continue;
            }
            let name = path.to_string_lossy().into_owned();
            if is_being_written(farm, &path) {
                continue;
            }
            let results = [".xqar", ".verdict.json"];
            let file = results.iter().find_map(|suffix| name.strip_suffix(suffix));
            // Reporters withdraw their reports later than the broker withdraws results.
            let report = file.is_none() && reported(&name).is_some();
            if report
                && let Ok(bytes) = std::fs::read(farm.out().join(&path))
                && let Some(why) = torn(&name, &bytes)
            {
                self.complain(&name, format!("is no whole report: {why}"));
            }
            if !report && !file.is_some_and(|file| files.contains_key(file)) {
                self.complain(&name, "lies among the results, and no file is there for it");
            }
        }
    }
}

/// Checks that a file is partial and that its writer lives. Waits for the broker to remove the
/// partial file of a dead writer.
fn is_being_written(farm: &Farm, path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let writer = name
        .strip_prefix(".qcbus-")
        .and_then(|it| it.split_once('.'));
    let Some((pid, _)) = writer else {
        return false;
    };
    let process = Path::new("/proc").join(pid);
    let is_over = || process.exists() || !farm.out().join(path).exists();
    let log = || format!("{}\n{}", path.display(), farm.log());
    until_or(
        "the remains of a dead process are removed",
        || is_over().then_some(()),
        log,
    );
    true
}

/// Returns whether the rule that the oracle expects has an issue.
fn expected_rule_fired(farm: &Farm, name: &str, checker: Option<&str>) -> bool {
    let Some(expected) = checker else {
        return true;
    };
    let results = farm.result(name);
    let mut checkers = results.bundles.iter().flat_map(|bundle| &bundle.checkers);
    checkers.any(|checker| checker.id.ends_with(expected) && !checker.issues.is_empty())
}

/// Counts the verdicts in the journal by path, digest and configuration.
pub fn verdicts_in_journal(journal: &Path) -> BTreeMap<(String, String, String), u64> {
    let connection = rusqlite::Connection::open(journal).unwrap();
    let mut query = connection
        .prepare("SELECT path, digest, config, count(*) FROM jobs GROUP BY path, digest, config")
        .unwrap();
    let rows = query.query_map([], |row| {
        let key = (row.get(0)?, row.get(1)?, row.get(2)?);
        Ok((key, u64::try_from(row.get::<_, i64>(3)?).unwrap()))
    });
    rows.unwrap().map(Result::unwrap).collect()
}

/// Returns what the present verdict on each path is based on: the digests of the file and the
/// configuration, and the bundles with their versions.
pub fn bases_in_journal(journal: &Path) -> BTreeMap<String, [String; 4]> {
    let connection = rusqlite::Connection::open(journal).unwrap();
    let mut query = connection
        .prepare("SELECT path, digest, config, required_set, inputs FROM files")
        .unwrap();
    let rows = query.query_map([], |row| {
        let basis = [row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?];
        Ok((row.get(0)?, basis))
    });
    rows.unwrap().map(Result::unwrap).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
