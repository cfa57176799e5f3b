//! Scanner for the elements and attributes in a file's text. Edits change only parts of the text,
//! so the tree is never serialised. It also handles files that are not well-formed.

use std::ops::Range;

/// An element, as byte ranges.
#[derive(Debug)]
pub struct Element {
    /// Its name.
    pub name: Range<usize>,
    /// Its attributes.
    pub attributes: Vec<Attribute>,
    /// From its `<` to just after the `>`.
    pub start_tag: Range<usize>,
    /// `None` if the element is self-closing or never closed.
    pub end_tag: Option<Range<usize>>,
    /// End of the whole element.
    pub end: usize,
    /// Whether it is self-closing, without content and end tag.
    pub closes_itself: bool,
    /// Index of the parent among the elements of the file.
    pub parent: Option<usize>,
}

/// An attribute, as byte ranges.
#[derive(Debug)]
pub struct Attribute {
    /// Its name.
    pub name: Range<usize>,
    /// The attribute with its quotes and the blanks before it.
    pub whole: Range<usize>,
    /// The value without its quotes.
    pub value: Range<usize>,
}

/// A text and its elements, in document order.
pub struct Scan<'t> {
    /// The text.
    pub text: &'t str,
    /// The elements.
    pub elements: Vec<Element>,
}

impl<'t> Scan<'t> {
    /// Scans the elements of a text.
    ///
    /// # Errors
    /// Returns an error for an invalid tag.
    pub fn of(text: &'t str) -> Result<Scan<'t>, String> {
        let mut scan = Scan {
            text,
            elements: Vec::new(),
        };
        let (mut open, mut at) = (Vec::new(), 0);
        while let Some(start) = text[at..].find('<').map(|found| at + found) {
            at = scan.piece(start, &mut open)?;
        }
        for id in open {
            scan.elements[id].end = text.len();
        }
        Ok(scan)
    }

    /// Scans one tag, comment or similar item. Returns its end.
    fn piece(&mut self, start: usize, open: &mut Vec<usize>) -> Result<usize, String> {
        const OTHERS: [(&str, &str); 4] = [
            ("<!--", "-->"),
            ("<![CDATA[", "]]>"),
            ("<?", "?>"),
            ("<!", ">"),
        ];
        let rest = &self.text[start..];
        if let Some((_, end)) = OTHERS.iter().find(|(begin, _)| rest.starts_with(begin)) {
            return behind(self.text, start, end);
        }
        if rest.starts_with("</") {
            let end = behind(self.text, start, ">")?;
            self.close(start..end, open);
            return Ok(end);
        }
        let mut element = element(self.text, start)?;
        element.parent = open.last().copied();
        let (end, closes_itself) = (element.end, element.closes_itself);
        self.elements.push(element);
        if !closes_itself {
            open.push(self.elements.len() - 1);
        }
        Ok(end)
    }

    /// Closes the element of an end tag. Elements that are still open inside of it end with it.
    fn close(&mut self, tag: Range<usize>, open: &mut Vec<usize>) {
        let name = self.text[tag.start + 2..tag.end - 1].trim();
        let is = |id: &usize| &self.text[self.elements[*id].name.clone()] == name;
        let Some(depth) = open.iter().rposition(is) else {
            return;
        };
        let named = open[depth];
        for id in open.drain(depth..) {
            self.elements[id].end = tag.end;
        }
        self.elements[named].end_tag = Some(tag);
    }

    /// Returns the name of an element.
    pub fn name(&self, id: usize) -> &'t str {
        &self.text[self.elements[id].name.clone()]
    }

    /// Returns an attribute of an element.
    pub fn attribute(&self, id: usize, name: &str) -> Option<&Attribute> {
        let mut attributes = self.elements[id].attributes.iter();
        attributes.find(|it| &self.text[it.name.clone()] == name)
    }

    /// Returns the value of an attribute, as it is written.
    pub fn value(&self, id: usize, name: &str) -> Option<&'t str> {
        let attribute = self.attribute(id, name)?;
        Some(&self.text[attribute.value.clone()])
    }

    /// Returns the elements with the same parent, including itself.
    pub fn siblings(&self, id: usize) -> impl Iterator<Item = usize> {
        let parent = self.elements[id].parent;
        let all = self.elements.iter().enumerate();
        all.filter(move |(_, it)| it.parent == parent)
            .map(|(other, _)| other)
    }

    /// Returns the row of a byte, from 1.
    pub fn row(&self, at: usize) -> u64 {
        row(self.text, at)
    }

    /// Returns the rows of an element's start tag.
    pub fn rows(&self, id: usize) -> std::ops::RangeInclusive<u64> {
        let tag = &self.elements[id].start_tag;
        self.row(tag.start)..=self.row(tag.end)
    }
}

pub fn row(text: &str, at: usize) -> u64 {
    1 + lines(&text[..at]) as u64
}

/// Returns the number of line breaks in a text.
pub fn lines(text: &str) -> usize {
    text.bytes().filter(|byte| *byte == b'\n').count()
}

fn behind(text: &str, start: usize, end: &str) -> Result<usize, String> {
    let found = text[start..].find(end);
    found
        .map(|found| start + found + end.len())
        .ok_or_else(|| format!("no `{end}` after row {}", row(text, start)))
}

fn element(text: &str, start: usize) -> Result<Element, String> {
    let odd = || format!("no tag in row {}", row(text, start));
    let name = name(text, start + 1).ok_or_else(odd)?;
    let mut at = name.end;
    let mut attributes = Vec::new();
    while let Some(attribute) = attribute(text, at) {
        at = attribute.whole.end;
        attributes.push(attribute);
    }
    at = blanks(text, at);
    let closes_itself = text[at..].starts_with('/');
    at += usize::from(closes_itself);
    if !text[at..].starts_with('>') {
        return Err(odd());
    }
    Ok(Element {
        name,
        attributes,
        start_tag: start..at + 1,
        end_tag: None,
        end: at + 1,
        closes_itself,
        parent: None,
    })
}

fn attribute(text: &str, start: usize) -> Option<Attribute> {
    let named = blanks(text, start);
    if named == start {
        return None;
    }
    let name = name(text, named)?;
    let equals = blanks(text, name.end);
    let rest = text[equals..].strip_prefix('=')?;
    let quoted = blanks(text, text.len() - rest.len());
    let quote = text[quoted..]
        .chars()
        .next()
        .filter(|c| matches!(c, '"' | '\''))?;
    let value = quoted + 1..quoted + 1 + text[quoted + 1..].find(quote)?;
    Some(Attribute {
        name,
        whole: start..value.end + 1,
        value,
    })
}

fn name(text: &str, start: usize) -> Option<Range<usize>> {
    let rest = &text[start..];
    let is_name = |c: char| c.is_alphanumeric() || matches!(c, '_' | ':' | '.' | '-');
    let end = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
    let first = rest.chars().next()?;
    (first.is_alphabetic() || first == '_').then_some(start..start + end)
}

fn blanks(text: &str, start: usize) -> usize {
    text.len() - text[start..].trim_ascii_start().len()
}
