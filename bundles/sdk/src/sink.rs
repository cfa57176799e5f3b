//! Collection of the findings of a rule.

use std::collections::HashMap;

use qcbus_document::Node;
use qcbus_formats::pool::{Cause, Ending, rule_info};
use qcbus_formats::xqar::{DomainInfo, Issue, Level, Location, Metadata};

use crate::param::MAX_ISSUES;
use crate::place::{Place, Spot, copied_by, locate, locate_from, put_there};
use crate::rule::Facts;
use crate::{Param, Subject, Values, Version};

/// Start of the reason that [`Sink::leave_open`] gives.
pub const UNKNOWN_VERSION: &str = "no rule judges version";

/// Collects the findings of one checker about one subject.
///
/// ```text
/// found
///     .issue(road, format!("the road is {length} m long, but must be longer than 0 m"))
///     .at(predecessor, "the road before it")
///     .road(id, s, 0.0);
/// ```
pub struct Sink<'d> {
    subject: &'d Subject<'d>,
    facts: &'d Facts,
    values: &'d Values,
    /// Note on every issue of a rule that is not normative for the document's version.
    not_normative: Option<String>,
    kept: Vec<Kept>,
    /// Number of the part that is being checked, or the whole.
    part: u32,
    suppressed: Option<Suppressed>,
    /// Findings behind references, by the text and by the address of the document's path in memory.
    behind: HashMap<(String, usize, u32), Behind>,
    metadata: Vec<Metadata>,
    /// Ending of the rule, if it has set one itself.
    ending: Option<Ending>,
    /// Level of a repeated finding, which is dropped.
    unheard: Level,
    /// Receives the data of findings that are not listed. It is boxed, because most checkers list
    /// all findings and many sinks exist at the same time.
    scratch: Option<Box<Issue>>,
}

/// A finding that is listed.
struct Kept {
    /// Part that was being checked. Findings are made in this order.
    part: u32,
    /// Position in the document. Findings are listed in this order.
    order: (usize, u32),
    issue: Issue,
}

/// Stands for the whole document, which is checked after all parts.
pub(crate) const WHOLE: u32 = u32::MAX;

/// A finding at the target of references.
struct Behind {
    /// Its index in `cached`, if it is listed.
    kept: Option<usize>,
    /// Offset of the last reference.
    last: u32,
    /// Number of references after the first.
    more: usize,
}

/// Maximum number of further references that are shown for a finding.
const MOST_REFERENCES: usize = 3;

/// Findings beyond the limit.
struct Suppressed {
    count: u64,
    /// Worst level of all but the last finding.
    worst: Level,
    /// Level of the last finding, which its rule may still change.
    last: Level,
    first: Spot,
}

