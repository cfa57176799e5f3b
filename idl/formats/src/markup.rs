//! Writing of XML: tags, indentation and escapes.

use std::fmt::Write as _;

use crate::xml::is_xml_char;

/// First bytes of characters that need a check: control characters, characters with a meaning in
/// markup, and one byte beyond ASCII. U+FFFE and U+FFFF, which XML does not allow, begin with it,
/// like all characters from U+F000. A byte in the middle of a character is never among them.
static SPECIAL: [bool; 256] = {
    let mut special = [false; 256];
    let mut control = 0;
    while control < b' ' {
        special[control as usize] = true;
        control += 1;
    }
    special[b'<' as usize] = true;
    special[b'>' as usize] = true;
    special[b'&' as usize] = true;
    special[b'"' as usize] = true;
    special[0xEF] = true;
    special
};

/// A text to which elements are appended, indented by two spaces for each level.
#[derive(Debug, Default)]
pub struct Markup {
    text: String,
    depth: usize,
}

impl Markup {
    /// Starts a document at the end of a text.
    pub fn new(mut text: String) -> Markup {
        text.push_str("<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"no\"?>\n");
        Markup { text, depth: 0 }
    }

    /// Returns the whole text.
    pub fn finish(self) -> String {
        self.text
    }

    /// Writes the start tag of an element with children.
    pub fn open(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.indent();
        self.tag(name, attributes);
        self.text.push_str(">\n");
        self.depth += 1;
    }

    /// Writes the end tag of an element with children.
    pub fn close(&mut self, name: &str) {
        self.depth -= 1;
        self.indent();
        self.end_tag(name);
        self.text.push('\n');
    }

    /// Writes an element without content.
    pub fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.indent();
        self.tag(name, attributes);
        self.text.push_str("/>\n");
    }

    /// Writes the indentation of the current level.
    pub fn indent(&mut self) {
        for _ in 0..self.depth {
            self.text.push_str("  ");
        }
    }

    /// Appends a text unchanged.
    pub fn raw(&mut self, text: &str) {
        self.text.push_str(text);
    }

    /// Writes `<name a="…"`, without the end of the tag.
    pub fn tag(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.text.push('<');
        self.text.push_str(name);
        for (name, value) in attributes {
            self.text.push(' ');
            self.text.push_str(name);
            self.text.push_str("=\"");
            self.escape(value, true);
            self.text.push('"');
        }
    }

    /// Writes `</name>`.
    pub fn end_tag(&mut self, name: &str) {
        self.text.push_str("</");
        self.text.push_str(name);
        self.text.push('>');
    }

    /// Writes a text as character data.
    pub fn characters(&mut self, text: &str) {
        self.escape(text, false);
    }

    /// Escapes characters with a meaning in markup. Readers turn white space in attributes into
    /// spaces, so it is written by number. So is a carriage return in text. Characters that XML
    /// does not allow become U+FFFD.
    pub fn escape(&mut self, value: &str, attribute: bool) {
        let mut rest = value;
        while let Some(at) = rest.bytes().position(|byte| SPECIAL[usize::from(byte)]) {
            self.text.push_str(&rest[..at]);
            let Some(c) = rest[at..].chars().next() else {
                break;
            };
            match c {
                '<' => self.text.push_str("&lt;"),
                '>' => self.text.push_str("&gt;"),
                '&' => self.text.push_str("&amp;"),
                '"' if attribute => self.text.push_str("&quot;"),
                '\r' => self.number(c),
                '\t' | '\n' if attribute => self.number(c),
                c if is_xml_char(c) => self.text.push(c),
                _ => self.text.push('\u{FFFD}'),
            }
            rest = &rest[at + c.len_utf8()..];
        }
        self.text.push_str(rest);
    }

    fn number(&mut self, c: char) {
        // Writing to a string cannot fail.
        let _ = write!(self.text, "&#{};", u32::from(c));
    }
}
