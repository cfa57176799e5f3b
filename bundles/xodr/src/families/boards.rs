//! Signals that carry boards (OpenDRIVE 1.9, 14.7).

use qcbus_document::Node;
use qcbus_opendrive::RoadMap;

use crate::families::object_parts::below;

/// A signal and which boards it has.
#[derive(Clone, Copy)]
pub(crate) struct Carrier<'a> {
    /// The `<signal>`.
    pub node: Node<'a>,
    /// Its first board with fixed signs.
    pub fixed: Option<Node<'a>>,
    /// Its first board with variable messages.
    pub variable: Option<Node<'a>>,
}

/// All signals.
pub(crate) fn carriers<'a>(map: &RoadMap<'a>) -> impl Iterator<Item = Carrier<'a>> + use<'a> {
    below(map, "signal", "signals").map(|node| Carrier {
        node,
        fixed: node.child("staticBoard"),
        variable: node.child("vmsBoard"),
    })
}

impl Carrier<'_> {
    /// Whether the signal says that it is a board of this type.
    pub fn is_called(&self, kind: &str) -> bool {
        self.node.attr("type") == Some(kind)
    }
}
