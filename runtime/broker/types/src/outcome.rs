//! Outcome of tasks: what a bundle reported about a job, and its conversion to a result.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_formats::pool::{Asked, BundleOutcome, CheckerOutcome, Ending, in_the_answer};
use qcbus_formats::xqar::{Issue, Metadata, Param};
use qcbus_messages::{Catalogue, CheckerInfo};

/// Outcome of one bundle's task in a job.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskOutcome {
    /// The bundle.
    pub name: String,
    /// Its version.
    pub version: String,
    /// Reason why the whole bundle failed, or `None`.
    pub failure: Option<String>,
    /// The checkers that had to run, as indexes into the catalogue.
    pub demanded: Arc<[u32]>,
    /// The answer of the bundle. See [`TaskOutcome::said`].
    pub answer: Answer,
    /// Its catalogue. `None` for a demanded bundle that was never seen.
    pub catalogue: Option<Arc<Catalogue>>,
    /// Time spent checking, in microseconds, as reported by the bundle.
    pub micros: u64,
}

/// Answer of a bundle about a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// Findings by checker.
    Said(Arc<BTreeMap<u32, Pending>>),
    /// The bundle was not asked, because it does not take files of this kind.
    OtherKind(FileKind),
}

/// Pending findings of one checker.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pending {
    /// Its findings.
    pub issues: Vec<Issue>,
    /// Number of further findings beyond the limit.
    pub withheld: u64,
    /// Bytes of its reported end within the limit of its task.
    pub done_bytes: usize,
    /// Its end, parameters and metadata.
    pub done: Option<(Ending, Vec<Param>, Vec<Metadata>)>,
}

impl TaskOutcome {
    /// Converts the answer to a result. It contains every demanded checker, and other checkers that
    /// blocked one of them.
    pub fn said(&self) -> BundleOutcome {
        let mut demanded = self.demanded.to_vec();
        demanded.sort_unstable();
        demanded.dedup();
        let checkers = match &self.answer {
            Answer::Said(pending) => self.of_pending(pending, &demanded),
            Answer::OtherKind(kind) => self.of_other_kind(*kind, &demanded),
        };
        let mut said = bundle(self, &demanded, checkers);
        if self.catalogue.is_none() {
            let name = &self.name;
            let why = self.failure.clone();
            said.absent = Some(why.unwrap_or_else(|| format!("{name} has never joined")));
        }
        said
    }

    fn of_pending(
        &self,
        pending: &BTreeMap<u32, Pending>,
        demanded: &[u32],
    ) -> Vec<CheckerOutcome> {
        let failure = self.failure.as_deref();
        // The findings of a failed bundle do not count.
        let pending_of = |index| pending.get(&index).filter(|_| failure.is_none());
        let is_demanded = |index: &u32| demanded.binary_search(index).is_ok();
        let told = pending.iter().filter(|(_, pending)| pending.done.is_some());
        let told = told.map(|(checker, _)| *checker);
        let mut besides: Vec<u32> = told.filter(|index| !is_demanded(index)).collect();
        if failure.is_some() {
            besides.clear();
        }
        let mut all = [demanded, &besides].concat();
        all.sort_unstable();
        let catalogue = self.catalogue.as_deref();
        let mut asked = BTreeSet::new();
        let mut checkers = Vec::with_capacity(all.len());
        for index in all {
            let Some(offered) = offered(catalogue, index) else {
                continue;
            };
            if !besides.is_empty() && is_demanded(&index) {
                asked.insert(&*offered.id);
            }
            checkers.push(said(offered, pending_of(index), failure));
        }
        if !besides.is_empty() {
            let mut kept = in_the_answer(&checkers, |id| asked.contains(id)).into_iter();
            checkers.retain(|_| kept.next().unwrap_or(true));
        }
        checkers
    }

    fn of_other_kind(&self, kind: FileKind, demanded: &[u32]) -> Vec<CheckerOutcome> {
        let catalogue = self.catalogue.as_deref();
        let offered = demanded
            .iter()
            .filter_map(|index| offered(catalogue, *index));
        let checkers = offered.map(|offered| CheckerOutcome {
            ending: Some(Ending::NotApplicable {
                reason: format!("{} does not check .{} files", self.name, kind.as_str()),
            }),
            ..described(offered)
        });
        checkers.collect()
    }
}

fn offered(catalogue: Option<&Catalogue>, index: u32) -> Option<&CheckerInfo> {
    catalogue?.checkers.get(usize::try_from(index).ok()?)
}

fn described(offered: &CheckerInfo) -> CheckerOutcome {
    CheckerOutcome {
        id: offered.id.clone(),
        description: offered.description.clone(),
        rule_uids: offered.rule_uids.clone(),
        ..CheckerOutcome::default()
    }
}

fn bundle(task: &TaskOutcome, demanded: &[u32], checkers: Vec<CheckerOutcome>) -> BundleOutcome {
    let catalogue = task.catalogue.as_deref();
    BundleOutcome {
        name: task.name.clone(),
        alias: catalogue.map_or_else(String::new, |it| it.alias.clone()),
        version: task.version.clone(),
        build_date: catalogue.map_or_else(String::new, |it| it.build_date.clone()),
        description: catalogue.map_or_else(String::new, |it| it.description.clone()),
        params: Vec::new(),
        checkers,
        absent: None,
        asked: catalogue.map(|it| Asked {
            asked: demanded.len(),
            offered: in_question(it, demanded),
        }),
    }
}

/// Counts the checkers that can be requested. A checker that is off by default counts only if it is demanded.
fn in_question(catalogue: &Catalogue, demanded: &[u32]) -> usize {
    let is_demanded = |index: &u32| demanded.binary_search(index).is_ok();
    let checkers = (0..).zip(&catalogue.checkers);
    let counted = checkers.filter(|(index, it)| it.default_on || is_demanded(index));
    counted.count()
}

/// Returns the outcome of one checker, or the reason why it has none.
fn said(offered: &CheckerInfo, pending: Option<&Pending>, failure: Option<&str>) -> CheckerOutcome {
    let done = pending.and_then(|pending| pending.done.clone());
    let (mut ending, params, metadata) = done.unwrap_or_else(|| {
        let silent = "the bundle reported that it was done but sent no result for this checker";
        let reason = failure.unwrap_or(silent).to_owned();
        (Ending::Failed { reason }, Vec::new(), Vec::new())
    });
    let (kept, withheld) = pending.map_or((0, 0), |it| (it.issues.len(), it.withheld));
    if withheld > 0 {
        ending = Ending::Failed {
            reason: format!(
                "more findings than one checker may report: {kept} are kept, {withheld} were dropped"
            ),
        };
    }
    CheckerOutcome {
        // Findings are kept regardless of the reported end. Pooling reports a failure if a checker
        // has findings but did not run.
        issues: pending.map_or_else(Vec::new, |pending| pending.issues.clone()),
        ending: Some(ending),
        params,
        metadata,
        ..described(offered)
    }
}