impl<'d> Sink<'d> {
    pub(crate) fn new(
        subject: &'d Subject<'d>,
        facts: &'d Facts,
        values: &'d Values,
        not_normative: Option<String>,
    ) -> Sink<'d> {
        Sink {
            subject,
            facts,
            values,
            not_normative,
            kept: Vec::new(),
            part: WHOLE,
            suppressed: None,
            behind: HashMap::new(),
            metadata: Vec::new(),
            ending: None,
            unheard: Level::Information,
            scratch: None,
        }
    }

    /// Reports a fault at a place. The text names the value that was found and the values that are
    /// allowed. Further facts can be added to the returned finding.
    pub fn issue<'p>(
        &mut self,
        at: impl Into<Place<'p>>,
        text: impl Into<String>,
    ) -> Finding<'_, 'd> {
        let (place, text) = (at.into(), text.into());
        // A fault in a library occurs in every copy of it in a modular scenario.
        let reference = copied_by(self.subject, &place);
        if reference.is_some_and(|reference| self.is_said(reference, &place, &text)) {
            return self.unheard();
        }
        self.list(&place, text)
    }

    fn list(&mut self, place: &Place<'_>, text: String) -> Finding<'_, 'd> {
        let level = match self.values.levels_of_asam {
            true => self.facts.level,
            false => self.facts.readers.map_or(self.facts.level, |it| it.level),
        };
        let level = if self.not_normative.is_some() {
            lower(level)
        } else {
            level
        };
        let full = self.kept.len() >= self.limit();
        let issue = if full {
            self.suppress(place, level);
            scratch(&mut self.scratch)
        } else {
            let (order, issue) = self.complete(place, text, level);
            let part = self.part;
            self.kept.push(Kept { part, order, issue });
            match self.kept.last_mut() {
                Some(kept) => &mut kept.issue,
                None => scratch(&mut self.scratch),
            }
        };
        let unlisted = self
            .suppressed
            .as_mut()
            .filter(|_| full)
            .map(|suppressed| &mut suppressed.last);
        let document = place.document();
        let is_root = document.content_hash() == self.subject.written().content_hash();
        Finding {
            issue,
            subject: self.subject,
            facts: self.facts,
            beside: is_root.then(|| place.offset()),
            note: self.not_normative.as_deref(),
            unlisted,
            levels_of_asam: self.values.levels_of_asam,
        }
    }

    /// Reports a fault at the target of a reference. The reference is the first place, the target
    /// the second one. If several references lead to the same fault, it is listed once with the
    /// others as further places.
    pub fn issue_behind<'p>(
        &mut self,
        reference: Node<'p>,
        at: impl Into<Place<'p>>,
        text: impl Into<String>,
    ) -> Finding<'_, 'd> {
        let (place, text) = (at.into(), text.into());
        if self.is_said(reference, &place, &text) {
            return self.unheard();
        }
        self.list(&Place::Node(reference), text)
            .at(place, "the place in the catalog")
    }

    /// Checks whether the same fault was reported at the same place for another reference. If so,
    /// adds this reference. Otherwise, records the fault as reported.
    fn is_said(&mut self, reference: Node<'_>, place: &Place<'_>, text: &str) -> bool {
        let document = place.document().path().as_ptr() as usize;
        let key = (text.to_owned(), document, place.offset());
        if let Some(known) = self.behind.get_mut(&key) {
            let is_other = known.last != reference.offset();
            known.last = reference.offset();
            known.more += usize::from(is_other);
            let shown = known
                .kept
                .filter(|_| is_other && known.more <= MOST_REFERENCES);
            if let Some(kept) = shown.and_then(|kept| self.kept.get_mut(kept)) {
                let what = "another reference to this place";
                let spot = locate(self.subject, &Place::Node(reference), Some(what));
                kept.issue.locations.push(spot.locations);
            }
            return true;
        }
        let kept = self.kept.len();
        let behind = Behind {
            kept: (kept < self.limit()).then_some(kept),
            last: reference.offset(),
            more: 0,
        };
        self.behind.insert(key, behind);
        false
    }

    /// Returns a finding for a fault that was already reported.
    fn unheard(&mut self) -> Finding<'_, 'd> {
        let issue = scratch(&mut self.scratch);
        issue.locations.clear();
        issue.domain_info.clear();
        Finding {
            issue,
            subject: self.subject,
            facts: self.facts,
            beside: None,
            note: self.not_normative.as_deref(),
            unlisted: Some(&mut self.unheard),
            levels_of_asam: self.values.levels_of_asam,
        }
    }

    /// Adds a fact about the check itself, such as the reference values that were used.
    pub fn fact(&mut self, key: &str, value: impl Into<String>, description: &str) {
        self.metadata.push(Metadata {
            key: key.to_owned(),
            value: value.into(),
            description: description.to_owned(),
        });
    }

    /// Reports that the rule could not check or did not complete. Its checker has failed,
    /// regardless of earlier findings. The text is a sentence or several lines, such as the
    /// traceback of the language of the rule.
    pub fn fail(&mut self, why: impl Into<String>) {
        self.end(Ending::Failed { reason: why.into() });
    }

    /// Reports that the version of the file is one that no rule judges. The verdict about the file
    /// stays open.
    pub fn leave_open(&mut self, version: Version) {
        self.fail(format!(
            "{UNKNOWN_VERSION} {}.{}",
            version.major, version.minor
        ));
    }

    /// Sets the ending of a rule that delegates to another program. The first call counts.
    pub fn end(&mut self, ending: Ending) {
        if ending != Ending::Completed {
            self.ending.get_or_insert(ending);
        }
    }

    /// Takes out the ending of the rule, if it has set one.
    pub(crate) fn take_ending(&mut self) -> Option<Ending> {
        self.ending.take()
    }

    /// Passes on an issue of another program unchanged. Its places are not verified. Such issues
    /// are listed in the order in which they are passed on.
    pub fn retell(&mut self, issue: Issue) {
        if self.kept.len() >= self.limit() {
            let level = issue.level;
            return self.suppress(&Place::Text(self.subject.written(), 0), level);
        }
        let part = self.part;
        let order = (0, u32::try_from(self.kept.len()).unwrap_or(u32::MAX));
        self.kept.push(Kept { part, order, issue });
    }

    /// Returns the checked documents: the root and everything that it refers to.
    pub fn subject(&self) -> &'d Subject<'d> {
        self.subject
    }

    /// Returns the version of the standard that the document names.
    pub fn version(&self) -> Option<Version> {
        self.subject.version()
    }

    /// Returns the value of a number that the rule declares.
    pub fn number(&self, param: &Param) -> f64 {
        self.values.number(param)
    }

    /// Returns the value of a flag that the rule declares.
    pub fn flag(&self, param: &Param) -> bool {
        self.values.flag(param)
    }

    /// Returns the value of a text that the rule declares.
    pub fn text(&self, param: &Param) -> String {
        self.values.text(param)
    }

    /// Returns the number of findings, listed or not.
    pub fn count(&self) -> u64 {
        self.kept.len() as u64
            + self
                .suppressed
                .as_ref()
                .map_or(0, |suppressed| suppressed.count)
    }

    /// Sets the part that is checked next: the part with this number, or the [`WHOLE`].
    pub(crate) fn turn_to(&mut self, part: u32) {
        self.part = part;
    }

    /// Merges the findings of other threads for the same checker, up to a part. The result is the
    /// same as if one thread had checked all parts in order. Returns `false` if this is not
    /// certain, because a finding is not listed or is counted.
    pub(crate) fn take_in(&mut self, others: Vec<Sink<'d>>, last: u32) -> bool {
        let plain = |sink: &Sink<'_>| {
            sink.suppressed.is_none() && sink.behind.is_empty() && sink.metadata.is_empty()
        };
        if !plain(self) || !others.iter().all(plain) {
            return false;
        }
        self.kept.extend(others.into_iter().flat_map(|it| it.kept));
        // One thread checked each part, so its findings are in order.
        self.kept.sort_by_key(|kept| kept.part);
        self.kept.retain(|kept| kept.part <= last);
        self.kept.len() <= self.limit()
    }

    /// Takes out the findings in document order, and facts about findings that are not listed.
    pub(crate) fn finish(&mut self) -> (Vec<Issue>, Vec<Metadata>) {
        let mut kept = std::mem::take(&mut self.kept);
        let mut behind: Vec<Behind> = std::mem::take(&mut self.behind).into_values().collect();
        behind.sort_unstable_by_key(|behind| behind.kept);
        for behind in behind {
            let finding = behind.kept.and_then(|at| kept.get_mut(at));
            let unsaid = behind.more.saturating_sub(MOST_REFERENCES);
            if let Some(Kept { issue, .. }) = finding.filter(|_| unsaid > 0) {
                let text = match unsaid {
                    1 => "; one more reference leads to this place".to_owned(),
                    unsaid => format!("; {unsaid} more references lead to this place"),
                };
                issue.description.push_str(&text);
            }
        }
        kept.sort_by_key(|kept| kept.order);
        let mut issues: Vec<Issue> = kept.into_iter().map(|kept| kept.issue).collect();
        let mut facts = std::mem::take(&mut self.metadata);
        let Some(suppressed) = self.suppressed.take() else {
            return (issues, facts);
        };
        let limit = self.limit();
        let count = suppressed.count;
        let text = format!(
            "{count} further findings of this checker are not listed, because it lists at most {limit} \
             (parameter `{}`)",
            MAX_ISSUES.name
        );
        // The level is the worst of them, so that a verdict cannot depend on the limit.
        let worst = suppressed.worst.min(suppressed.last);
        let mut rest = issue(text, worst, first(self.facts.uids));
        rest.locations.push(suppressed.first.locations);
        issues.push(rest);
        let metadata = Metadata {
            key: qcbus_formats::pool::NOT_LISTED.to_owned(),
            value: count.to_string(),
            description: "number of findings that this checker does not list".to_owned(),
        };
        facts.push(metadata);
        (issues, facts)
    }

    fn limit(&self) -> usize {
        // The limit is at least one, so that something is always shown. The cast saturates.
        self.values.number(&MAX_ISSUES).max(1.0) as usize
    }

    fn suppress(&mut self, place: &Place<'_>, level: Level) {
        let subject = self.subject;
        let suppressed = self.suppressed.get_or_insert_with(|| Suppressed {
            count: 0,
            worst: Level::Information,
            last: Level::Information,
            first: locate(subject, place, Some("the first finding that is not listed")),
        });
        suppressed.count += 1;
        suppressed.worst = suppressed.worst.min(suppressed.last);
        suppressed.last = level;
        let scratch = scratch(&mut self.scratch);
        scratch.locations.clear();
        scratch.domain_info.clear();
    }

    fn complete(&self, place: &Place<'_>, mut text: String, level: Level) -> ((usize, u32), Issue) {
        if let Some(note) = &self.not_normative {
            text.push_str(note);
        }
        let spot = locate(self.subject, place, None);
        let mut issue = issue(text, level, first(self.facts.uids));
        // In a modular scenario the value is fixed where it is assigned, not in the library.
        issue.locations.extend(put_there(self.subject, place));
        issue.locations.push(spot.locations);
        (spot.order, issue)
    }
}

