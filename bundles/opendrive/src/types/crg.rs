//! CRG surfaces of roads, junctions and objects (OpenDRIVE 1.9, 10.6, 12.12, 13.13).

use crate::types::road::Road;
use crate::types::view::{listed, view};

impl<'a> Road<'a> {
    /// Returns the CRG records of the road's surface (10.6).
    pub fn crgs(&self) -> impl Iterator<Item = Crg<'a>> + use<'a> {
        listed(self.surface_node(), "CRG").map(Crg::of)
    }
}

view! {
    /// A `<CRG>` of a road, a junction or an object (10.6, 12.12, 13.13).
    Crg {
        /// `@mode`: `attached`, `attached0`, `genuine` or `global`.
        mode: text "mode",
        /// `@purpose`: `elevation` or `friction`.
        purpose: text "purpose",
        /// `@sStart`, in metres.
        s_start: number "sStart",
        /// `@sEnd`, in metres.
        s_end: number "sEnd",
        /// `@hideRoadSurfaceCRG` of an object's surface.
        hides_road_surface: flag "hideRoadSurfaceCRG",
    }
}
