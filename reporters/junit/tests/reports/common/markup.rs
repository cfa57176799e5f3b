//! A strict XML reader, independent of the code that writes the reports.

use std::collections::BTreeMap;

pub struct Element {
    pub name: String,
    pub attributes: BTreeMap<String, String>,
    pub children: Vec<Element>,
    pub text: String,
}

impl Element {
    pub fn named(&self, name: &str) -> impl Iterator<Item = &Element> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Asserts that the element has exactly these attributes.
    pub fn has_only(&self, names: &[&str]) {
        let mut wanted = names.to_vec();
        wanted.sort_unstable();
        let there: Vec<&str> = self.attributes.keys().map(String::as_str).collect();
        assert_eq!(there, wanted, "attributes of {}", self.name);
    }

    pub fn numbers<const N: usize>(&self, names: [&str; N]) -> [usize; N] {
        names.map(|name| self.attributes[name].parse().unwrap())
    }
}

/// Returns the root element of a well-formed document of elements, attributes and text.
pub fn read(document: &str) -> Element {
    assert!(
        document.chars().all(is_legal),
        "every character must be allowed in XML"
    );
    let declaration = r#"<?xml version="1.0" encoding="UTF-8"?>"#;
    let mut rest = document.strip_prefix(declaration).unwrap().trim_start();
    let root = element(&mut rest);
    assert_eq!(rest, "\n", "exactly one root, then a line feed");
    root
}

fn is_legal(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r' | ' '..='\u{FFFD}' | '\u{10000}'..)
}

/// Reads the element whose `<` is at the start of `rest`. Afterwards `rest` contains the text after
/// it.
fn element(rest: &mut &str) -> Element {
    let inside = rest.strip_prefix('<').unwrap();
    let (tag, behind) = inside.split_once('>').unwrap();
    *rest = behind;
    let (tag, is_empty) = match tag.strip_suffix('/') {
        Some(tag) => (tag, true),
        None => (tag, false),
    };
    let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
    assert!(name.bytes().all(|b| b.is_ascii_alphabetic() || b == b'-'));
    let mut read = Element {
        name: name.to_owned(),
        attributes: self::attributes(attributes),
        children: Vec::new(),
        text: String::new(),
    };
    if is_empty {
        return read;
    }
    loop {
        let at = rest.find('<').unwrap();
        read.text.push_str(&plain(&rest[..at]));
        *rest = &rest[at..];
        if let Some(end) = rest.strip_prefix("</") {
            *rest = end.strip_prefix(&format!("{name}>")).unwrap();
            return read;
        }
        read.children.push(element(rest));
    }
}

fn attributes(mut text: &str) -> BTreeMap<String, String> {
    let mut attributes = BTreeMap::new();
    while !text.is_empty() {
        let (name, behind) = text.split_once("=\"").unwrap();
        let (value, behind) = behind.split_once('"').unwrap();
        assert!(!value.contains(['<', '\n', '\t']));
        let earlier = attributes.insert(name.trim().to_owned(), plain(value));
        assert_eq!(earlier, None, "{name} twice");
        text = behind;
    }
    attributes
}

/// Resolves the references in a text. An `&` without a valid reference is a fault.
fn plain(text: &str) -> String {
    let mut parts = text.split('&');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, behind) = part.split_once(';').unwrap();
        let named = [
            ("lt", '<'),
            ("gt", '>'),
            ("amp", '&'),
            ("quot", '"'),
            ("apos", '\''),
        ];
        let known = named.iter().find(|(known, _)| *known == name);
        plain.push(known.unwrap_or_else(|| panic!("&{name};")).1);
        plain.push_str(behind);
    }
    plain
}
