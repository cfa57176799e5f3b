//! A plain tree that is written as XML and as an image at once, so its content is known without
//! parsing.

use qcbus_document::{BuildError, Capacities, ImageBuilder};

/// An element.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tree {
    /// Its name as written.
    pub name: String,
    /// Names and values.
    pub attributes: Vec<(String, String)>,
    /// Children of the element.
    pub children: Vec<Child>,
}

/// A child of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Child {
    /// Another element.
    Element(Tree),
    /// Character data.
    Text(String),
}

impl Tree {
    /// Creates an element without attributes and children.
    pub fn new(name: &str) -> Tree {
        Tree {
            name: name.to_owned(),
            ..Tree::default()
        }
    }

    /// Returns the same element with one more attribute.
    #[must_use]
    pub fn with(mut self, name: &str, value: &str) -> Tree {
        self.attributes.push((name.to_owned(), value.to_owned()));
        self
    }

    /// Returns the same element with one more child element.
    #[must_use]
    pub fn holding(mut self, child: Tree) -> Tree {
        self.children.push(Child::Element(child));
        self
    }

    /// Returns the same element with more character data.
    #[must_use]
    pub fn saying(mut self, text: &str) -> Tree {
        self.children.push(Child::Text(text.to_owned()));
        self
    }

    /// Returns the XML, one element per line.
    pub fn xml(&self) -> String {
        let mut writer = Writer::default();
        writer.element(self);
        writer.xml
    }

    /// Returns the image of a document at `path` with this content.
    ///
    /// # Errors
    /// If it has too many distinct names, or is larger than 4 GiB.
    pub fn image(&self, path: &str) -> Result<Vec<u8>, BuildError> {
        let mut writer = Writer::default();
        writer.element(self);
        let capacities = writer.capacities(path);
        let mut out = vec![0xA5; capacities.image_len()];
        let mut builder = ImageBuilder::new(&mut out, &capacities)?;
        builder.source(path, &writer.xml)?;
        writer
            .events
            .iter()
            .try_for_each(|event| event.feed(&mut builder))?;
        let used = builder.finish([0x11; 32])?;
        out.truncate(used);
        Ok(out)
    }
}

enum Event {
    Open {
        name: String,
        at: usize,
    },
    Attribute {
        name: String,
        at: usize,
        value_at: usize,
        raw_len: usize,
        resolved: Option<String>,
    },
    Text {
        start: usize,
        stop: usize,
        resolved: Option<String>,
    },
    Close {
        end: usize,
    },
}

impl Event {
    fn feed(&self, builder: &mut ImageBuilder<'_>) -> Result<(), BuildError> {
        let narrow = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        match self {
            Event::Open { name, at } => builder.open_element(name, narrow(*at)),
            Event::Attribute {
                name,
                at,
                value_at,
                raw_len,
                resolved,
            } => builder.attribute(
                name,
                narrow(*at),
                narrow(*value_at),
                narrow(*raw_len),
                resolved.as_deref(),
            ),
            Event::Text {
                start,
                stop,
                resolved,
            } => builder.text(narrow(*start), narrow(*stop), resolved.as_deref()),
            Event::Close { end } => builder.close_element(narrow(*end)),
        }
    }
}

#[derive(Default)]
struct Writer {
    xml: String,
    events: Vec<Event>,
}

impl Writer {
    fn element(&mut self, tree: &Tree) {
        self.events.push(Event::Open {
            name: tree.name.clone(),
            at: self.xml.len(),
        });
        self.xml.push('<');
        self.xml.push_str(&tree.name);
        for (name, value) in &tree.attributes {
            self.attribute(name, value);
        }
        self.xml.push_str(">\n");
        for child in &tree.children {
            match child {
                Child::Element(child) => self.element(child),
                Child::Text(text) => self.text(text),
            }
        }
        self.xml.push_str("</");
        self.xml.push_str(&tree.name);
        self.xml.push('>');
        self.events.push(Event::Close {
            end: self.xml.len(),
        });
        self.xml.push('\n');
    }

    fn attribute(&mut self, name: &str, value: &str) {
        self.xml.push(' ');
        let at = self.xml.len();
        self.xml.push_str(name);
        self.xml.push_str("=\"");
        let value_at = self.xml.len();
        let resolved = self.escape(value);
        let raw_len = self.xml.len() - value_at;
        self.xml.push('"');
        self.events.push(Event::Attribute {
            name: name.to_owned(),
            at,
            value_at,
            raw_len,
            resolved,
        });
    }

    fn text(&mut self, text: &str) {
        let start = self.xml.len();
        let resolved = self.escape(text);
        self.events.push(Event::Text {
            start,
            stop: self.xml.len(),
            resolved,
        });
    }

    /// Writes a value. Returns it if it had to be escaped.
    fn escape(&mut self, value: &str) -> Option<String> {
        let start = self.xml.len();
        for character in value.chars() {
            match character {
                '<' => self.xml.push_str("&lt;"),
                '&' => self.xml.push_str("&amp;"),
                '"' => self.xml.push_str("&quot;"),
                other => self.xml.push(other),
            }
        }
        (self.xml.len() - start != value.len()).then(|| value.to_owned())
    }

    /// Returns exact capacities, except for names.
    fn capacities(&self, path: &str) -> Capacities {
        let mut capacities = Capacities {
            text: self.xml.len(),
            heap: path.len(),
            sources: 1,
            ..Capacities::default()
        };
        for event in &self.events {
            match event {
                Event::Open { .. } => capacities.nodes += 1,
                Event::Attribute { resolved, .. } => {
                    capacities.attributes += 1;
                    capacities.heap += resolved
                        .as_ref()
                        .map_or(0, |value| value.len() + Capacities::PER_RESOLVED);
                }
                Event::Text { resolved, .. } => {
                    capacities.nodes += 1;
                    capacities.heap += resolved
                        .as_ref()
                        .map_or(0, |value| value.len() + Capacities::PER_RESOLVED);
                }
                Event::Close { .. } => {}
            }
        }
        capacities.names = capacities.nodes + capacities.attributes;
        capacities
    }
}
