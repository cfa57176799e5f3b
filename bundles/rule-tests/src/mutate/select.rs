//! Selectors that identify an element of a file.

use super::scan::Scan;

/// A list of words, from the outermost element to the innermost.
#[derive(Debug, Clone)]
pub struct Selector {
    /// The text of the selector.
    pub text: String,
    words: Vec<Compound>,
}

/// One word: a name and further conditions.
#[derive(Debug, Clone, Default)]
struct Compound {
    name: String,
    nth: Option<usize>,
    attributes: Vec<(String, String)>,
    /// Whether the element must be a child of the previous word's element, not just any descendant.
    child: bool,
}

impl Selector {
    /// Parses a selector; `#value` means the attribute `name`.
    ///
    /// # Errors
    /// Returns an error for text that cannot be parsed.
    pub fn parse(text: &str) -> Result<Selector, String> {
        Selector::by(text, "name")
    }

    /// Parses a selector; `#value` means the attribute `key`.
    ///
    /// # Errors
    /// Returns an error for text that cannot be parsed.
    pub fn by(text: &str, key: &str) -> Result<Selector, String> {
        let (mut words, mut child) = (Vec::new(), false);
        for word in split(text) {
            if word == ">" {
                child = true;
                continue;
            }
            let mut compound = Compound::parse(word, key)?;
            compound.child = std::mem::take(&mut child);
            words.push(compound);
        }
        if child || words.is_empty() || words[0].child {
            return Err(format!("not a selector: {text}"));
        }
        Ok(Selector {
            text: text.to_owned(),
            words,
        })
    }

    /// Returns all matching elements in document order.
    pub fn all(&self, scan: &Scan<'_>) -> impl Iterator<Item = usize> {
        let all = 0..scan.elements.len();
        all.filter(|id| fits(scan, *id, &self.words))
    }

    /// Returns the one matching element.
    ///
    /// # Errors
    /// Returns an error if there are several or none.
    pub fn one(&self, scan: &Scan<'_>) -> Result<usize, String> {
        let found: Vec<usize> = self.all(scan).collect();
        match found[..] {
            [one] => Ok(one),
            _ => Err(format!(
                "expected one element, found {}: {}",
                found.len(),
                self.text
            )),
        }
    }
}

/// Splits a text at blanks outside of brackets.
fn split(text: &str) -> impl Iterator<Item = &str> {
    let (mut depth, mut quoted) = (0_usize, false);
    let blank = move |c: char| {
        match c {
            '\'' if depth > 0 => quoted = !quoted,
            '[' if !quoted => depth += 1,
            ']' if !quoted => depth = depth.saturating_sub(1),
            _ => {}
        }
        c == ' ' && depth == 0
    };
    text.split(blank).filter(|word| !word.is_empty())
}

impl Compound {
    fn parse(word: &str, key: &str) -> Result<Compound, String> {
        let bad = || format!("not a word of a selector: {word}");
        let end = word.find(['#', '[', ':']).unwrap_or(word.len());
        let (name, mut rest) = word.split_at(end);
        let mut compound = Compound {
            name: name.to_owned(),
            ..Compound::default()
        };
        while let Some(sort) = rest.chars().next() {
            let body = &rest[1..];
            if sort == '[' {
                let (name, after) = body.split_once('=').ok_or_else(bad)?;
                let (value, after) = match after.strip_prefix('\'') {
                    Some(after) => after.split_once("']"),
                    None => after.split_once(']'),
                }
                .ok_or_else(bad)?;
                let attribute = (name.to_owned(), value.to_owned());
                compound.attributes.push(attribute);
                rest = after;
                continue;
            }
            let end = body.find(['#', '[', ':']).unwrap_or(body.len());
            let (value, after) = body.split_at(end);
            if sort == '#' {
                let attribute = (key.to_owned(), value.to_owned());
                compound.attributes.push(attribute);
            } else {
                compound.nth = Some(value.parse().map_err(|_| bad())?);
            }
            rest = after;
        }
        (!name.is_empty()).then_some(compound).ok_or_else(bad)
    }

    fn is(&self, scan: &Scan<'_>, id: usize) -> bool {
        let has = |(name, value): &(String, String)| scan.value(id, name) == Some(value.as_str());
        let same = |other: &usize| scan.name(*other) == self.name;
        scan.name(id) == self.name
            && self.attributes.iter().all(has)
            && self.nth.is_none_or(|nth| {
                let mut same = scan.siblings(id).filter(same);
                same.position(|other| other == id) == Some(nth.wrapping_sub(1))
            })
    }
}

/// Checks whether the last word matches the element and the earlier words match its ancestors.
fn fits(scan: &Scan<'_>, id: usize, words: &[Compound]) -> bool {
    let Some((last, before)) = words.split_last() else {
        return true;
    };
    if !last.is(scan, id) {
        return false;
    }
    let above = |id: usize| scan.elements[id].parent;
    let mut around = std::iter::successors(above(id), |id| above(*id));
    match last.child {
        _ if before.is_empty() => true,
        true => around.next().is_some_and(|id| fits(scan, id, before)),
        false => around.any(|id| fits(scan, id, before)),
    }
}
