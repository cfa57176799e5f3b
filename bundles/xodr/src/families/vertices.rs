//! Vertices of skeletons (OpenDRIVE 1.9, 13.3).

use crate::prelude::*;

/// The vertices of a polyline by kind.
pub(crate) struct Vertices<'a> {
    /// Vertices in road coordinates.
    pub road: Vec<Node<'a>>,
    /// Vertices in the object's coordinates.
    pub local: Vec<Node<'a>>,
}

impl<'a> Vertices<'a> {
    /// Returns the vertices of a polyline.
    pub fn of(polyline: Node<'a>) -> Vertices<'a> {
        Vertices {
            road: polyline.children_named("vertexRoad").collect(),
            local: polyline.children_named("vertexLocal").collect(),
        }
    }
}
