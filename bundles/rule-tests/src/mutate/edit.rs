//! Edits of a file's text. None of them changes the number of lines, except `cut`.

use std::collections::BTreeSet;
use std::ops::Range;

use super::scan::{Element, Scan, lines};
use super::select::Selector;

/// An edit of an element.
#[derive(Debug, Clone)]
pub enum Action {
    /// Removes the element.
    Drop,
    /// Removes an attribute.
    DropAttribute(String),
    /// Sets the value of an attribute, and adds the attribute if it is missing.
    Set(String, String),
    /// Adds a number to a numeric attribute.
    Shift(String, f64),
    /// Changes the sign of a numeric attribute.
    Negate(String),
    /// Copies the element.
    Duplicate,
    /// Exchanges the element with its next sibling.
    Swap,
    /// Inserts text before its content.
    Prepend(String),
    /// Inserts text after its content.
    Append(String),
    /// Inserts text before the element.
    Before(String),
    /// Inserts text after the element.
    After(String),
    /// Replaces the element with text.
    Replace(String),
    /// Renames the element.
    Rename(String),
    /// Removes its end tag.
    Unclose,
    /// Uses single quotes for its attributes.
    Quote,
    /// Reverses the order of its attributes.
    Reverse,
}

/// An edited text, and the edited rows.
pub type Edited = (String, BTreeSet<u64>);

/// Byte ranges and their replacements.
type Splices = Vec<(Range<usize>, String)>;

impl Action {
    /// Parses an edit as described in `bundles/xosc/tests/rules/seeded/README.md`.
    ///
    /// # Errors
    /// Returns an error for text that cannot be parsed.
    pub fn parse(text: &str) -> Result<Action, String> {
        let bad = || format!("not an edit: {text}");
        let (verb, rest) = text.split_once(' ').unwrap_or((text, ""));
        let owned = || rest.to_owned();
        let named = || rest.strip_prefix('@').ok_or_else(bad);
        let action = match verb {
            "set" => {
                let (name, value) = named()?.split_once('=').ok_or_else(bad)?;
                if value.contains(['"', '<']) {
                    return Err(format!(
                        "an attribute value must not contain \" or <: {text}"
                    ));
                }
                Action::Set(name.to_owned(), value.to_owned())
            }
            "shift" => {
                let (name, by) = named()?.split_once('=').ok_or_else(bad)?;
                Action::Shift(name.to_owned(), by.parse().map_err(|_| bad())?)
            }
            "negate" => Action::Negate(named()?.to_owned()),
            "drop" if !rest.is_empty() => Action::DropAttribute(named()?.to_owned()),
            "prepend" => Action::Prepend(owned()),
            "append" => Action::Append(owned()),
            "before" if !rest.is_empty() => Action::Before(owned()),
            "after" if !rest.is_empty() => Action::After(owned()),
            "replace" if !rest.is_empty() => Action::Replace(owned()),
            "rename" if !rest.is_empty() => Action::Rename(owned()),
            _ if !rest.is_empty() => return Err(bad()),
            "drop" => Action::Drop,
            "duplicate" => Action::Duplicate,
            "swap" => Action::Swap,
            "unclose" => Action::Unclose,
            "quote" => Action::Quote,
            "reverse" => Action::Reverse,
            _ => return Err(bad()),
        };
        Ok(action)
    }

    /// Changes the one element that the selector matches.
    ///
    /// # Errors
    /// Returns an error if there is not exactly one such element, or the edit cannot be made.
    pub fn apply(&self, selector: &Selector, text: &str) -> Result<Edited, String> {
        let scan = Scan::of(text)?;
        let edited = self.apply_to(&scan, selector.one(&scan)?);
        edited.map_err(|error| format!("{} | {error}", selector.text))
    }

    /// Changes an element.
    ///
    /// # Errors
    /// Returns an error if the edit cannot be made.
    pub fn apply_to(&self, scan: &Scan<'_>, id: usize) -> Result<Edited, String> {
        let text = scan.text;
        let splices = self.splices(scan, id)?;
        let rows = self.rows(scan, id);
        let edited = spliced(text, splices);
        if edited == text {
            return Err(format!("the edit changes nothing: {self:?}"));
        }
        if lines(&edited) != lines(text) {
            return Err(format!("the edit changes the number of lines: {self:?}"));
        }
        Ok((edited, rows))
    }

