//! Selection of the entries that become annotations.

use std::collections::BTreeMap;

use qcbus_formats::xqar::Level;

use crate::{Entry, MOST_ANNOTATIONS};

/// The annotated entries and the counts for each level.
pub(crate) struct Chosen<'e> {
    /// Annotated entries, the most severe first.
    pub(crate) chosen: Vec<&'e Entry>,
    /// For each level: number of annotated entries and total number of entries.
    counts: BTreeMap<Level, (usize, usize)>,
}

impl<'e> Chosen<'e> {
    /// Selects as many entries of each level as the host accepts.
    pub(crate) fn of(entries: &[&'e Entry]) -> Chosen<'e> {
        let mut levels: BTreeMap<Level, Vec<&Entry>> = BTreeMap::new();
        for entry in entries {
            levels.entry(entry.level).or_default().push(entry);
        }
        let is_cut = levels.values().any(|all| all.len() > MOST_ANNOTATIONS);
        let mut choice = Chosen {
            chosen: Vec::new(),
            counts: BTreeMap::new(),
        };
        for (level, all) in levels {
            // The line that reports the cut is a notice too, so one slot of this level is reserved
            // for it.
            let taken = usize::from(is_cut && level == Level::Information);
            let chosen = spread(&all, MOST_ANNOTATIONS - taken);
            choice.counts.insert(level, (chosen.len(), all.len()));
            choice.chosen.extend(chosen);
        }
        choice
    }

    /// Returns a sentence about the entries that were cut, or `None` if none were cut.
    pub(crate) fn cut(&self) -> Option<String> {
        let cut = |(chosen, all): &(usize, usize)| chosen < all;
        let is_cut = self.counts.values().any(cut);
        let part = |(level, (chosen, all)): (&Level, &(usize, usize))| {
            let plural = match level {
                Level::Error => "errors",
                Level::Warning => "warnings",
                Level::Information => "information",
            };
            format!("{chosen} of {all} {plural}")
        };
        let parts: Vec<String> = self.counts.iter().map(part).collect();
        is_cut.then(|| {
            format!(
                "{} are annotated: GitHub accepts no more from one step. The log of the step contains all of \
                 them.",
                parts.join(", ")
            )
        })
    }
}

/// Selects at most `most` entries from as many files and rules as possible. The next entry is
/// always the first one of the file and rule that have been selected least.
fn spread<'e>(entries: &[&'e Entry], most: usize) -> Vec<&'e Entry> {
    if entries.len() <= most {
        return entries.to_vec();
    }
    let mut left = entries.to_vec();
    let mut files: BTreeMap<&str, usize> = BTreeMap::new();
    let mut rules: BTreeMap<&str, usize> = BTreeMap::new();
    let mut chosen = Vec::new();
    while chosen.len() < most {
        let taken = |entry: &&Entry| {
            let file = files.get(entry.path.as_str()).unwrap_or(&0);
            let rule = rules.get(entry.rule.as_str()).unwrap_or(&0);
            file + rule
        };
        let positions = left.iter().enumerate();
        let next = positions.min_by_key(|(_, entry)| taken(entry));
        let Some(position) = next.map(|(position, _)| position) else {
            break;
        };
        let entry = left.remove(position);
        *files.entry(&entry.path).or_default() += 1;
        *rules.entry(&entry.rule).or_default() += 1;
        chosen.push(entry);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(path: &str, rule: &str, row: u64) -> Entry {
        Entry {
            level: Level::Error,
            path: path.into(),
            row: Some(row),
            column: None,
            text: "x".into(),
            rule: rule.into(),
        }
    }

    #[test]
    fn rare_rules_and_files_get_annotations() {
        let mut all: Vec<Entry> = (0..500).map(|row| entry("a", "often", row)).collect();
        all.push(entry("a", "rare", 1));
        all.push(entry("b", "often", 1));
        let all: Vec<&Entry> = all.iter().collect();
        let chosen = spread(&all, 4);
        let names: Vec<_> = chosen
            .iter()
            .map(|it| (&*it.path, &*it.rule, it.row))
            .collect();
        let expected = [
            ("a", "often", Some(0)),
            ("a", "rare", Some(1)),
            ("b", "often", Some(1)),
            ("a", "often", Some(1)),
        ];
        assert_eq!(names, expected);
    }

    #[test]
    fn entries_within_limit_are_all_chosen() {
        let all: Vec<Entry> = (0..10).map(|row| entry("a", "often", row)).collect();
        let all: Vec<&Entry> = all.iter().collect();
        let choice = Chosen::of(&all);
        assert_eq!(choice.chosen, all);
        assert_eq!(choice.cut(), None);
    }
}
