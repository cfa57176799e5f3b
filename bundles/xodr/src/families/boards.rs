//! Signals that carry boards (OpenDRIVE 1.9, 14.7).

use crate::families::object_parts::below;
use crate::prelude::*;

/// A signal with its boards.
#[derive(Clone, Copy)]
pub(crate) struct Carrier<'a> {
    /// The `<signal>`.
    pub node: Node<'a>,
    /// Its first board with fixed signs.
    pub fixed: Option<Node<'a>>,
    /// Its first board with variable messages.
    pub variable: Option<Node<'a>>,
}

/// Returns all signals with their boards.
pub(crate) fn carriers<'a>(map: &RoadMap<'a>) -> impl Iterator<Item = Carrier<'a>> + use<'a> {
    below(map, "signal", "signals").map(|node| Carrier {
        node,
        fixed: node.child("staticBoard"),
        variable: node.child("vmsBoard"),
    })
}

impl Carrier<'_> {
    /// Checks whether the type of the signal is this type of board.
    pub fn is_called(&self, kind: &str) -> bool {
        self.node.attr("type") == Some(kind)
    }
}
