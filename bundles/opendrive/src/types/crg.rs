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
        /// `@file`.
        file: text "file",
        /// `@mode`: `attached`, `attached0`, `genuine` or `global`.
        mode: text "mode",
        /// `@purpose`: `elevation` or `friction`.
        purpose: text "purpose",
        /// `@orientation`: `same` or `opposite`.
        orientation: text "orientation",
        /// `@sStart`, in metres.
        s_start: number "sStart",
        /// `@sEnd`, in metres.
        s_end: number "sEnd",
        /// `@sOffset`, in metres.
        s_offset: number "sOffset",
        /// `@tOffset`, in metres.
        t_offset: number "tOffset",
        /// `@xOffset`, in metres.
        x_offset: number "xOffset",
        /// `@yOffset`, in metres.
        y_offset: number "yOffset",
        /// `@zOffset`, in metres.
        z_offset: number "zOffset",
        /// `@zScale`.
        z_scale: number "zScale",
        /// `@hOffset`, in radians.
        h_offset: number "hOffset",
        /// `@hideRoadSurfaceCRG` of an object's surface.
        hides_road_surface: flag "hideRoadSurfaceCRG",
    }
}
