//! A map as a tree that can be edited: no more XML than the maps of this test use.

use std::fmt::Write;

/// An element by its place in [`Tree::elements`].
pub type Id = usize;

/// An element. Character data stands before the children, which is enough here.
#[derive(Debug, Clone, Default)]
pub struct Element {
    pub name: String,
    pub attributes: Vec<(String, String)>,
    pub text: String,
    pub children: Vec<Id>,
    pub parent: Option<Id>,
    /// Written without its end tag.
    pub unclosed: bool,
}

/// A document.
#[derive(Debug, Clone, Default)]
pub struct Tree {
    elements: Vec<Element>,
    root: Id,
}

impl Tree {
    /// Reads a well-formed document without comments.
    pub fn parse(text: &str) -> Tree {
        let mut tree = Tree::default();
        let body = text.find("?>").map_or(text, |end| &text[end + 2..]);
        tree.root = tree.read(body, None)[0];
        tree
    }

    /// Reads elements as children of `parent`, without adding them to its list.
    pub fn read(&mut self, text: &str, parent: Option<Id>) -> Vec<Id> {
        let (mut open, mut top, mut rest): (Vec<Id>, Vec<Id>, &str) =
            (Vec::new(), Vec::new(), text);
        while let Some(start) = rest.find('<') {
            if let Some(at) = open.last() {
                self.elements[*at].text.push_str(rest[..start].trim());
            }
            rest = &rest[start..];
            if let Some(data) = rest.strip_prefix("<![CDATA[") {
                let end = data.find("]]>").unwrap();
                let at = *open.last().unwrap();
                self.elements[at].text.push_str(&data[..end]);
                rest = &data[end + 3..];
                continue;
            }
            let end = rest.find('>').unwrap();
            let tag = &rest[1..end];
            rest = &rest[end + 1..];
            if tag.starts_with('/') {
                open.pop().unwrap();
                continue;
            }
            let id = self.elements.len();
            let above = open.last().copied();
            self.elements
                .push(element(tag.trim_end_matches('/'), above.or(parent)));
            match above {
                Some(above) => self.elements[above].children.push(id),
                None => top.push(id),
            }
            if !tag.ends_with('/') {
                open.push(id);
            }
        }
        assert!(
            open.is_empty() && !top.is_empty(),
            "not well-formed: {text}"
        );
        top
    }

    /// The document's text.
    pub fn text(&self) -> String {
        let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        self.write(self.root, &mut out);
        out
    }

    fn write(&self, id: Id, out: &mut String) {
        let element = &self.elements[id];
        write!(out, "<{}", element.name).unwrap();
        for (name, value) in &element.attributes {
            write!(out, " {name}=\"{value}\"").unwrap();
        }
        if element.children.is_empty() && element.text.is_empty() && !element.unclosed {
            out.push_str("/>\n");
            return;
        }
        write!(out, ">{}", element.text).unwrap();
        for child in &element.children {
            self.write(*child, out);
        }
        if !element.unclosed {
            writeln!(out, "</{}>", element.name).unwrap();
        }
    }

    /// The element.
    pub fn get(&self, id: Id) -> &Element {
        &self.elements[id]
    }

    /// The element, to be changed.
    pub fn get_mut(&mut self, id: Id) -> &mut Element {
        &mut self.elements[id]
    }

    /// All elements in document order.
    pub fn all(&self) -> Vec<Id> {
        let (mut all, mut open) = (Vec::new(), vec![self.root]);
        while let Some(id) = open.pop() {
            all.push(id);
            open.extend(self.elements[id].children.iter().rev());
        }
        all
    }

    /// The number of an element among its siblings of the same name, from 1.
    pub fn nth(&self, id: Id) -> usize {
        let Some(parent) = self.elements[id].parent else {
            return 1;
        };
        let named = |other: &&Id| self.elements[**other].name == self.elements[id].name;
        let same = self.elements[parent].children.iter().filter(named);
        1 + same.take_while(|other| **other != id).count()
    }

    /// The element's parent and its place there.
    pub fn place(&self, id: Id) -> (Id, usize) {
        let parent = self.elements[id].parent.unwrap();
        let siblings = &self.elements[parent].children;
        (
            parent,
            siblings.iter().position(|other| *other == id).unwrap(),
        )
    }
}

fn element(tag: &str, parent: Option<Id>) -> Element {
    let (name, mut rest) = tag.split_once(char::is_whitespace).unwrap_or((tag, ""));
    let mut attributes = Vec::new();
    while let Some((name, after)) = rest.split_once("=\"") {
        let (value, after) = after.split_once('"').unwrap();
        attributes.push((name.trim().to_owned(), value.to_owned()));
        rest = after;
    }
    Element {
        name: name.to_owned(),
        attributes,
        parent,
        ..Element::default()
    }
}
