//! The element tree and its parser.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::attributes::{reference, scan};
use super::decode::decode;
use super::{Fault, MAX_DEPTH, XmlError, is_name, is_xml_char};

/// A well-formed file.
#[derive(Debug)]
pub(crate) struct Document {
    text: String,
    /// Byte offsets of the line starts.
    lines: Vec<usize>,
    /// The root element.
    pub root: Element,
}

/// An element.
#[derive(Debug, Default)]
pub(crate) struct Element {
    /// Name as written, with its prefix.
    pub name: String,
    /// Attributes in order.
    pub attributes: Vec<Attribute>,
    /// Content, in order.
    pub content: Vec<Node>,
    /// Byte offset of `<` in the text.
    pub offset: usize,
}

/// Content of an element.
#[derive(Debug)]
pub(crate) enum Node {
    /// A child element.
    Element(Element),
    /// Character data, never empty.
    Text(String),
}

/// An attribute.
#[derive(Debug)]
pub(crate) struct Attribute {
    /// Name as written, with its prefix.
    pub name: String,
    /// Value.
    pub value: String,
    /// Byte offset of the name in the text.
    pub offset: usize,
}

impl Document {
    /// Returns row and column, both from 1, of a byte offset of the text.
    pub fn place(&self, offset: usize) -> (u64, u64) {
        let row = self.lines.partition_point(|start| *start <= offset);
        let start = row
            .checked_sub(1)
            .and_then(|i| self.lines.get(i))
            .copied()
            .unwrap_or(0);
        let column = self
            .text
            .get(start..offset)
            .map_or(0, |line| line.chars().count());
        (row as u64, column as u64 + 1)
    }
}

impl Element {
    /// Returns the name without its prefix.
    pub fn local_name(&self) -> &str {
        self.name
            .rsplit_once(':')
            .map_or(self.name.as_str(), |(_, local)| local)
    }

    /// Returns the child elements.
    pub fn children(&self) -> impl Iterator<Item = &Element> {
        self.content.iter().filter_map(|node| match node {
            Node::Element(element) => Some(element),
            Node::Text(_) => None,
        })
    }

    /// Returns the attribute of this name.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes
            .iter()
            .find(|attribute| attribute.name == name)
    }

    /// Returns the value of the attribute of this name.
    pub fn value(&self, name: &str) -> Option<&str> {
        self.attribute(name)
            .map(|attribute| attribute.value.as_str())
    }
}

/// Returns row and column, both from 1, of a byte offset.
pub(super) fn row_column(text: &str, offset: usize) -> (u64, u64) {
    let before = text.get(..offset).unwrap_or(text);
    let row = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
    let line = before.rsplit_once('\n').map_or(before, |(_, line)| line);
    (row as u64, line.chars().count() as u64 + 1)
}

/// Parses a file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Document, XmlError> {
    let text = decode(bytes)?;
    let read = Builder::new(&text).read();
    match read {
        Ok(root) => {
            let starts = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
            let lines = std::iter::once(0)
                .chain(starts.map(|(i, _)| i + 1))
                .collect();
            Ok(Document { text, lines, root })
        }
        Err(Fault {
            offset,
            text: what,
            hint,
        }) => {
            let (row, column) = row_column(&text, offset);
            Err(XmlError {
                row,
                column,
                text: what,
                hint,
            })
        }
    }
}

struct Builder<'t> {
    text: &'t str,
    open: Vec<Element>,
    root: Option<Element>,
}

impl<'t> Builder<'t> {
    fn new(text: &'t str) -> Self {
        Builder {
            text,
            open: Vec::new(),
            root: None,
        }
    }

    fn read(mut self) -> Result<Element, Fault> {
        if let Some((offset, c)) = self.text.char_indices().find(|(_, c)| !is_xml_char(*c)) {
            let what = format!("the character U+{:04X} is not allowed in XML", u32::from(c));
            return Err(Fault::new(offset, what));
        }
        let mut reader = Reader::from_str(self.text);
        // End tags are compared here, because this error can show where the element was opened.
        reader.config_mut().check_end_names = false;
        reader.config_mut().allow_unmatched_ends = true;
        loop {
            let at = usize::try_from(reader.buffer_position()).unwrap_or(self.text.len());
            match reader.read_event() {
                Ok(Event::Eof) => return self.finish(),
                Ok(event) => self.event(event, at)?,
                Err(error) => return Err(self.syntax(at, &error)),
            }
        }
    }

