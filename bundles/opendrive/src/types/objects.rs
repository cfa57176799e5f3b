//! Objects (OpenDRIVE 1.9, chapter 13).

use crate::types::crg::Crg;
use crate::types::outlines::{Outline, Polyline};
use crate::types::road::Road;
use crate::types::view::{children, listed, view};

impl<'a> Road<'a> {
    /// Returns the objects of the road (13.1).
    pub fn objects(&self) -> impl Iterator<Item = Object<'a>> + use<'a> {
        listed(self.objects_node(), "object").map(Object::of)
    }

    /// Returns the references to objects of other roads (13.10).
    pub fn object_references(&self) -> impl Iterator<Item = ObjectReference<'a>> + use<'a> {
        listed(self.objects_node(), "objectReference").map(ObjectReference::of)
    }
}

view! {
    /// An `<object>` (13.1).
    Object {
        /// `@id`.
        id: text "id",
        /// `@type`.
        kind: text "type",
        /// `@s`, in metres.
        s: number "s",
        /// `@t`, in metres.
        t: number "t",
        /// `@zOffset` above the elevation at s, in metres.
        z_offset: number "zOffset",
        /// `@hdg` relative to the road, in radians.
        hdg: number "hdg",
        /// `@pitch`, in radians.
        pitch: number "pitch",
        /// `@roll`, in radians.
        roll: number "roll",
        /// `@perpToRoad`.
        perp_to_road: flag "perpToRoad",
        /// `@length` of the bounding box, in metres.
        length: number "length",
        /// `@width` of the bounding box, in metres.
        width: number "width",
        /// `@radius` of the bounding cylinder, in metres.
        radius: number "radius",
        /// `@height` of the bounding volume, in metres.
        height: number "height",
    }
}

impl<'a> Object<'a> {
    children! {
        /// The `<repeat>` records (13.4).
        repeats: Repeat "repeat",
    }

    /// Returns the outlines (13.2): in `<outlines>`, or directly in the object as before 1.5.
    pub fn outlines(&self) -> impl Iterator<Item = Outline<'a>> + use<'a> {
        let old = self.node.children_named("outline");
        listed(self.node.child("outlines"), "outline")
            .chain(old)
            .map(Outline::of)
    }

    /// Returns the polylines of the skeleton (13.3).
    pub fn polylines(&self) -> impl Iterator<Item = Polyline<'a>> + use<'a> {
        listed(self.node.child("skeleton"), "polyline").map(Polyline::of)
    }

    /// Returns the CRG records of the object's surface (13.13).
    pub fn crgs(&self) -> impl Iterator<Item = Crg<'a>> + use<'a> {
        listed(self.node.child("surface"), "CRG").map(Crg::of)
    }
}

view! {
    /// A `<repeat>` of an object (13.4).
    Repeat {
        /// `@s` of the first instance, in metres.
        s: number "s",
        /// `@length` along the reference line, in metres.
        length: number "length",
        /// `@distance` between two instances, in metres. Zero means a continuous object.
        distance: number "distance",
        /// `@tStart`, in metres.
        t_start: number "tStart",
        /// `@tEnd`, in metres.
        t_end: number "tEnd",
        /// `@bT`: linear coefficient of t (since 1.9).
        b_t: number "bT",
        /// `@cT`: quadratic coefficient of t (since 1.9).
        c_t: number "cT",
        /// `@dT`: cubic coefficient of t (since 1.9).
        d_t: number "dT",
        /// `@detachFromReferenceLine`.
        detached: flag "detachFromReferenceLine",
    }
}

view! {
    /// An `<objectReference>` (13.10).
    ObjectReference {
        /// `@id` of the object.
        id: text "id",
    }
}

view! {
    /// A `<validity>`: the lanes for which an element is valid (13.6, 14.2).
    Validity {
        /// `@fromLane`.
        from_lane: integer "fromLane",
        /// `@toLane`.
        to_lane: integer "toLane",
        /// `@layer`; permanent when missing.
        layer: layer "layer",
    }
}
