//! Test of a bundle's pages.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use qcbus_sdk::{AnyRule, Bundle, Checker, Issue, Listener, Outcome, Plan, Status, Version, check};

use super::bless::blessed;
use super::example::{Staged, Verdict, version_of};
use super::render::render;
use super::{Example, Page, Template};
use crate::leaves_open;

/// Fails the running test if [`check_pages`] returns complaints.
///
/// ```text
/// #[test]
/// fn pages_keep_their_word() {
///     qcbus_rule_tests::pages::assert_pages(&BUNDLE, &[], concat!(env!("CARGO_MANIFEST_DIR"), "/src/rules"));
/// }
/// ```
///
/// # Panics
/// Panics with all complaints.
#[expect(clippy::panic, reason = "it is an assertion for tests")]
pub fn assert_pages(bundle: &'static Bundle, templates: &[Template], rules_dir: &str) {
    let complaints = check_pages(bundle, templates, Path::new(rules_dir));
    if !complaints.is_empty() {
        panic!(
            "{} complaints about the pages of {} (QCBUS_BLESS=1 writes the findings of the rules into their \
             pages; review the difference):\n\n{}",
            complaints.len(),
            bundle.name,
            complaints.join("\n\n")
        );
    }
}

/// Compares a bundle's rules, their files and their pages, and runs every example. Short examples
/// are inserted into `templates`. Without templates, every example must be a whole document.
///
/// If `QCBUS_BLESS` is set, the `issues` blocks are rewritten. With `QCBUS_PAGE=NAME`, only the
/// examples of pages with NAME in their file name run.
pub fn check_pages(
    bundle: &'static Bundle,
    templates: &[Template],
    rules_dir: &Path,
) -> Vec<String> {
    let mut complaints = of_the_list(bundle);
    let files = match rule_files(rules_dir) {
        Ok(files) => files,
        Err(error) => return vec![format!("cannot list {}: {error}", rules_dir.display())],
    };
    let pages = pages_of_rules(bundle, &files, &mut complaints);
    let plan = Plan::new(bundle, |_| true, |_, _| None);
    let wanted = std::env::var("QCBUS_PAGE").unwrap_or_default();
    for (path, rule) in pages {
        if path.to_string_lossy().contains(&wanted) {
            let page = PageTest {
                bundle,
                templates,
                plan: &plan,
                path: &path,
                rule,
            };
            complaints.extend(page.run());
        }
    }
    complaints
}

/// Checks the ids, UIDs, ranges and preconditions of the list of rules.
fn of_the_list(bundle: &'static Bundle) -> Vec<String> {
    let mut complaints = Vec::new();
    let plan = Plan::by_default(bundle);
    let rank = |index: usize| plan.order().position(|other| other == index);
    let mut seen = BTreeSet::new();
    for (index, checker) in plan.checkers().iter().enumerate() {
        let id = &checker.id;
        if !seen.insert(id.as_str()) || id.is_empty() {
            complaints.push(format!("`{id}`: the id is empty or already used"));
        }
        if checker.facts.uids.is_empty() || !checker.facts.uids.iter().all(|uid| is_uid(uid)) {
            complaints.push(format!(
                "`{id}`: a UID is missing or not of the form entity:standard:x.y.z:set.name"
            ));
        }
        complaints.extend(
            checker
                .range
                .as_ref()
                .err()
                .map(|error| format!("`{id}`: {error}")),
        );
        match plan.preconditions(index) {
            Err(error) => complaints.push(format!("`{id}`: {error}")),
            // This check of the order also excludes cycles.
            Ok(after) => complaints.extend(
                after
                    .iter()
                    .filter(|&&other| rank(other) >= rank(index))
                    .map(|&other| {
                        format!(
                            "`{id}`: its precondition `{}` does not run before it",
                            plan.checkers()[other].id
                        )
                    }),
            ),
        }
    }
    complaints
}

/// Checks the form `entity:standard:x.y.z:set.name`.
fn is_uid(uid: &str) -> bool {
    let parts: Vec<&str> = uid.split(':').collect();
    let plain = |text: &str| !text.is_empty() && !text.contains(char::is_whitespace);
    matches!(parts.as_slice(), [entity, standard, version, name]
        if plain(entity) && plain(standard) && version.parse::<Version>().is_ok() && plain(name))
}

/// Returns every file below the directory except `mod.rs`: the rules and their pages.
fn rule_files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(rule_files(&path)?);
        } else if path.file_name().is_some_and(|name| name != "mod.rs") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Pairs pages with rules: each `NAME.rs` has a `NAME.md`. It is the page of one listed rule with