    fn event(&mut self, event: Event<'_>, at: usize) -> Result<(), Fault> {
        match event {
            Event::Start(tag) => self.start(&tag, at, false),
            Event::Empty(tag) => self.start(&tag, at, true),
            Event::End(tag) => self.end(tag.name().as_ref(), at),
            Event::Text(text) => self.characters(&text.xml10_content(), at),
            Event::CData(text) if self.open.is_empty() => Err(outside(&text, at)),
            Event::CData(text) => {
                self.append(&text.xml10_content());
                Ok(())
            }
            Event::GeneralRef(name) if self.open.is_empty() => Err(outside(&name, at)),
            Event::GeneralRef(name) => {
                self.append(reference(&name, at)?.encode_utf8(&mut [0; 4]));
                Ok(())
            }
            Event::DocType(_) => {
                let hint = "remove the DOCTYPE: these formats do not use one";
                Err(Fault::new(at, "a DOCTYPE is not allowed").with_hint(hint))
            }
            Event::Decl(_) if at > 0 && self.text[..at] != *"\u{FEFF}" => Err(Fault::new(
                at,
                "the XML declaration is not at the start of the file",
            )),
            Event::Decl(_) | Event::PI(_) | Event::Comment(_) | Event::Eof => Ok(()),
        }
    }

    fn start(&mut self, tag: &BytesStart<'_>, at: usize, empty: bool) -> Result<(), Fault> {
        if self.open.is_empty() && self.root.is_some() {
            let what = format!("a second root element `<{}>`", tag.name().as_ref());
            return Err(Fault::new(at, what));
        }
        if self.open.len() >= MAX_DEPTH {
            let what = format!("elements are nested deeper than {MAX_DEPTH} levels");
            return Err(Fault::new(at, what));
        }
        let name = tag.name();
        let name = name.as_ref();
        if !is_name(name) {
            return Err(
                Fault::new(at, format!("`<{name}` does not start an element"))
                    .with_hint("write a plain < as &lt;"),
            );
        }
        let raw = scan(tag.attributes_raw(), at + 1 + name.len())?;
        let attributes = raw.into_iter().map(|attribute| Attribute {
            name: attribute.name.to_owned(),
            value: attribute.value.into_owned(),
            offset: attribute.offset,
        });
        let name = name.to_owned();
        let attributes = attributes.collect();
        self.open.push(Element {
            name,
            attributes,
            content: Vec::new(),
            offset: at,
        });
        if empty { self.close(at) } else { Ok(()) }
    }

    fn end(&mut self, name: &str, at: usize) -> Result<(), Fault> {
        let name = name.trim_end();
        match self.open.last() {
            None => Err(Fault::new(at, format!("`</{name}>` closes no element"))),
            Some(open) if open.name == name => self.close(at),
            Some(open) => {
                let (row, _) = row_column(self.text, open.offset);
                let what = format!(
                    "found `</{name}>`, expected `</{}>`, which was opened in row {row}",
                    open.name
                );
                Err(Fault::new(at, what))
            }
        }
    }

    fn close(&mut self, at: usize) -> Result<(), Fault> {
        let Some(element) = self.open.pop() else {
            return Err(Fault::new(at, "an end tag closes no element"));
        };
        match self.open.last_mut() {
            Some(parent) => parent.content.push(Node::Element(element)),
            None => self.root = Some(element),
        }
        Ok(())
    }

    fn characters(&mut self, text: &str, at: usize) -> Result<(), Fault> {
        if !self.open.is_empty() {
            self.append(text);
            return Ok(());
        }
        let text = if at == 0 {
            text.trim_start_matches('\u{FEFF}')
        } else {
            text
        };
        if text.trim().is_empty() {
            Ok(())
        } else {
            Err(outside(text, at))
        }
    }

    fn append(&mut self, text: &str) {
        let Some(open) = self.open.last_mut() else {
            return;
        };
        match open.content.last_mut() {
            _ if text.is_empty() => {}
            Some(Node::Text(before)) => before.push_str(text),
            _ => open.content.push(Node::Text(text.to_owned())),
        }
    }

    fn finish(mut self) -> Result<Element, Fault> {
        match (self.open.pop(), self.root.take()) {
            (Some(open), _) => Err(Fault::new(
                open.offset,
                format!("`<{}>` is never closed", open.name),
            )),
            (None, Some(root)) => Ok(root),
            (None, None) => Err(Fault::new(0, "the file contains no element")),
        }
    }

    /// Returns the error for markup at `at` that the tokenizer could not parse. If it is a tag, its
    /// attributes are parsed again for a more precise error.
    fn syntax(&self, at: usize, error: &quick_xml::Error) -> Fault {
        let rest = self.text.get(at..).unwrap_or("");
        if let Some(tag) = rest.strip_prefix('<') {
            let stops = [' ', '\t', '\r', '\n', '>', '/', '"', '\'', '<'];
            let length = tag.find(stops).unwrap_or(tag.len());
            let base = at + 1 + length;
            if is_name(&tag[..length]) {
                return match scan(&self.text[base..], base) {
                    Err(fault) => fault,
                    Ok(_) => Fault::new(at, format!("`<{}` is never closed", &tag[..length])),
                };
            }
        }
        Fault::new(at, error.to_string())
    }
}

/// Returns the error for text outside of the root element.
fn outside(text: &str, at: usize) -> Fault {
    let shown: String = text.trim_start().chars().take(20).collect();
    let offset = at + (text.len() - text.trim_start().len());
    Fault::new(offset, format!("text outside the root element: `{shown}`"))
}
