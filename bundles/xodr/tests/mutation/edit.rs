//! The table of edits: how it is read, how an edit finds its element and changes it.

use super::tree::{Id, Tree};

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
    selector: Vec<Compound>,
    action: Action,
    /// Rules that may complain about it, too, at error level.
    pub companions: Vec<String>,
    /// Ends of the names of the maps that it is for; all where empty.
    pub only: Vec<String>,
}

/// One word of a selector: a name and what must hold besides.
#[derive(Debug)]
struct Compound {
    name: String,
    nth: Option<usize>,
    attributes: Vec<(String, String)>,
}

#[derive(Debug)]
enum Action {
    Drop,
    DropAttribute(String),
    Set(String, String),
    Shift(String, f64),
    Negate(String),
    Duplicate,
    Swap,
    Prepend(String),
    Append(String),
    After(String),
    Replace(String),
    Rename(String),
    Unclose,
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
            selector: selector.split(' ').map(Compound::parse).collect(),
            action: Action::parse(action),
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
    pub fn apply(&self, map: &Tree) -> Option<String> {
        let mut all = map.all().into_iter();
        let target = all.find(|id| matches(map, *id, &self.selector))?;
        let mut changed = map.clone();
        self.action.apply(&mut changed, target)?;
        let text = changed.text();
        assert!(text != map.text(), "{} changes nothing", self.text);
        Some(text)
    }
}

impl Compound {
    /// `name`, `name#id`, `name[a=v]`, `name:2` or several of these together.
    fn parse(word: &str) -> Compound {
        let end = word.find(['#', '[', ':']).unwrap_or(word.len());
        let (name, mut rest) = word.split_at(end);
        let mut compound = Compound {
            name: name.to_owned(),
            nth: None,
            attributes: Vec::new(),
        };
        while let Some(sort) = rest.chars().next() {
            let body = &rest[1..];
            let end = body.find(['#', '[', ':']).unwrap_or(body.len());
            let (value, after) = body.split_at(end);
            match sort {
                '#' => compound
                    .attributes
                    .push(("id".to_owned(), value.to_owned())),
                ':' => compound.nth = Some(value.parse().unwrap()),
                _ => {
                    let (name, value) = value.trim_end_matches(']').split_once('=').unwrap();
                    compound
                        .attributes
                        .push((name.to_owned(), value.to_owned()));
                }
            }
            rest = after;
        }
        compound
    }

    fn is(&self, map: &Tree, id: Id) -> bool {
        let element = map.get(id);
        let has = |wanted: &(String, String)| element.attributes.contains(wanted);
        element.name == self.name
            && self.nth.is_none_or(|nth| map.nth(id) == nth)
            && self.attributes.iter().all(has)
    }
}

/// Whether the last word is the element and those before it are ancestors, in order.
fn matches(map: &Tree, id: Id, selector: &[Compound]) -> bool {
    let Some((last, before)) = selector.split_last() else {
        return true;
    };
    let mut above = std::iter::successors(map.get(id).parent, |id| map.get(*id).parent);
    last.is(map, id)
        && before
            .iter()
            .rev()
            .all(|word| above.any(|id| word.is(map, id)))
}

impl Action {
    fn parse(text: &str) -> Action {
        let (verb, rest) = text.split_once(' ').unwrap_or((text, ""));
        let owned = || rest.to_owned();
        let attribute = || rest.trim_start_matches('@').split_once('=').unwrap();
        match verb {
            "drop" if rest.is_empty() => Action::Drop,
            "drop" => Action::DropAttribute(rest.trim_start_matches('@').to_owned()),
            "set" => Action::Set(attribute().0.to_owned(), attribute().1.to_owned()),
            "shift" => Action::Shift(attribute().0.to_owned(), attribute().1.parse().unwrap()),
            "negate" => Action::Negate(rest.trim_start_matches('@').to_owned()),
            "duplicate" => Action::Duplicate,
            "swap" => Action::Swap,
            "prepend" => Action::Prepend(owned()),
            "append" => Action::Append(owned()),
            "after" => Action::After(owned()),
            "replace" => Action::Replace(owned()),
            "rename" => Action::Rename(owned()),
            "unclose" => Action::Unclose,
            _ => panic!("no edit: {text}"),
        }
    }

    fn apply(&self, map: &mut Tree, target: Id) -> Option<()> {
        match self {
            Action::DropAttribute(name) => {
                value(map, target, name)?;
                let attributes = &mut map.get_mut(target).attributes;
                attributes.retain(|(other, _)| other != name);
            }
            Action::Set(name, new) => match value(map, target, name) {
                Some(old) => new.clone_into(old),
                None => {
                    let attribute = (name.clone(), new.clone());
                    map.get_mut(target).attributes.push(attribute);
                }
            },
            Action::Shift(name, by) => calculate(value(map, target, name)?, |old| old + by),
            Action::Negate(name) => calculate(value(map, target, name)?, |old| -old),
            Action::Rename(name) => map.get_mut(target).name.clone_from(name),
            Action::Unclose => map.get_mut(target).unclosed = true,
            _ => self.rearrange(map, target),
        }
        Some(())
    }

    /// The edits that change a list of children.
    fn rearrange(&self, map: &mut Tree, target: Id) {
        match self {
            // The same element twice in a list of children is a copy.
            Action::Duplicate => splice(map, target, vec![target, target]),
            Action::Swap => {
                let (parent, at) = map.place(target);
                let siblings = &mut map.get_mut(parent).children;
                assert!(at + 1 < siblings.len(), "nothing comes after it");
                siblings.swap(at, at + 1);
            }
            Action::Prepend(xml) => insert(map, target, 0, xml),
            Action::Append(xml) => {
                let end = map.get(target).children.len();
                insert(map, target, end, xml);
            }
            Action::After(xml) => {
                let (parent, at) = map.place(target);
                insert(map, parent, at + 1, xml);
            }
            Action::Drop => splice(map, target, Vec::new()),
            Action::Replace(xml) => {
                let (parent, at) = map.place(target);
                splice(map, target, Vec::new());
                insert(map, parent, at, xml);
            }
            _ => {}
        }
    }
}

fn splice(map: &mut Tree, target: Id, new: Vec<Id>) {
    let (parent, at) = map.place(target);
    map.get_mut(parent).children.splice(at..=at, new);
}

fn insert(map: &mut Tree, parent: Id, at: usize, xml: &str) {
    let new = map.read(xml, Some(parent));
    map.get_mut(parent).children.splice(at..at, new);
}

fn value<'t>(map: &'t mut Tree, target: Id, name: &str) -> Option<&'t mut String> {
    let mut attributes = map.get_mut(target).attributes.iter_mut();
    attributes
        .find(|(other, _)| other == name)
        .map(|(_, value)| value)
}

fn calculate(value: &mut String, to: impl Fn(f64) -> f64) {
    *value = to(value.parse::<f64>().unwrap()).to_string();
}