/// an id that ends in NAME.
fn pages_of_rules(
    bundle: &'static Bundle,
    files: &[PathBuf],
    complaints: &mut Vec<String>,
) -> Vec<(PathBuf, &'static dyn AnyRule)> {
    let mut sides: BTreeMap<PathBuf, [bool; 2]> = BTreeMap::new();
    for file in files {
        let side = usize::from(file.extension().is_some_and(|extension| extension == "md"));
        sides.entry(file.with_extension("")).or_default()[side] = true;
    }
    let mut open: Vec<&'static dyn AnyRule> = bundle.rules.to_vec();
    let mut pairs = Vec::new();
    for (stem, [code, page]) in sides {
        let name = stem
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let path = stem.with_extension("md");
        if !(code && page) {
            complaints.push(format!(
                "{}: has {}",
                stem.display(),
                if code { "no page" } else { "no rule" }
            ));
            continue;
        }
        match open
            .iter()
            .position(|rule| id_names(rule.facts().id, &name))
        {
            Some(index) => pairs.push((path, open.remove(index))),
            None => complaints.push(format!(
                "{}: no listed rule has an id that ends in `{name}`; add it to `mod.rs`, twice",
                path.display()
            )),
        }
    }
    complaints.extend(
        open.iter()
            .map(|rule| format!("`{}`: no file has a matching name", rule.facts().id)),
    );
    pairs
}

fn id_names(id: &str, name: &str) -> bool {
    id.strip_suffix(name)
        .is_some_and(|rest| rest.is_empty() || rest.ends_with('_'))
}

struct PageTest<'t> {
    bundle: &'static Bundle,
    templates: &'t [Template],
    plan: &'t Plan,
    path: &'t Path,
    rule: &'static dyn AnyRule,
}

