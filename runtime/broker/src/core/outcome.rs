//! Outcome of tasks: measures what a bundle reported about a job, limits its size and converts it to a result.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_formats::pool::{Asked, BundleOutcome, CheckerOutcome, Ending, in_the_answer};
use qcbus_formats::xqar::{DomainInfo, InfoElement, Issue, Location, Locations, Metadata, Param};
use qcbus_messages::{Catalogue, CheckerInfo};

use super::jobs::{Task, TaskState};
use super::pending_findings::Pending;

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

/// Returns the outcome of one task. The code that stores it converts it to a result, outside the loop.
pub(super) fn outcome(name: &str, task: &Task) -> TaskOutcome {
    TaskOutcome {
        name: name.to_owned(),
        version: task.version.clone(),
        failure: match &task.state {
            TaskState::Failed(why) => Some(why.clone()),
            _ => None,
        },
        demanded: task.demanded.clone(),
        answer: Answer::Said(task.pending.clone()),
        catalogue: task.catalogue.clone(),
        micros: task.micros,
    }
}

/// Returns the outcome of a bundle that does not take files of this kind. Each demanded checker is
/// reported as not applicable.
pub(super) fn not_applicable(
    name: &str,
    version: &str,
    catalogue: &Arc<Catalogue>,
    demanded: Vec<u32>,
    kind: FileKind,
) -> TaskOutcome {
    TaskOutcome {
        name: name.to_owned(),
        version: version.to_owned(),
        failure: None,
        demanded: demanded.into(),
        answer: Answer::OtherKind(kind),
        catalogue: Some(catalogue.clone()),
        micros: 0,
    }
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

/// Estimates the memory that an issue occupies.
pub(crate) fn weight(issue: &Issue) -> usize {
    let place = |place: &Location| match place {
        Location::Xml { xpath } => 64 + xpath.len(),
        Location::Road { road_id, .. } => 64 + road_id.len(),
        Location::Message { channel, field, .. } => {
            let length = |it: &Option<String>| it.as_ref().map_or(0, String::len);
            64 + length(channel) + length(field)
        }
        _ => 64,
    };
    let places = |it: &Locations| {
        let elsewhere = it.elsewhere.as_ref();
        let xpath = elsewhere
            .and_then(|it| it.xpath.as_ref())
            .map_or(0, String::len);
        let elsewhere = elsewhere.map_or(0, |it| it.path.len()) + xpath;
        64 + it.description.len() + elsewhere + it.places.iter().map(place).sum::<usize>()
    };
    let infos = |it: &DomainInfo| it.name.len() + it.content.iter().map(info_weight).sum::<usize>();
    256 + issue.description.len()
        + issue.rule_uid.len()
        + issue.locations.iter().map(places).sum::<usize>()
        + issue.domain_info.iter().map(infos).sum::<usize>()
}

/// Estimates the memory of the parameters and metadata of a checker's run.
pub(crate) fn facts_weight(params: &[Param], metadata: &[Metadata]) -> usize {
    let params = params.iter().map(|it| 48 + it.name.len() + it.value.len());
    let metadata = metadata
        .iter()
        .map(|it| 72 + it.key.len() + it.value.len() + it.description.len());
    params.sum::<usize>() + metadata.sum::<usize>()
}

fn info_weight(element: &InfoElement) -> usize {
    let attributes = element
        .attributes
        .iter()
        .map(|(name, value)| 48 + name.len() + value.len());
    let children = element.children.iter().map(info_weight);
    96 + element.name.len()
        + element.text.len()
        + attributes.sum::<usize>()
        + children.sum::<usize>()
}

/// Cuts an issue down to the permitted size.
pub(super) fn clip(issue: &mut Issue, max: usize) {
    clip_text(&mut issue.description, max);
    clip_text(&mut issue.rule_uid, 512);
    clip_list(&mut issue.locations, 64);
    clip_list(&mut issue.domain_info, 16);
    for place in &mut issue.locations {
        clip_text(&mut place.description, max);
        clip_list(&mut place.places, 16);
        if let Some(elsewhere) = &mut place.elsewhere {
            clip_text(&mut elsewhere.path, max);
            elsewhere
                .xpath
                .iter_mut()
                .for_each(|xpath| clip_text(xpath, max));
        }
    }
}

/// Truncates a list and frees the memory of the rest.
fn clip_list<T>(list: &mut Vec<T>, max: usize) {
    if list.len() > max {
        list.truncate(max);
        list.shrink_to_fit();
    }
}

/// Truncates a text at a character boundary and frees the memory of the rest.
pub(super) fn clip_text(text: &mut String, max: usize) {
    if text.len() > max {
        let end = (0..=max)
            .rev()
            .find(|at| text.is_char_boundary(*at))
            .unwrap_or(0);
        text.truncate(end);
        text.push('…');
        // Truncation alone would keep the whole memory.
        text.shrink_to_fit();
    }
}

#[cfg(test)]
#[path = "outcome_tests.rs"]
mod tests;