    fn splices(&self, scan: &Scan<'_>, id: usize) -> Result<Splices, String> {
        let (text, element) = (scan.text, &scan.elements[id]);
        let whole = element.start_tag.start..element.end;
        let at = |place: usize, text: &str| vec![(place..place, text.to_owned())];
        let splices = match self {
            Action::Drop => vec![(whole.clone(), gap(&text[whole]))],
            Action::DropAttribute(name) => {
                let attribute = scan.attribute(id, name);
                let attribute = attribute.ok_or_else(|| format!("no attribute {name}"))?;
                let whole = attribute.whole.clone();
                vec![(whole.clone(), gap(&text[whole]))]
            }
            Action::Set(name, value) => match scan.attribute(id, name) {
                Some(attribute) => vec![(attribute.value.clone(), value.clone())],
                None => at(element.name.end, &format!(" {name}=\"{value}\"")),
            },
            Action::Shift(name, by) => vec![calculated(scan, id, name, |old| old + by)?],
            Action::Negate(name) => vec![calculated(scan, id, name, |old| -old)?],
            Action::Duplicate => at(
                whole.end,
                &text[whole].replace("\r\n", " ").replace('\n', " "),
            ),
            Action::Swap => {
                let next = &scan.elements[next(scan, id)?];
                let other = next.start_tag.start..next.end;
                let texts = (
                    text[whole.clone()].to_owned(),
                    text[other.clone()].to_owned(),
                );
                vec![(whole, texts.1), (other, texts.0)]
            }
            Action::Prepend(xml) | Action::Append(xml) if element.closes_itself => {
                vec![opened(text, element, xml)]
            }
            Action::Prepend(xml) => at(element.start_tag.end, xml),
            Action::Append(xml) => at(end_tag(element)?.start, xml),
            Action::Before(xml) => at(whole.start, xml),
            Action::After(xml) => at(whole.end, xml),
            Action::Replace(xml) => vec![(whole.clone(), format!("{xml}{}", gap(&text[whole])))],
            Action::Rename(name) => {
                let mut splices = vec![(element.name.clone(), name.clone())];
                if let Some(tag) = &element.end_tag {
                    splices.push((tag.clone(), format!("</{name}>")));
                }
                splices
            }
            Action::Unclose => {
                let tag = end_tag(element)?;
                vec![(tag.clone(), gap(&text[tag]))]
            }
            Action::Quote => quoted(text, element)?,
            Action::Reverse => vec![reversed(text, element)?],
        };
        Ok(splices)
    }

    /// Returns the rows of the edited text where the edit is visible.
    fn rows(&self, scan: &Scan<'_>, id: usize) -> BTreeSet<u64> {
        let element = &scan.elements[id];
        let (start, end) = (element.start_tag.start, element.end);
        let tag = || scan.rows(id);
        let one = |at: usize| BTreeSet::from([scan.row(at)]);
        match self {
            Action::Drop => element.parent.map_or(one(0), |up| scan.rows(up).collect()),
            Action::Duplicate => tag().chain(one(end)).collect(),
            Action::Swap => {
                let Ok(next) = next(scan, id) else {
                    return one(start);
                };
                let next = &scan.elements[next];
                let height = |it: &Element| lines(&scan.text[it.start_tag.start..it.end]) as u64;
                let second = scan.row(next.start_tag.start) + height(next) - height(element);
                BTreeSet::from([scan.row(start), second])
            }
            Action::Append(_) if !element.closes_itself => {
                let tag = element.end_tag.as_ref();
                one(tag.map_or(end, |tag| tag.start))
            }
            Action::Prepend(_) | Action::Append(_) => one(element.start_tag.end),
            Action::Before(_) | Action::Replace(_) => one(start),
            Action::After(_) => one(end),
            Action::Unclose => {
                let tag_before = element.end_tag.as_ref().map_or(end, |tag| tag.start);
                tag().chain(one(tag_before)).collect()
            }
            _ => tag().collect(),
        }
    }
}

/// Returns the line breaks of a removed text, so that the number of lines stays the same.
fn gap(text: &str) -> String {
    "\n".repeat(lines(text))
}

/// Replaces the value of a numeric attribute with a calculated one.
fn calculated(
    scan: &Scan<'_>,
    id: usize,
    name: &str,
    to: impl Fn(f64) -> f64,
) -> Result<(Range<usize>, String), String> {
    let attribute = scan.attribute(id, name);
    let attribute = attribute.ok_or_else(|| format!("no attribute {name}"))?;
    let old = &scan.text[attribute.value.clone()];
    let number: f64 = old
        .parse()
        .map_err(|_| format!("expected a number, found {old}"))?;
    Ok((attribute.value.clone(), to(number).to_string()))
}

fn spliced(text: &str, mut splices: Splices) -> String {
    splices.sort_by_key(|(range, _)| range.start);
    let mut edited = text.to_owned();
    for (range, new) in splices.into_iter().rev() {
        edited.replace_range(range, &new);
    }
    edited
}

fn next(scan: &Scan<'_>, id: usize) -> Result<usize, String> {
    let mut later = scan.siblings(id).filter(|other| *other > id);
    later
        .next()
        .ok_or_else(|| "no element follows it".to_owned())
}

fn end_tag(element: &Element) -> Result<Range<usize>, String> {
    let tag = element.end_tag.clone();
    tag.ok_or_else(|| "the element has no end tag".to_owned())
}

/// Replaces an empty element with one that has content.
fn opened(text: &str, element: &Element, xml: &str) -> (Range<usize>, String) {
    let tag = &text[element.start_tag.clone()];
    let slash = tag.rfind('/').unwrap_or(tag.len());
    let kept = tag[..slash].trim_end().len();
    let (gap, name) = (gap(&tag[kept..slash]), &text[element.name.clone()]);
    let range = element.start_tag.start + kept..element.start_tag.end;
    (range, format!("{gap}>{xml}</{name}>"))
}

fn quoted(text: &str, element: &Element) -> Result<Splices, String> {
    let quoted = element.attributes.iter().map(|attribute| {
        let value = &text[attribute.value.clone()];
        if value.contains('\'') {
            return Err(format!("the value contains a quote: {value}"));
        }
        let range = attribute.value.start - 1..attribute.value.end + 1;
        Ok((range, format!("'{value}'")))
    });
    quoted.collect()
}

fn reversed(text: &str, element: &Element) -> Result<(Range<usize>, String), String> {
    let [first, .., last] = &element.attributes[..] else {
        return Err("fewer than two attributes".to_owned());
    };
    let range = first.whole.start..last.whole.end;
    let attributes = element.attributes.iter().rev();
    Ok((
        range,
        attributes.map(|it| &text[it.whole.clone()]).collect(),
    ))
}