/// One finding in the [`Sink`], which can be completed.
pub struct Finding<'s, 'd> {
    issue: &'s mut Issue,
    subject: &'d Subject<'d>,
    facts: &'s Facts,
    /// Offset of the finding, if it is in the root file as written.
    beside: Option<u32>,
    /// Note for a rule that is not normative. If it is set, levels are lowered.
    note: Option<&'s str>,
    /// Level of a finding that is only counted. `None` if it is listed.
    unlisted: Option<&'s mut Level>,
    /// Whether findings have the levels of ASAM.
    levels_of_asam: bool,
}

impl Finding<'_, '_> {
    /// Describes the place itself, instead of "element `road`".
    pub fn here(self, description: &str) -> Self {
        if let Some(locations) = self.issue.locations.first_mut() {
            description.clone_into(&mut locations.description);
        }
        self
    }

    /// Adds a further place and its description.
    pub fn at<'p>(self, place: impl Into<Place<'p>>, description: impl AsRef<str>) -> Self {
        if !self.is_listed() {
            return self;
        }
        let description = Some(description.as_ref());
        let spot = locate_from(self.subject, &place.into(), description, self.beside);
        self.issue.locations.push(spot.locations);
        self
    }

    /// Adds the point in the inertial coordinate system, in metres, to the last place.
    pub fn point(self, x: f64, y: f64, z: f64) -> Self {
        self.also(Location::Inertial { x, y, z })
    }

    /// Adds the position on a road, in metres, to the last place.
    pub fn road(self, road_id: &str, s: f64, t: f64) -> Self {
        self.also(Location::Road {
            road_id: road_id.to_owned(),
            s,
            t,
        })
    }

    /// Adds facts for which the result format has no element.
    pub fn info(self, info: DomainInfo) -> Self {
        if self.is_listed() {
            self.issue.domain_info.push(info);
        }
        self
    }

    /// Names a further rule of the standard that the same fact violates. An issue has one UID, so
    /// this one becomes a separate fact, `qcbus.rule`.
    pub fn also_violates(self, uid: &str) -> Self {
        self.info(rule_info(uid))
    }

    /// Names the fault. Findings of the bundle with the same key are about one fault: the worst of
    /// them is reported, with the places of the others.
    pub fn fault(self, key: impl Into<String>) -> Self {
        self.cause(key.into(), false)
    }

    /// Names the fault that this finding follows from. It is like [`Self::fault`], but the finding
    /// is not the first to be reported.
    pub fn follows(self, key: impl Into<String>) -> Self {
        self.cause(key.into(), true)
    }

    fn cause(self, key: String, follows: bool) -> Self {
        self.info(Cause { key, follows }.to_info())
    }

    /// Sets another severity than the rule's. It is lowered in the same way as the rule's.
    pub fn level(mut self, level: Level) -> Self {
        let level = if self.note.is_some() {
            lower(level)
        } else {
            level
        };
        self.set_level(level);
        self
    }

    /// Sets the severity by what readers do with the file. It replaces the one of the standard,
    /// unless the levels of ASAM are in force ([`crate::LEVELS`]).
    pub fn readers_level(self, level: Level) -> Self {
        match self.levels_of_asam {
            true => self,
            false => self.level(level),
        }
    }

    /// Sets the severity of a fault that is wrong in every version, even in those without the rule.
    /// It is not lowered, and the note about normative versions is removed.
    pub fn in_every_version(mut self, level: Level) -> Self {
        self.set_level(level);
        let text = self
            .note
            .and_then(|note| self.issue.description.strip_suffix(note));
        if let Some(length) = text.map(str::len) {
            self.issue.description.truncate(length);
        }
        self
    }

    fn set_level(&mut self, level: Level) {
        self.issue.level = level;
        if let Some(unlisted) = &mut self.unlisted {
            **unlisted = level;
        }
    }

    /// Sets another UID of the rule than its first.
    pub fn uid(self, uid: &str) -> Self {
        debug_assert!(
            self.facts.uids.contains(&uid),
            "{uid} is not a UID of {}",
            self.facts.id
        );
        uid.clone_into(&mut self.issue.rule_uid);
        self
    }

    fn also(self, location: Location) -> Self {
        if let Some(locations) = self.issue.locations.last_mut() {
            locations.places.push(location);
        }
        self
    }

    fn is_listed(&self) -> bool {
        self.unlisted.is_none()
    }
}

/// Returns the name of a fault of an element, for [`Finding::fault`] and [`Finding::follows`]. The
/// schema rule uses it for elements that lack something.
pub fn fault_of(node: Node<'_>) -> String {
    format!("element {} of {}", node.offset(), node.document().path())
}

/// Returns the name of a fault of an attribute, which need not be given. The schema rule uses it.
pub fn fault_of_attribute(node: Node<'_>, name: &str) -> String {
    format!("attribute {name} of {}", fault_of(node))
}

/// Returns the next lower severity. Information stays information.
fn lower(level: Level) -> Level {
    match level {
        Level::Error => Level::Warning,
        Level::Warning | Level::Information => Level::Information,
    }
}

fn first(uids: &[&'static str]) -> &'static str {
    uids.first().copied().unwrap_or("")
}

fn scratch(slot: &mut Option<Box<Issue>>) -> &mut Issue {
    slot.get_or_insert_with(|| Box::new(issue(String::new(), Level::Information, "")))
}

fn issue(description: String, level: Level, uid: &str) -> Issue {
    Issue {
        id: 0,
        description,
        level,
        rule_uid: uid.to_owned(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}
