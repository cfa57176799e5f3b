//! Parsing of the attributes of a tag, with positions and precise errors.

use std::borrow::Cow;

use super::{Fault, is_name, is_xml_char};

/// One attribute as written.
pub(super) struct RawAttribute<'t> {
    pub name: &'t str,
    /// Normalised value with resolved references.
    pub value: Cow<'t, str>,
    /// Byte offset of the name in the text.
    pub offset: usize,
}

const QUOTE_HINT: &str =
    "a quotation mark inside a value ends it: remove it, or write it as &quot;";
const VALUE_HINT: &str = "write name=\"value\"";
const OPEN_HINT: &str =
    "a quotation mark is missing, or there is an extra one before this position";

/// Parses the attributes of a tag. `text` is everything after the element's name up to `>` or `/>`.
/// If the tag is not closed, it ends with the file. It starts at byte `base`.
pub(super) fn scan(text: &str, base: usize) -> Result<Vec<RawAttribute<'_>>, Fault> {
    let mut found: Vec<RawAttribute<'_>> = Vec::new();
    let mut at = 0;
    loop {
        let gap = leading_space(&text[at..]);
        if at + gap == text.len() {
            return Ok(found);
        }
        if gap == 0 {
            return Err(no_space(&text[at..], base + at, found.last()));
        }
        at += gap;
        let (attribute, next) = one(text, at, base)?;
        if found.iter().any(|earlier| earlier.name == attribute.name) {
            let what = format!("the attribute `{}` is defined twice", attribute.name);
            return Err(Fault::new(attribute.offset, what));
        }
        found.push(attribute);
        at = next;
    }
}

fn leading_space(text: &str) -> usize {
    text.len() - text.trim_start_matches([' ', '\t', '\r', '\n']).len()
}

/// Returns the error for text that follows a value (or the element's name) without a space.
fn no_space(rest: &str, offset: usize, before: Option<&RawAttribute<'_>>) -> Fault {
    let stray = excerpt(rest);
    let what = match before {
        Some(attribute) => {
            format!(
                "`{stray}` directly follows the value of attribute `{}`",
                attribute.name
            )
        }
        None => format!("`{stray}` directly follows the name of the element"),
    };
    Fault::new(offset, what).with_hint(QUOTE_HINT)
}

/// Returns the first word, short enough for a message.
fn excerpt(text: &str) -> String {
    text.chars()
        .take_while(|c| !c.is_whitespace() && *c != '>' && *c != '<')
        .take(40)
        .collect()
}

/// Parses the attribute that starts at `at`, and returns its end too.
fn one(text: &str, at: usize, base: usize) -> Result<(RawAttribute<'_>, usize), Fault> {
    let stops = [' ', '\t', '\r', '\n', '=', '"', '\'', '<', '>'];
    let length = text[at..].find(stops).unwrap_or(text.len() - at);
    let name = &text[at..at + length];
    if !is_name(name) {
        let what = format!("`{}` is not a valid attribute name", excerpt(&text[at..]));
        return Err(Fault::new(base + at, what).with_hint(OPEN_HINT));
    }
    let mut next = at + length;
    next += leading_space(&text[next..]);
    if !text[next..].starts_with('=') {
        let what = format!("the attribute `{name}` has no value");
        return Err(Fault::new(base + at, what).with_hint(VALUE_HINT));
    }
    next += 1;
    next += leading_space(&text[next..]);
    let raw = quoted(&text[next..], name, base + next)?;
    let value = resolve(raw, base + next + 1)?;
    Ok((
        RawAttribute {
            name,
            value,
            offset: base + at,
        },
        next + raw.len() + 2,
    ))
}

/// Returns the text between quotation marks at the start of `text`, which is at byte `offset`.
fn quoted<'t>(text: &'t str, name: &str, offset: usize) -> Result<&'t str, Fault> {
    let Some(quote @ ('"' | '\'')) = text.chars().next() else {
        let what = format!("the value of attribute `{name}` is not in quotation marks");
        return Err(Fault::new(offset, what).with_hint(VALUE_HINT));
    };
    let rest = &text[1..];
    let end = rest.find(quote);
    let raw = &rest[..end.unwrap_or(rest.len())];
    match raw.find('<') {
        // The value contains markup of a later line, so its closing quotation mark is missing.
        Some(open) if raw[..open].contains('\n') => Err(unclosed(name, offset)),
        Some(open) => {
            let what = format!("`<` is not allowed in the value of attribute `{name}`");
            let hint = "the closing quotation mark is missing, or `<` should be &lt;";
            Err(Fault::new(offset + 1 + open, what).with_hint(hint))
        }
        None if end.is_none() => Err(unclosed(name, offset)),
        None => Ok(raw),
    }
}

fn unclosed(name: &str, offset: usize) -> Fault {
    let what = format!("the value of attribute `{name}` has no closing quotation mark");
    Fault::new(offset, what).with_hint(OPEN_HINT)
}

/// Returns an attribute's value: white space becomes spaces, references are resolved.
fn resolve(raw: &str, base: usize) -> Result<Cow<'_, str>, Fault> {
    if !raw.contains(['&', '\t', '\n', '\r']) {
        return Ok(Cow::Borrowed(raw));
    }
    let mut value = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some(c) = rest.chars().next() {
        let offset = base + raw.len() - rest.len();
        rest = &rest[c.len_utf8()..];
        match c {
            '&' => {
                let (name, after) = rest.split_once(';').unwrap_or((rest, ""));
                value.push(reference(name, offset)?);
                rest = after;
            }
            // A line end counts as one character in each of its spellings (XML 1.0, 2.11).
            '\r' if rest.starts_with('\n') => {}
            '\t' | '\n' | '\r' => value.push(' '),
            other => value.push(other),
        }
    }
    Ok(Cow::Owned(value))
}

/// Returns the character that `&name;` represents.
pub(super) fn reference(name: &str, offset: usize) -> Result<char, Fault> {
    let number = match name.strip_prefix('#') {
        None => None,
        Some(digits) => match digits.strip_prefix('x') {
            Some(hex) => u32::from_str_radix(hex, 16).ok(),
            None => digits.parse().ok(),
        },
    };
    let found = match name {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "apos" => Some('\''),
        "quot" => Some('"'),
        _ => number.and_then(char::from_u32).filter(|c| is_xml_char(*c)),
    };
    found.ok_or_else(|| {
        let shown: String = name.chars().take(20).collect();
        Fault::new(
            offset,
            format!("`&{shown};` is not a valid character reference"),
        )
        .with_hint("write a plain & as &amp;")
    })
}
