//! A small, strict tree reader over quick-xml for files of a few elements. Every element and
//! attribute knows its position. Errors in the syntax point at the place that a person must fix.

mod attributes;
mod decode;
mod tree;

pub(crate) use tree::{Document, Element, Node, parse};

/// Maximum nesting depth of elements. No file of these formats needs more, and later recursion
/// cannot overflow the stack.
pub(crate) const MAX_DEPTH: usize = 96;

/// Syntax error and its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct XmlError {
    /// Line, from 1.
    pub row: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// Description of the error.
    pub text: String,
    /// How to fix it; may be empty.
    pub hint: &'static str,
}

/// An error at a byte offset of the text.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Fault {
    offset: usize,
    text: String,
    hint: &'static str,
}

impl Fault {
    fn new(offset: usize, text: impl Into<String>) -> Fault {
        Fault {
            offset,
            text: text.into(),
            hint: "",
        }
    }

    fn with_hint(self, hint: &'static str) -> Fault {
        Fault { hint, ..self }
    }
}

/// Checks whether XML 1.0 allows the character in a document.
pub(crate) fn is_xml_char(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r' | '\u{20}'..='\u{D7FF}' | '\u{E000}'..='\u{FFFD}' | '\u{10000}'..)
}

/// Checks whether the text is a name (XML 1.0, fifth edition, productions 4 and 4a).
pub(crate) fn is_name(text: &str) -> bool {
    let mut chars = text.chars();
    chars.next().is_some_and(is_name_start) && chars.all(is_name_char)
}

pub(crate) fn is_name_start(c: char) -> bool {
    matches!(c, ':' | '_' | 'A'..='Z' | 'a'..='z' | '\u{C0}'..='\u{D6}' | '\u{D8}'..='\u{F6}'
        | '\u{F8}'..='\u{2FF}' | '\u{370}'..='\u{37D}' | '\u{37F}'..='\u{1FFF}'
        | '\u{200C}'..='\u{200D}' | '\u{2070}'..='\u{218F}' | '\u{2C00}'..='\u{2FEF}'
        | '\u{3001}'..='\u{D7FF}' | '\u{F900}'..='\u{FDCF}' | '\u{FDF0}'..='\u{FFFD}'
        | '\u{10000}'..='\u{EFFFF}')
}

pub(crate) fn is_name_char(c: char) -> bool {
    is_name_start(c)
        || matches!(c, '-' | '.' | '0'..='9' | '\u{B7}' | '\u{300}'..='\u{36F}'
            | '\u{203F}'..='\u{2040}')
}
