//! Markings of objects and the outline points to which they refer.

use crate::families::ids::plain;
use crate::families::object_parts::{corners, objects, outlines};
use crate::prelude::*;

/// A `<marking>` with the object and the outline that contain it.
#[derive(Clone, Copy)]
pub(crate) struct Marking<'a> {
    /// The `<marking>` element.
    pub node: Node<'a>,
    /// The marked object.
    pub object: Node<'a>,
    /// The outline that contains the marking, or `None` for a marking of the object.
    pub outline: Option<Node<'a>>,
}

/// Returns the markings of objects and of their outlines.
pub(crate) fn markings<'a>(map: &RoadMap<'a>) -> impl Iterator<Item = Marking<'a>> + use<'a> {
    objects(map).flat_map(|object| {
        let of_outlines = outlines(object).flat_map(move |outline| {
            within(outline).map(move |node| Marking {
                node,
                object,
                outline: Some(outline),
            })
        });
        let of_object = within(object).map(move |node| Marking {
            node,
            object,
            outline: None,
        });
        of_object.chain(of_outlines)
    })
}

fn within(parent: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    parent
        .children_named("markings")
        .flat_map(|markings| markings.children_named("marking"))
}

impl<'a> Marking<'a> {
    /// Returns the corner references in document order.
    pub fn references(self) -> impl Iterator<Item = Node<'a>> {
        self.node.children_named("cornerReference")
    }

    /// Returns the references as positions in the outline, with the points of the outline. The
    /// outline is the one that contains the marking, or the only outline of the object, as before
    /// 1.9. Returns `None` without such an outline or if a reference cannot be resolved.
    pub fn path(self) -> Option<Path<'a>> {
        let outline = match self.outline {
            Some(outline) => outline,
            None => only(outlines(self.object))?,
        };
        let points: Vec<Node<'a>> = corners(outline).collect();
        let steps = self.references().map(|reference| {
            let id = plain(reference.attr("id")?);
            let index = points
                .iter()
                .position(|point| point.attr("id").map(plain) == Some(id))?;
            Some((reference, index))
        });
        let steps = steps.collect::<Option<Vec<_>>>()?;
        Some(Path {
            outline,
            points,
            steps,
        })
    }
}

/// The path of a marking along its outline.
pub(crate) struct Path<'a> {
    /// The outline.
    pub outline: Node<'a>,
    /// The points of the outline.
    pub points: Vec<Node<'a>>,
    /// Each corner reference with the position of its point.
    pub steps: Vec<(Node<'a>, usize)>,
}

impl Path<'_> {
    /// Checks whether the outline is declared as closed. `None` means that the type of the object
    /// decides.
    pub fn is_closed(&self) -> Option<bool> {
        match self.outline.attr("closed")?.trim() {
            "true" | "1" => Some(true),
            "false" | "0" => Some(false),
            _ => None,
        }
    }
}

fn only<'a>(mut nodes: impl Iterator<Item = Node<'a>>) -> Option<Node<'a>> {
    let first = nodes.next()?;
    nodes.next().is_none().then_some(first)
}
