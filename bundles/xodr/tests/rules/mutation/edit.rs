//! The table of edits: parses it, finds the element of an edit and changes it.

use qcbus_rule_tests::mutate::{Action, Scan, Selector};

/// A rule and the edits that should make it fire.
#[derive(Debug)]
pub struct Entry {
    /// The checker's id without its prefix.
    pub rule: String,
    /// Edits that violate it.
    pub edits: Vec<Edit>,
    /// Reason if there are no edits.
    pub without: Option<String>,
}

/// One violating edit.
#[derive(Debug)]
pub struct Edit {
    /// Text in the table, for messages.
    pub text: String,
    selector: Selector,
    action: Action,
    /// Further rules that may report errors.
    pub companions: Vec<String>,
    /// Suffixes of the names of the maps that it is for. Empty for all maps.
    pub only: Vec<String>,
}

/// Parses the table. The beginning of the table describes its format.
pub fn table(text: &str) -> Vec<Entry> {
    let mut all: Vec<Entry> = Vec::new();
    for line in text.lines() {
        let trimmed = line.trim();
        if trimmed.is_empty() || trimmed.starts_with('#') {
            continue;
        }
        if !line.starts_with(' ') {
            all.push(Entry {
                rule: trimmed.to_owned(),
                edits: Vec::new(),
                without: None,
            });
            continue;
        }
        let entry = all.last_mut().unwrap();
        match trimmed.strip_prefix("none:") {
            Some(why) => entry.without = Some(why.trim().to_owned()),
            None => entry.edits.push(Edit::parse(trimmed)),
        }
    }
    all
}

impl Edit {
    fn parse(line: &str) -> Edit {
        let mut fields = line.split(" | ").map(str::trim);
        let (Some(selector), Some(action)) = (fields.next(), fields.next()) else {
            panic!("not an edit: {line}");
        };
        let mut edit = Edit {
            text: format!("{selector} | {action}"),
            selector: Selector::by(selector, "id").unwrap(),
            action: Action::parse(action).unwrap(),
            companions: Vec::new(),
            only: Vec::new(),
        };
        for field in fields {
            let words = |list: &str| list.split(' ').map(str::to_owned).collect();
            match field.split_once(": ") {
                Some(("also", list)) => edit.companions = words(list),
                Some(("only", list)) => edit.only = words(list),
                _ => panic!("expected `also: …` or `only: …`: {line}"),
            }
        }
        edit
    }

    /// Returns whether the edit applies to the map with this name.
    pub fn is_for(&self, map: &str) -> bool {
        self.only.is_empty()
            || self
                .only
                .iter()
                .any(|version| map.ends_with(version.as_str()))
    }

    /// Returns the edited map, or `None` if the element or the attribute is missing.
    pub fn apply(&self, map: &str) -> Option<String> {
        let scan = Scan::of(map).unwrap();
        let target = self.selector.all(&scan).next()?;
        let edited = self.action.apply_to(&scan, target);
        edited.ok().map(|(text, _)| text)
    }
}
