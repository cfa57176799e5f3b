//! Parser of the lists of faults and of harmless variants. `bundles/xosc/tests/rules/seeded/README.md`
//! describes their format.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::mutate::{Edit, Target, beside};
use qcbus_sdk::Level;

/// A real file and its edits.
#[derive(Debug)]
pub struct Entry {
    pub id: String,
    pub category: String,
    pub original: Original,
    /// Minimum level of the expected finding; `None` for a harmless variant.
    pub level: Option<Level>,
    pub edits: Vec<Edit>,
    /// Targets where the fault must be found. If empty, the edited rows apply.
    pub at: Vec<Target>,
    pub why: String,
}

/// A real file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Original {
    pub producer: String,
    /// Path relative to the producer's directory.
    pub path: PathBuf,
}

/// Parses a list. `#` in its selectors means the attribute `key`. The text of an error begins with
/// the line number.
pub fn read(text: &str, key: &str) -> Result<Vec<Entry>, String> {
    let (mut aliases, mut all) = (BTreeMap::new(), Vec::<Entry>::new());
    for (number, line) in text.lines().enumerate() {
        let trimmed = line.trim();
        if trimmed.is_empty() || trimmed.starts_with('#') {
            continue;
        }
        let read = if line.starts_with(' ') {
            let entry = all
                .last_mut()
                .ok_or_else(|| "no entry precedes this line".to_owned());
            entry.and_then(|entry| entry.line(trimmed, key))
        } else if let Some((name, file)) = alias(trimmed) {
            let before = aliases.insert(name, file);
            before.map_or(Ok(()), |_| Err(format!("@{name} is defined twice")))
        } else {
            Entry::head(trimmed, &aliases).map(|entry| all.push(entry))
        };
        read.map_err(|error| format!("{}: {error}", number + 1))?;
    }
    let mut ids = BTreeSet::new();
    for entry in &all {
        let id = &entry.id;
        if entry.edits.is_empty() || entry.why.is_empty() || !ids.insert(id) {
            return Err(format!(
                "{id}: the entry has no edit or no reason, or its id is used twice"
            ));
        }
    }
    Ok(all)
}

fn alias(line: &str) -> Option<(&str, &str)> {
    line.strip_prefix('@')?.split_once(" = ")
}

impl Entry {
    fn head(line: &str, aliases: &BTreeMap<&str, &str>) -> Result<Entry, String> {
        let fields: Vec<&str> = line.split(" | ").map(str::trim).collect();
        let (id, category, file, level) = match fields[..] {
            [id, category, file] => (id, category, file, None),
            [id, category, file, level] => {
                let level =
                    Level::from_word(level).ok_or_else(|| format!("unknown level: {level}"))?;
                (id, category, file, Some(level))
            }
            _ => return Err(format!("not an entry: {line}")),
        };
        let file = match file.strip_prefix('@') {
            Some(alias) => aliases
                .get(alias)
                .ok_or_else(|| format!("unknown alias: {file}"))?,
            None => file,
        };
        let (producer, path) = file
            .split_once(':')
            .ok_or_else(|| format!("expected producer:path, found: {file}"))?;
        Ok(Entry {
            id: id.to_owned(),
            category: category.to_owned(),
            original: Original {
                producer: producer.to_owned(),
                path: path.into(),
            },
            level,
            edits: Vec::new(),
            at: Vec::new(),
            why: String::new(),
        })
    }

    fn line(&mut self, line: &str, key: &str) -> Result<(), String> {
        if let Some(why) = line.strip_prefix("why: ") {
            why.clone_into(&mut self.why);
            return Ok(());
        }
        let (line, file) = match line.rsplit_once(" | in: ") {
            Some((line, file)) => (line, beside(&self.original.path, file.trim())?),
            None => (line, self.original.path.clone()),
        };
        match line.strip_prefix("at: ") {
            Some(selector) => self.at.push(Target::by(selector, file, key)?),
            None => self.edits.push(Edit::by(line, file, key)?),
        }
        Ok(())
    }
}
