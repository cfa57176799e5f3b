//! The table of edits: how it is read, how an edit finds its element and changes it.

use qcbus_sdk::mutate::{Action, Scan, Selector};

/// A rule and what should make it fire.
#[derive(Debug)]
pub struct Entry {
    /// The checker's id without its prefix.
    pub rule: String,
    /// Edits that violate it.
    pub edits: Vec<Edit>,
    /// Why there is none.
    pub without: Option<String>,
}

/// One violating edit.
#[derive(Debug)]
pub struct Edit {
    /// As it stands in the table, for messages.
    pub text: String,
    selector: Selector,
    action: Action,
    /// Rules that may complain about it, too, at error level.
    pub companions: Vec<String>,
    /// Ends of the names of the maps that it is for; all where empty.
    pub only: Vec<String>,
}

/// Reads the table; its form is described at its top.
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
            panic!("no edit: {line}");
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
                _ => panic!("neither `also: …` nor `only: …`: {line}"),
            }
        }
        edit
    }

    /// Whether the edit is meant for the map with this name.
    pub fn is_for(&self, map: &str) -> bool {
        self.only.is_empty()
            || self
                .only
                .iter()
                .any(|version| map.ends_with(version.as_str()))
    }

    /// The map with the edit in it; nothing where it lacks the element or the attribute.
    pub fn apply(&self, map: &str) -> Option<String> {
        let scan = Scan::of(map).unwrap();
        let target = self.selector.all(&scan).next()?;
        let edited = self.action.apply_to(&scan, target);
        edited.ok().map(|(text, _)| text)
    }
}
