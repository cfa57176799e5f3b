//! Names of the elements of lanes, looked up once per document.

use qcbus_document::{Document, Node};

/// An element name that the model reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Name {
    /// Any other name.
    Other,
    Left,
    Center,
    Right,
    Lane,
    LaneSection,
    Link,
    Width,
    Border,
    Height,
    RoadMark,
    Material,
    Speed,
    Access,
    Rule,
    UserData,
    Predecessor,
    Successor,
}

impl Name {
    fn of(name: &str) -> Name {
        match name {
            "left" => Name::Left,
            "center" => Name::Center,
            "right" => Name::Right,
            "lane" => Name::Lane,
            "laneSection" => Name::LaneSection,
            "link" => Name::Link,
            "width" => Name::Width,
            "border" => Name::Border,
            "height" => Name::Height,
            "roadMark" => Name::RoadMark,
            "material" => Name::Material,
            "speed" => Name::Speed,
            "access" => Name::Access,
            "rule" => Name::Rule,
            "userData" => Name::UserData,
            "predecessor" => Name::Predecessor,
            "successor" => Name::Successor,
            _ => Name::Other,
        }
    }

    /// Returns the bit of the name in a set of names.
    pub(crate) fn bit(self) -> u32 {
        1 << (self as u32)
    }

    /// Returns the set with only this name. All unlisted names share one bit.
    pub(crate) fn bit_of(name: &str) -> u32 {
        Name::of(name).bit()
    }
}

/// The names of a document, by name number.
#[derive(Debug)]
pub(crate) struct Names(Vec<Name>);

impl Names {
    pub(crate) fn of(document: Document<'_>) -> Names {
        Names(document.names().map(Name::of).collect())
    }

    /// Returns the name of an element.
    pub(crate) fn name(&self, node: Node<'_>) -> Name {
        let name = self.0.get(usize::from(node.name_number())).copied();
        name.unwrap_or(Name::Other)
    }

    /// Returns the children of an element with this name.
    pub(crate) fn children<'a>(
        &self,
        node: Node<'a>,
        name: Name,
    ) -> impl Iterator<Item = Node<'a>> {
        node.children()
            .filter(move |child| self.name(*child) == name)
    }
}
