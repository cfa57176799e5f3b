//! Where the elements and attributes of a file's text are: edits change the text and leave the rest of it alone,
//! so no tree is written again. A file that is not well-formed has elements, too.

use std::ops::Range;

/// An element, by its bytes.
#[derive(Debug)]
pub struct Element {
    /// Its name.
    pub name: Range<usize>,
    /// Its attributes.
    pub attributes: Vec<Attribute>,
    /// From its `<` to behind the `>`.
    pub start_tag: Range<usize>,
    /// None when it closes itself or is never closed.
    pub end_tag: Option<Range<usize>>,
    /// Behind all of it.
    pub end: usize,
    /// Without content and end tag.
    pub closes_itself: bool,
    /// Number among the elements of the file.
    pub parent: Option<usize>,
}

/// An attribute, by its bytes.
#[derive(Debug)]
pub struct Attribute {
    /// Its name.
    pub name: Range<usize>,
    /// With the blanks before it and its quotes.
    pub whole: Range<usize>,
    /// Without its quotes.
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
    /// Where the elements of a text are.
    ///
    /// # Errors
    /// When a tag is no tag.
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

    /// One tag, comment or the like; returns where it ends.
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

    /// Whatever is open inside of the element ends with it.
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

    /// The name of an element.
    pub fn name(&self, id: usize) -> &'t str {
        &self.text[self.elements[id].name.clone()]
    }

    /// An attribute of an element.
    pub fn attribute(&self, id: usize, name: &str) -> Option<&Attribute> {
        let mut attributes = self.elements[id].attributes.iter();
        attributes.find(|it| &self.text[it.name.clone()] == name)
    }

    /// The value of one, as it is written.
    pub fn value(&self, id: usize, name: &str) -> Option<&'t str> {
        let attribute = self.attribute(id, name)?;
        Some(&self.text[attribute.value.clone()])
    }

    /// The elements with the same parent, itself included.
    pub fn siblings(&self, id: usize) -> impl Iterator<Item = usize> {
        let parent = self.elements[id].parent;
        let all = self.elements.iter().enumerate();
        all.filter(move |(_, it)| it.parent == parent)
            .map(|(other, _)| other)
    }

    /// The row of a byte, from 1.
    pub fn row(&self, at: usize) -> u64 {
        row(self.text, at)
    }

    /// The rows of an element's start tag.
    pub fn rows(&self, id: usize) -> std::ops::RangeInclusive<u64> {
        let tag = &self.elements[id].start_tag;
        self.row(tag.start)..=self.row(tag.end)
    }
}

pub fn row(text: &str, at: usize) -> u64 {
    1 + lines(&text[..at]) as u64
}

/// How many ends of lines a text has.
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
