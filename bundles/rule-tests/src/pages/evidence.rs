//! Documents and findings of the examples of the pages, for tables and further tests.

use std::collections::{BTreeMap, BTreeSet};

use qcbus_sdk::{Bundle, Issue, Listener, Outcome, Plan, check};

use super::example::{Staged, version_of};
use super::{Example, Page, Template, Verdict};

/// A complete document of a page.
#[derive(Debug, Clone)]
pub struct Shown {
    /// The rule of the page.
    pub rule: &'static str,
    /// Expected result of the rule.
    pub verdict: Verdict,
    /// The root document, with the text of its template.
    pub text: String,
}

/// Returns every single-file example of a bundle's pages without parameters.
pub fn documents(bundle: &'static Bundle, templates: &[Template]) -> Vec<Shown> {
    let mut all = Vec::new();
    for (rule, example) in examples(bundle) {
        let Some(staged) = stage(bundle, templates, rule, &example) else {
            continue;
        };
        if let [(_, text)] = staged.files.as_slice()
            && example.params.is_empty()
        {
            let (verdict, text) = (example.verdict, text.clone());
            all.push(Shown {
                rule,
                verdict,
                text,
            });
        }
    }
    all
}

/// Returns, for each rule, the UIDs of its findings in its own bad examples.
pub fn fired(
    bundle: &'static Bundle,
    templates: &[Template],
) -> BTreeMap<&'static str, BTreeSet<String>> {
    let plan = Plan::new(bundle, |_| true, |_, _| None);
    let mut all: BTreeMap<&'static str, BTreeSet<String>> = BTreeMap::new();
    for (rule, example) in examples(bundle) {
        if example.verdict != Verdict::Bad || !example.params.is_empty() {
            continue;
        }
        // The staged files must live longer than the documents loaded from them.
        let Some(staged) = stage(bundle, templates, rule, &example) else {
            continue;
        };
        let Ok(loaded) = staged.load() else { continue };
        let Ok(subject) = loaded.subject(bundle) else {
            continue;
        };
        let mut heard = Heard {
            plan: &plan,
            rule,
            uids: BTreeSet::new(),
        };
        check(&plan, &subject, &mut heard);
        all.entry(rule).or_default().extend(heard.uids);
    }
    all
}

fn examples(bundle: &'static Bundle) -> Vec<(&'static str, Example)> {
    let pages = bundle.rules.iter().filter_map(|rule| {
        let facts = rule.facts();
        Page::parse(facts.page).ok().map(|page| (facts.id, page))
    });
    pages
        .flat_map(|(id, page)| page.examples.into_iter().map(move |example| (id, example)))
        .collect()
}

fn stage(
    bundle: &'static Bundle,
    templates: &[Template],
    rule: &str,
    example: &Example,
) -> Option<Staged> {
    let rule = bundle.rules.iter().find(|it| it.facts().id == rule)?;
    let version = version_of(bundle, *rule, example).ok()?;
    Staged::new(bundle, templates, example, version).ok()
}

/// Returns, for each UID, its checker, and whether it has a finding under this UID in its own bad
/// examples.
pub fn by_uid(
    bundle: &'static Bundle,
    templates: &[Template],
) -> BTreeMap<&'static str, (&'static str, bool)> {
    let fired = fired(bundle, templates);
    let mut all: BTreeMap<&'static str, (&'static str, bool)> = BTreeMap::new();
    for rule in bundle.rules {
        let facts = rule.facts();
        for uid in facts.uids {
            let proven = fired.get(facts.id).is_some_and(|uids| uids.contains(*uid));
            let entry = all.entry(uid).or_insert((facts.id, proven));
            if proven && !entry.1 {
                *entry = (facts.id, true);
            }
        }
    }
    all
}

/// Parses the lines of a list of rules: a UID and, after a tab, the reason why it cannot be
/// checked. Lines that begin with `#` are comments.
pub fn listed(list: &'static str) -> Vec<(&'static str, Option<&'static str>)> {
    let lines = list
        .lines()
        .filter(|line| !line.starts_with('#') && !line.is_empty());
    lines
        .map(|line| match line.split_once('\t') {
            Some((uid, why)) => (uid, Some(why)),
            None => (line, None),
        })
        .collect()
}

struct Heard<'p> {
    plan: &'p Plan,
    rule: &'p str,
    uids: BTreeSet<String>,
}

impl Listener for Heard<'_> {
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, _: Outcome) {
        if self.plan.checkers()[checker].facts.id == self.rule {
            self.uids
                .extend(issues.into_iter().map(|issue| issue.rule_uid));
        }
    }
}
