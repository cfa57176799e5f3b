//! Findings of one fault: one of them stands for all, and the others become places of it.

use std::collections::{BTreeMap, HashMap};

use super::checker::UNNAMED;
use crate::pool::{ALSO, ALSO_HERE, CAUSE_INFO, Cause, RULE_INFO, rule_info};
use crate::xqar::{Checker, Issue, Level, Location, Locations};

/// Number of a checker in its bundle, and of an issue in it.
type Number = (usize, usize);

/// Joins the findings of a bundle that are about one fault. The worst of them stays an issue, so
/// that a verdict cannot depend on it. The others are appended to its places.
///
/// Findings are about one fault if they name the same cause. Those of the standard's rules also are
/// if they are about the same attribute, or if a checker says the same words of several places.
pub(super) fn join(checkers: &mut [Checker]) {
    let groups = groups(checkers);
    if groups.is_empty() {
        return;
    }
    let mut joined = Vec::new();
    for members in groups {
        let main = members.iter().copied().min_by_key(|at| rank(checkers, *at));
        if let Some(main) = main {
            let others: Vec<Number> = members.into_iter().filter(|at| *at != main).collect();
            append(checkers, main, &others);
            joined.extend(others);
        }
    }
    remove(checkers, joined);
}

/// Removes the causes from all findings. They are data for pooling and not for people.
pub(super) fn forget_causes(checkers: &mut [Checker]) {
    for issue in checkers.iter_mut().flat_map(|it| &mut it.issues) {
        issue.domain_info.retain(|info| info.name != CAUSE_INFO);
    }
}

/// Returns the groups of several findings with one fault, each in the order of the result.
fn groups(checkers: &[Checker]) -> Vec<Vec<Number>> {
    let mut sets = Sets::default();
    let mut members: Vec<(Number, usize)> = Vec::new();
    let mut set_of: HashMap<String, usize> = HashMap::new();
    for (checker, it) in checkers.iter().enumerate() {
        for (number, issue) in it.issues.iter().enumerate() {
            let own = sets.add();
            members.push(((checker, number), own));
            for key in keys(&it.id, issue) {
                let other = *set_of.entry(key).or_insert(own);
                sets.unite(own, other);
            }
        }
    }
    let mut groups: BTreeMap<usize, Vec<Number>> = BTreeMap::new();
    for (at, set) in members {
        groups.entry(sets.root(set)).or_default().push(at);
    }
    groups.retain(|_, members| members.len() > 1);
    groups.into_values().collect()
}

/// Returns the keys of an issue: its causes, and for rules of the standard its attribute and its
/// words. A user's own rule reports as many issues as its author wants, unless it names causes.
fn keys(checker: &str, issue: &Issue) -> impl Iterator<Item = String> {
    let causes = Cause::of(issue).map(|cause| format!("cause {}", cause.key));
    let of_standard = is_of_standard(&issue.rule_uid);
    let attribute = attribute_of(issue).filter(|_| of_standard);
    let attribute = attribute.map(|(path, xpath)| format!("attribute {path} {xpath}"));
    let words = of_standard.then(|| format!("words {checker} {}", issue.description));
    causes.chain(attribute).chain(words)
}

/// Checks whether a rule belongs to the standard or comes with qcbus.
fn is_of_standard(uid: &str) -> bool {
    let known = uid.starts_with("asam.net:") || uid.starts_with("qcbus.dev:");
    known && uid != UNNAMED
}

/// Returns the file and the XPath of the attribute that an issue is about.
fn attribute_of(issue: &Issue) -> Option<(&str, &str)> {
    let first = issue.locations.first()?;
    let found = match &first.elsewhere {
        Some(place) => (place.path.as_str(), place.xpath.as_deref()?),
        None => ("", xpath_of(first)?),
    };
    names_attribute(found.1).then_some(found)
}

fn xpath_of(place: &Locations) -> Option<&str> {
    place.places.iter().find_map(|it| match it {
        Location::Xml { xpath } => Some(xpath.as_str()),
        _ => None,
    })
}

/// Checks whether the last step of an XPath is an attribute.
fn names_attribute(xpath: &str) -> bool {
    xpath
        .rsplit_once("/@")
        .is_some_and(|(_, name)| !name.contains(['/', ']']))
}

/// Order in which findings stand for others: first the worst, then those that do not follow from
/// another, then the first.
fn rank(checkers: &[Checker], (checker, number): Number) -> (Level, bool, Number) {
    let issue = &checkers[checker].issues[number];
    let follows = Cause::of(issue).any(|cause| cause.follows);
    (issue.level, follows, (checker, number))
}

/// Appends the places and rules of other findings to the finding that stands for them.
fn append(checkers: &mut [Checker], main: Number, others: &[Number]) {
    let of = |(checker, number): Number| &checkers[checker].issues[number];
    let mut known = further_rules(of(main));
    known.push(of(main).rule_uid.clone());
    let mut places = Vec::new();
    let mut rules = Vec::new();
    for &other in others {
        let uid = &of(other).rule_uid;
        if !known.contains(uid) {
            known.push(uid.clone());
            rules.push(rule_info(uid));
        }
        let is_same = of(other).description == of(main).description;
        places.push(as_place(of(other), is_same));
    }
    let issue = &mut checkers[main.0].issues[main.1];
    issue.locations.extend(places);
    issue.domain_info.extend(rules);
}

/// Returns the UIDs of further rules that an issue names.
fn further_rules(issue: &Issue) -> Vec<String> {
    let infos = issue.domain_info.iter().filter(|it| it.name == RULE_INFO);
    let values = infos
        .flat_map(|it| &it.content)
        .flat_map(|it| &it.attributes);
    values.map(|(_, uid)| uid.clone()).collect()
}

/// Returns the place of a finding that another one stands for. It has the text of the finding,
/// unless that is the same.
fn as_place(issue: &Issue, is_same: bool) -> Locations {
    let name = issue.rule_uid.rsplit(':').next().unwrap_or_default();
    let description = match is_same {
        true => ALSO_HERE.to_owned(),
        false => format!("{ALSO}{} [{name}]", issue.description.trim()),
    };
    Locations {
        description,
        ..issue.locations.first().cloned().unwrap_or_default()
    }
}

/// Removes the findings that others stand for, and says so in the summaries of their checkers.
fn remove(checkers: &mut [Checker], joined: Vec<Number>) {
    let mut by_checker: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (checker, number) in joined {
        by_checker.entry(checker).or_default().push(number);
    }
    for (at, mut numbers) in by_checker {
        numbers.sort_unstable();
        let checker = &mut checkers[at];
        let mut number = 0;
        checker.issues.retain(|_| {
            number += 1;
            numbers.binary_search(&(number - 1)).is_err()
        });
        let others = match numbers.len() {
            1 => "1 of them is a place of another issue".to_owned(),
            count => format!("{count} of them are places of other issues"),
        };
        checker.summary = format!("{} {others}.", checker.summary).into();
    }
}

/// Disjoint sets.
#[derive(Default)]
struct Sets {
    parents: Vec<usize>,
}

impl Sets {
    fn add(&mut self) -> usize {
        self.parents.push(self.parents.len());
        self.parents.len() - 1
    }

    fn root(&mut self, mut set: usize) -> usize {
        while self.parents[set] != set {
            self.parents[set] = self.parents[self.parents[set]];
            set = self.parents[set];
        }
        set
    }

    fn unite(&mut self, one: usize, other: usize) {
        let (one, other) = (self.root(one), self.root(other));
        // The earlier one stays the root, so that the order of findings decides.
        let (first, second) = (one.min(other), one.max(other));
        self.parents[second] = first;
    }
}
