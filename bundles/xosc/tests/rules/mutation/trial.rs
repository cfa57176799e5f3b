//! The result of an edit, compared with the expected one.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use qcbus_rule_tests::mutate::{Changed, Overlay, Said, Spots, apply, said};
use qcbus_sdk::{BACKPORT_SUFFIX, Plan};
use qcbus_xosc::BUNDLE;

use super::list::{Entry, Mutation};

pub const WORLD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rules/mutation/world");

/// A scenario without faults.
pub struct Base {
    pub name: &'static str,
    /// Prefixes of the names of rules that are on here, although they are off by default.
    with: &'static [&'static str],
}

const fn base(name: &'static str) -> Base {
    Base { name, with: &[] }
}

pub const BASES: [Base; 11] = [
    base("1.0"),
    base("1.1"),
    base("1.2"),
    base("1.3"),
    base("1.4"),
    Base {
        name: "minimal",
        with: &["minsubset_", "header_license", "expressions_unused"],
    },
    Base {
        name: "carla",
        with: &["profile_"],
    },
    base("deterministic"),
    base("stochastic"),
    base("catalogs/maneuvers/maneuvers"),
    base("catalogs/vehicles/vehicles"),
];

/// Returns the rule of a checker: its id without the prefix and without the backport suffix.
pub fn rule_of(id: &str) -> &str {
    let name = id.split_once("_xosc_").map_or(id, |(_, name)| name);
    name.strip_suffix(BACKPORT_SUFFIX).unwrap_or(name)
}

/// Result of an edit.
pub struct Trial<'e> {
    pub entry: &'e Entry,
    pub edit: &'e Mutation,
    pub said: Vec<Said>,
    spots: Spots,
    /// Reason why the edit could not be tried.
    error: Option<String>,
}

impl Trial<'_> {
    fn own(&self) -> impl Iterator<Item = &Said> {
        let own = |it: &&Said| rule_of(&it.checker) == self.entry.rule;
        self.said.iter().filter(own)
    }

    fn others(&self) -> impl Iterator<Item = &Said> {
        let other = |it: &&Said| rule_of(&it.checker) != self.entry.rule;
        self.said.iter().filter(other)
    }

    /// Returns whether the rule reports the fault at the place of the edit, as often as expected.
    pub fn is_found(&self) -> bool {
        let here = |said: &Said| {
            let spot = said.rows.first();
            spot.is_some_and(|(file, row)| self.spots.get(file).is_some_and(|it| it.has(*row)))
        };
        self.own().count() == self.edit.times && self.own().all(here)
    }

    /// Returns findings of rules that the edit does not name.
    pub fn unrelated(&self) -> impl Iterator<Item = &Said> {
        let allowed = |it: &Said| {
            let mut also = self.edit.also.iter();
            also.any(|(rule, _)| rule == rule_of(&it.checker))
        };
        self.others().filter(move |it| !allowed(it))
    }

    /// Returns the deviations from the expected result, or `None`.
    pub fn fault(&self) -> Option<String> {
        let mut what = Vec::new();
        what.extend(
            self.error
                .as_ref()
                .map(|error| format!("cannot be tried: {error}")),
        );
        if self.error.is_none() && !self.is_found() {
            what.push("is not found where it is, or not once".to_owned());
        }
        what.extend(
            self.unrelated()
                .map(|it| format!("fires as well: {}", rule_of(&it.checker))),
        );
        for (rule, _) in &self.edit.also {
            if !self.others().any(|it| rule_of(&it.checker) == rule) {
                what.push(format!("is silent: {rule}"));
            }
        }
        (!what.is_empty()).then(|| format!("{}{}", what.join("; "), self.told()))
    }

    /// Returns a full description of the trial.
    pub fn told(&self) -> String {
        let (rule, base, text) = (&self.entry.rule, &self.edit.base, &self.edit.text);
        let mut told = format!("\n  {rule} in {base}: {text}\n");
        for (file, rows) in &self.spots {
            writeln!(told, "    should be at {} {rows:?}", file.display()).unwrap();
        }
        for said in &self.said {
            writeln!(told, "    {said}").unwrap();
        }
        told
    }
}

/// Files and plans of one thread.
pub struct Bench {
    overlay: Overlay,
    /// Plans by the name of the base.
    plans: BTreeMap<&'static str, Plan>,
}

impl Default for Bench {
    fn default() -> Bench {
        let plan = |base: &Base| {
            let with = |rule: &str| base.with.iter().any(|start| rule.starts_with(start));
            Plan::new(
                &BUNDLE,
                |checker| checker.facts.default_on || with(rule_of(&checker.id)),
                |_, _| None,
            )
        };
        Bench {
            overlay: Overlay::of(Path::new(WORLD)).unwrap(),
            plans: BASES.iter().map(|base| (base.name, plan(base))).collect(),
        }
    }
}

impl Bench {
    /// Returns the findings in an unedited base.
    pub fn unedited(&mut self, base: &Base) -> Result<Vec<Said>, String> {
        let file = format!("{}.xosc", base.name);
        self.said(base.name, Path::new(&file), &Changed::new())
    }

    /// Tries an edit.
    pub fn trial<'e>(&mut self, entry: &'e Entry, edit: &'e Mutation) -> Trial<'e> {
        let mut trial = Trial {
            entry,
            edit,
            said: Vec::new(),
            spots: Spots::new(),
            error: None,
        };
        match self.outcome(edit) {
            Ok((said, spots)) => (trial.said, trial.spots) = (said, spots),
            Err(error) => trial.error = Some(error),
        }
        trial
    }

    fn outcome(&mut self, edit: &Mutation) -> Result<(Vec<Said>, Spots), String> {
        let (mut changed, mut spots) = apply(&edit.edits, &edit.at, Path::new(WORLD))?;
        if let Some(name) = &edit.name {
            let file = Path::new(&edit.base).with_added_extension("xosc");
            let rows = spots.remove(&file).ok_or("the scenario is not edited")?;
            spots.insert(name.clone(), rows);
            let content = changed.remove(&file).flatten();
            changed.insert(name.clone(), content);
        }
        let said = self.said(&edit.base, &edit.file(), &changed)?;
        Ok((said, spots))
    }

    fn said(&self, base: &str, file: &Path, changed: &Changed) -> Result<Vec<Said>, String> {
        let plan = self
            .plans
            .get(base)
            .ok_or_else(|| format!("no scenario: {base}"))?;
        let said = self.overlay.with(changed, |root| said(plan, root, file));
        said.map_err(|error| error.to_string())?
    }
}
