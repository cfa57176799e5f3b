//! Outlines and skeletons of objects (OpenDRIVE 1.9, 13.2, 13.3).

use qcbus_document::Node;

use crate::geometry::Curve;
use crate::types::plan_view::{ShapeKind, read_curve};
use crate::types::view::{children, view};

view! {
    /// An `<outline>` (13.2).
    Outline {
        /// `@outer`; true when missing.
        outer: flag "outer",
        /// `@closed`.
        closed: flag "closed",
    }
}

impl<'a> Outline<'a> {
    /// Returns the corners and curves of all kinds in document order.
    pub fn corners(&self) -> impl Iterator<Item = Corner<'a>> + use<'a> {
        self.node.children().filter_map(Corner::read)
    }

    /// Returns the curves (13.2, since 1.9).
    pub fn curves(&self) -> impl Iterator<Item = CurveLocal<'a>> + use<'a> {
        self.node.children_named("curveLocal").map(CurveLocal::of)
    }
}

/// The kinds of points of an outline or a skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CornerKind {
    /// `<cornerRoad>`: in s, t and dz.
    Road,
    /// `<cornerLocal>`: in u, v and z of the object.
    Local,
    /// `<curveLocal>`: the start of a curve in u, v and z of the object.
    Curve,
}

/// A `<cornerRoad>`, `<cornerLocal>` or `<curveLocal>` of an outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner<'a> {
    /// Kind of the corner.
    pub kind: CornerKind,
    /// Coordinates of the corner.
    pub point: ObjectPoint<'a>,
}

impl<'a> Corner<'a> {
    fn read(node: Node<'a>) -> Option<Corner<'a>> {
        let kind = match node.name() {
            "cornerRoad" => CornerKind::Road,
            "cornerLocal" => CornerKind::Local,
            "curveLocal" => CornerKind::Curve,
            _ => return None,
        };
        let point = ObjectPoint::of(node);
        Some(Corner { kind, point })
    }
}

view! {
    /// A corner of an outline or a vertex of a skeleton. The element determines its coordinates.
    ObjectPoint {
        /// `@s` of a road point, in metres.
        s: number "s",
        /// `@t` of a road point, in metres.
        t: number "t",
        /// `@dz` of a road point: height above the reference line, in metres.
        dz: number "dz",
        /// `@u` of a local point, in metres.
        u: number "u",
        /// `@v` of a local point, in metres.
        v: number "v",
        /// `@z` of a local point, in metres.
        z: number "z",
        /// `@height` of the object at this point, in metres.
        height: number "height",
        /// `@radius` of the object at this point, in metres.
        radius: number "radius",
        /// `@width` of the object at this point, in metres.
        width: number "width",
        /// `@length` of the object at this point, or of the curve, in metres.
        length: number "length",
    }
}

view! {
    /// A `<curveLocal>` of an outline (13.2.3).
    CurveLocal {
        /// `@u` of the start, in metres.
        u: number "u",
        /// `@v` of the start, in metres.
        v: number "v",
        /// `@hdg` of the start in the local system, in radians.
        hdg: number "hdg",
        /// `@length`, in metres.
        length: number "length",
    }
}

impl<'a> CurveLocal<'a> {
    /// Returns the kind and element of the shape.
    pub fn shape(&self) -> Option<(ShapeKind, Node<'a>)> {
        self.node
            .children()
            .find_map(|child| Some((ShapeKind::of(child)?, child)))
    }

    /// Returns the shape as a curve, or `None` if a parameter is missing or malformed.
    pub fn curve(&self) -> Option<Curve> {
        let (kind, node) = self.shape()?;
        read_curve(kind, node, self.length().unwrap_or(f64::NAN))
    }
}

view! {
    /// A `<polyline>` of a skeleton (13.3).
    Polyline {}
}

impl<'a> Polyline<'a> {
    children! {
        /// The vertices in road coordinates.
        road_vertices: ObjectPoint "vertexRoad",
        /// The vertices in local coordinates.
        local_vertices: ObjectPoint "vertexLocal",
    }
}
