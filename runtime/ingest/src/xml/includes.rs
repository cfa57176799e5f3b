//! Finds `<include>` elements in advance, so that their files can be read before the parse.

use quick_xml::events::Event;

use super::parser::{lenient, marks, offset};
use super::tag::AttributeScanner;
use super::value::attribute_value;

/// An `<include>` element of OpenDRIVE.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Include {
    /// Offset of its `<`.
    pub at: usize,
    /// Its attribute `file`.
    pub file: Option<String>,
}

/// Returns the includes of a text in order, up to the point where quick-xml fails. Comments and
/// CDATA sections are ignored.
pub(crate) fn includes_of(text: &str) -> Vec<Include> {
    if !text.contains("<include") {
        return Vec::new();
    }
    let mut found = Vec::new();
    visit_tags(text, |name, at, inside| {
        if name == "include" {
            found.push(Include {
                at,
                file: file_attribute(text, inside),
            });
        }
        true
    });
    found
}

/// Returns the name of the first element of a text.
pub(crate) fn first_element(text: &str) -> Option<&str> {
    let mut first = None;
    visit_tags(text, |name, _, _| {
        first = Some(name);
        false
    });
    first
}

/// Calls `visit` for each start tag with its name, its offset and the range of its attributes.
/// Stops when `visit` returns `false`.
fn visit_tags<'t>(
    text: &'t str,
    mut visit: impl FnMut(&'t str, usize, std::ops::Range<usize>) -> bool,
) {
    let (_, body) = marks(text);
    let mut reader = lenient(&text[body..]);
    loop {
        let from = body + offset(reader.buffer_position());
        let (len, tail) = match reader.read_event() {
            Ok(Event::Start(tag)) => (tag.name().as_ref().len(), 1),
            Ok(Event::Empty(tag)) => (tag.name().as_ref().len(), 2),
            Ok(Event::Eof) | Err(_) => return,
            Ok(_) => continue,
        };
        let name_end = from + 1 + len;
        let to = body + offset(reader.buffer_position()) - tail;
        if !visit(&text[from + 1..name_end], from, name_end..to) {
            return;
        }
    }
}

fn file_attribute(text: &str, inside: std::ops::Range<usize>) -> Option<String> {
    let attribute = AttributeScanner::new(text, inside)
        .map_while(Result::ok)
        .find(|attribute| &text[attribute.name.clone()] == "file")?;
    let mut value = String::new();
    attribute_value(&text[attribute.value], &mut value, &mut Vec::new());
    Some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_effective_includes_are_found() {
        let text = "\u{FEFF}<a><!-- <include file='no'/> --><include file='b &amp; c.xml'/>\
                    <![CDATA[<include file='no'/>]]><include/></a>";
        let found = includes_of(text);
        let files: Vec<Option<&str>> = found
            .iter()
            .map(|include| include.file.as_deref())
            .collect();
        assert_eq!(files, [Some("b & c.xml"), None]);
        assert!(text[found[0].at..].starts_with("<include file='b"));
        assert_eq!(first_element(text), Some("a"));
        assert_eq!(first_element("  "), None);
    }
}
