//! Writes the expanded scenario as a file.

use std::ops::Range;

use qcbus_document::{Attribute, Document};

use super::OFFERS;
use super::copy::Copy;
use super::plan::Expansion;
use crate::xml::escape_into;

impl Expansion<'_> {
    /// Returns the expanded scenario as a file in UTF-8. Parts that are not replaced stay identical
    /// byte by byte: order of attributes, white space, comments, CDATA. Only `parameterAttributes`
    /// is left out, because it does not belong to a plain scenario.
    ///
    /// The text is not usable if the expansion is not complete.
    pub fn text(&self) -> String {
        let root = self.pieces[0].document;
        let text = text_of(root);
        let mut edits = vec![encoding(text)];
        let mut next = 0;
        while let Some(node) = root.node(next) {
            if let Some(copies) = self.replaced.get(&next) {
                let place = range(node.offset(), node.end_offset());
                let between = indentation(text, place.start);
                let copies: Vec<String> = copies.iter().map(|copy| self.written(copy)).collect();
                edits.push(Some((place, copies.join(&between))));
                next = node.subtree_end();
                continue;
            }
            edits.push(
                node.attribute(OFFERS)
                    .and_then(|offers| left_out(text, offers)),
            );
            next += 1;
        }
        applied(text, 0..text.len(), edits.into_iter().flatten())
    }

    /// Returns the text of a copy in the expanded file.
    fn written(&self, copy: &Copy<'_>) -> String {
        let document = self.pieces[copy.piece].document;
        let text = text_of(document);
        let place = range(copy.group.offset(), copy.group.end_offset());
        let mut edits = vec![self.namespaces(copy, text.get(place.clone()).unwrap_or(""))];
        for node in std::iter::once(copy.group).chain(copy.group.descendants()) {
            for attribute in node.attributes() {
                edits.push(match copy.edit(attribute) {
                    _ if attribute.is(OFFERS) => left_out(text, attribute),
                    Some(value) => Some(rewritten(text, attribute, &value.text)),
                    None => None,
                });
            }
        }
        applied(text, place, edits.into_iter().flatten())
    }

    /// Returns declarations of the prefixes that a copy needs and that are missing in its new
    /// place.
    fn namespaces(&self, copy: &Copy<'_>, written: &str) -> Option<(Range<usize>, String)> {
        const PREFIX: &str = "xmlns:";
        let root = self.pieces[0].document.root();
        let mut declarations = String::new();
        let mut seen: Vec<&str> = Vec::new();
        let around = std::iter::once(copy.group).chain(copy.group.ancestors());
        for (depth, element) in around.enumerate() {
            for attribute in element.attributes() {
                let Some(prefix) = attribute.name().strip_prefix(PREFIX) else {
                    continue;
                };
                if seen.contains(&prefix) {
                    continue;
                }
                seen.push(prefix);
                let is_there =
                    root.and_then(|root| root.attr(attribute.name())) == Some(attribute.value());
                if depth > 0 && !is_there && written.contains(&format!("{prefix}:")) {
                    declarations.push_str(&format!(" {PREFIX}{prefix}=\""));
                    escape_into(&mut declarations, attribute.value(), '"');
                    declarations.push('"');
                }
            }
        }
        let after_name = copy.group.offset() as usize + 1 + tag_name(written).len();
        (!declarations.is_empty()).then_some((after_name..after_name, declarations))
    }
}

/// Returns the name in a start tag, with its prefix.
fn tag_name(written: &str) -> &str {
    let name = written.get(1..).unwrap_or("");
    let end = name.find(|c: char| c.is_ascii_whitespace() || c == '/' || c == '>');
    &name[..end.unwrap_or(name.len())]
}

/// Returns the text of a document with one source. Every scenario has one source.
pub(super) fn text_of<'d>(document: Document<'d>) -> &'d str {
    let mut sources = document.sources();
    sources
        .next()
        .map_or("", |source| document.source_text(&source))
}

fn range(start: u32, stop: u32) -> Range<usize> {
    start as usize..stop as usize
}