impl PageTest<'_> {
    fn run(&self) -> Vec<String> {
        let at = |line: usize| format!("{}:{line}", self.path.display());
        let text = match std::fs::read_to_string(self.path) {
            Ok(text) => text,
            Err(error) => return vec![format!("{}: {error}", at(1))],
        };
        let page = match Page::parse(&text) {
            Ok(page) => page,
            Err(error) => return vec![format!("{}: {}", at(error.line), error.what)],
        };
        let mut complaints = Vec::new();
        let mut found = Vec::new();
        for example in &page.examples {
            match self.example(example) {
                Ok(issues) => found.push((example, issues)),
                Err(what) => complaints.push(format!("{}: {what}", at(example.line))),
            }
        }
        complaints.extend(
            self.coverage(&page)
                .into_iter()
                .map(|what| format!("{}: {what}", at(1))),
        );
        if bless() {
            let blessed = blessed(&text, &found);
            if blessed != text
                && let Err(error) = std::fs::write(self.path, blessed)
            {
                complaints.push(format!("{}: {error}", at(1)));
            }
            return complaints;
        }
        if text != self.rule.facts().page {
            complaints.push(format!(
                "{}: is not the page that `{}` includes",
                at(1),
                self.rule.facts().id
            ));
        }
        let differing = found.iter().filter(|(example, issues)| {
            example.verdict == Verdict::Bad && example.expected.as_ref() != Some(issues)
        });
        complaints.extend(differing.map(|(example, issues)| {
            let expected = example.expected.as_deref().unwrap_or("");
            format!(
                "{}: expected\n{expected}but found\n{issues}",
                at(example.line)
            )
        }));
        complaints
    }

    fn coverage(&self, page: &Page) -> Vec<String> {
        let has = |verdict| {
            page.examples
                .iter()
                .any(|example| example.verdict == verdict)
        };
        let mut complaints = Vec::new();
        for (verdict, name) in [(Verdict::Good, "good"), (Verdict::Bad, "bad")] {
            if !has(verdict) {
                complaints.push(format!("a page needs at least one `xml {name}` example"));
            }
        }
        let uses = |name: &str| {
            page.examples
                .iter()
                .any(|e| e.params.iter().any(|(used, _)| used == name))
        };
        let known = |name: &str| {
            self.rule
                .facts()
                .params
                .iter()
                .any(|param| param.name == name)
        };
        let set = page.examples.iter().flat_map(|example| &example.params);
        complaints.extend(
            set.filter(|(name, _)| !known(name))
                .map(|(name, _)| format!("`{name}` is not a parameter of the rule")),
        );
        for param in self.rule.facts().params {
            if !uses(param.name)
                && !self
                    .rule
                    .facts()
                    .page
                    .contains(&format!("`{}`", param.name))
            {
                complaints.push(format!(
                    "the page does not mention the parameter `{}`",
                    param.name
                ));
            }
        }
        complaints
    }

    /// Returns the findings of the rule, or an error if the example does not behave as marked.
    fn example(&self, example: &Example) -> Result<String, String> {
        let version = version_of(self.bundle, self.rule, example)?;
        let staged = Staged::new(self.bundle, self.templates, example, version)?;
        let loaded = staged.load().map_err(|error| error.to_string())?;
        let subject = loaded
            .subject(self.bundle)
            .map_err(|error| error.to_string())?;
        let mut all = Endings::default();
        let own = (!example.params.is_empty()).then(|| self.plan_with(example));
        check(own.as_ref().unwrap_or(self.plan), &subject, &mut all);
        all.complain_about_errors(self.plan.checkers())?;
        let mine = |index: &usize| self.plan.checkers()[*index].facts.id == self.rule.facts().id;
        let (mut issues, mut ran, mut reasons) = (Vec::new(), false, Vec::new());
        for (_, found, outcome) in all.ended.into_iter().filter(|(index, ..)| mine(index)) {
            ran |= outcome.ending.status() == Status::Completed
                || leaves_open(outcome.ending.reason());
            reasons.push(outcome.ending.reason().to_owned());
            issues.extend(found);
        }
        self.judge(example, &issues, ran, &reasons)?;
        let uid = self.rule.facts().uids.first().copied().unwrap_or("");
        Ok(render(&issues, uid, &staged))
    }

    fn judge(
        &self,
        example: &Example,
        issues: &[Issue],
        ran: bool,
        reasons: &[String],
    ) -> Result<(), String> {
        let uids = self.rule.facts().uids;
        if let Some(issue) = issues
            .iter()
            .find(|issue| !uids.contains(&issue.rule_uid.as_str()))
        {
            return Err(format!(
                "an issue has the UID `{}`, which is not a UID of the rule",
                issue.rule_uid
            ));
        }
        if issues
            .iter()
            .any(|issue| issue.description.trim().is_empty() || issue.locations.is_empty())
        {
            return Err("an issue has no text or no place".to_owned());
        }
        let texts = || {
            issues
                .iter()
                .map(|issue| format!("\n  {}", issue.description))
                .collect::<String>()
        };
        match (example.verdict, ran, issues.is_empty()) {
            (Verdict::Skipped, true, _) => Err("the rule should be skipped, but ran".to_owned()),
            (Verdict::Good | Verdict::Bad, false, _) => {
                Err(format!("the rule did not run: {}", reasons.join("; ")))
            }
            (Verdict::Good, _, false) => Err(format!(
                "the rule should find nothing, but found{}",
                texts()
            )),
            (Verdict::Bad, _, true) => {
                Err("the rule should find something, but found nothing".to_owned())
            }
            _ => Ok(()),
        }
    }

    fn plan_with(&self, example: &Example) -> Plan {
        let set = |checker: &Checker, name: &str| {
            let mut params = example
                .params
                .iter()
                .filter(|_| checker.facts.id == self.rule.facts().id);
            params
                .find(|(known, _)| known == name)
                .map(|(_, value)| value.clone())
        };
        Plan::new(self.bundle, |_| true, set)
    }
}

fn bless() -> bool {
    std::env::var_os("QCBUS_BLESS").is_some_and(|value| !value.is_empty() && value != "0")
}

#[derive(Default)]
struct Endings {
    ended: Vec<(usize, Vec<Issue>, Outcome)>,
}

impl Endings {
    /// Fails if any checker ends with an error. A page is also a test for every other rule.
    fn complain_about_errors(&self, checkers: &[Checker]) -> Result<(), String> {
        let mut failed = self
            .ended
            .iter()
            .filter(|(_, _, outcome)| outcome.ending.status() == Status::Error)
            .filter(|(_, _, outcome)| !leaves_open(outcome.ending.reason()));
        failed.next().map_or(Ok(()), |(index, _, outcome)| {
            Err(format!(
                "`{}` fails on the example: {}",
                checkers[*index].id,
                outcome.ending.reason()
            ))
        })
    }
}

impl Listener for Endings {
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome) {
        self.ended.push((checker, issues, outcome));
    }
}