/// Replaces a value between its existing quotes.
fn rewritten(text: &str, attribute: Attribute<'_>, value: &str) -> (Range<usize>, String) {
    let start = attribute.value_offset() as usize;
    let quote = match start.checked_sub(1).and_then(|at| text.as_bytes().get(at)) {
        Some(b'\'') => '\'',
        _ => '"',
    };
    let mut written = String::with_capacity(value.len());
    escape_into(&mut written, value, quote);
    (start..start + attribute.raw_len() as usize, written)
}

/// Removes an attribute with the white space before it.
fn left_out(text: &str, attribute: Attribute<'_>) -> Option<(Range<usize>, String)> {
    let before = text.get(..attribute.offset() as usize)?;
    let start = before.trim_end_matches([' ', '\t', '\r', '\n']).len();
    let stop = attribute.value_offset() as usize + attribute.raw_len() as usize + 1;
    Some((start..stop, String::new()))
}

/// Replaces the encoding in the XML declaration if the file had another encoding than UTF-8.
fn encoding(text: &str) -> Option<(Range<usize>, String)> {
    let start = text
        .find("<?xml")
        .filter(|&at| at <= '\u{FEFF}'.len_utf8())?;
    let declaration = text.get(start..start + text.get(start..)?.find("?>")?)?;
    let after = declaration.find("encoding")? + "encoding".len();
    let quote_at = after + declaration.get(after..)?.find(['"', '\''])?;
    let quote = char::from(*declaration.as_bytes().get(quote_at)?);
    let name = declaration.get(quote_at + 1..)?;
    let name = &name[..name.find(quote)?];
    let at = start + quote_at + 1;
    (!name.eq_ignore_ascii_case("utf-8")).then(|| (at..at + name.len(), "UTF-8".to_owned()))
}

/// Returns the separator between two groups in one place: a line break and the indentation of the
/// first one.
fn indentation(text: &str, at: usize) -> String {
    let before = text.get(..at).unwrap_or("");
    let line = before.rsplit_once('\n').map_or("", |(_, line)| line);
    let blank = line.chars().all(|c| c == ' ' || c == '\t');
    match before.contains('\n') && blank {
        true => format!("\n{line}"),
        false => String::new(),
    }
}

/// Returns a section of a text with edits applied.
fn applied(
    text: &str,
    within: Range<usize>,
    edits: impl Iterator<Item = (Range<usize>, String)>,
) -> String {
    let mut edits: Vec<_> = edits.collect();
    edits.sort_by_key(|(range, _)| (range.start, range.end));
    let mut out = String::with_capacity(within.len());
    let mut at = within.start;
    for (range, new) in edits {
        // Edits are sorted and do not overlap. In a damaged image they may overlap, so the range is
        // checked.
        out.push_str(text.get(at..range.start).unwrap_or(""));
        out.push_str(&new);
        at = range.end.max(at);
    }
    out.push_str(text.get(at..within.end).unwrap_or(""));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declared_encoding_becomes_utf8() {
        let edited = |text: &str| applied(text, 0..text.len(), encoding(text).into_iter());
        assert_eq!(
            edited("<?xml version='1.0' encoding='UTF-16' standalone='yes'?><a/>"),
            "<?xml version='1.0' encoding='UTF-8' standalone='yes'?><a/>"
        );
        for same in [
            "<?xml version=\"1.0\"?><a/>",
            "<?xml encoding=\"utf-8\"?><a/>",
            "<a/>",
        ] {
            assert_eq!(edited(same), same);
        }
    }

    #[test]
    fn indentation_is_taken_from_the_line_above() {
        assert_eq!(indentation("<a>\n  <b/>", 6), "\n  ");
        assert_eq!(indentation("<a>\n <c/> <b/>", 10), "");
        assert_eq!(indentation("<b/>", 0), "");
    }

    #[test]
    fn tag_name_ends_before_the_attributes() {
        assert_eq!(tag_name("<a:Group name='x'>"), "a:Group");
        assert_eq!(tag_name("<Group/>"), "Group");
    }
}
