//! Railroads and stations (chapter 15), CRG surfaces (10.6), junction groups (12.13).

use crate::objects::listed;
use crate::road::Road;
use crate::view::{children, view};

impl<'a> Road<'a> {
    /// Returns the switches of a railroad (15.3).
    pub fn switches(&self) -> impl Iterator<Item = Switch<'a>> + use<'a> {
        listed(self.railroad_node(), "switch").map(Switch::of)
    }

    /// Returns the CRG records of the road's surface (10.6).
    pub fn crgs(&self) -> impl Iterator<Item = Crg<'a>> + use<'a> {
        listed(self.surface_node(), "CRG").map(Crg::of)
    }
}

view! {
    /// A `<switch>` (15.3).
    Switch {
        /// `@id`.
        id: text "id",
        /// `@name`.
        name: text "name",
        /// `@position`: `dynamic`, `straight` or `turn`.
        position: text "position",
    }
}

impl<'a> Switch<'a> {
    /// Returns `<mainTrack>`.
    pub fn main_track(&self) -> Option<Track<'a>> {
        self.node.child("mainTrack").map(Track::of)
    }

    /// Returns `<sideTrack>`.
    pub fn side_track(&self) -> Option<Track<'a>> {
        self.node.child("sideTrack").map(Track::of)
    }

    /// Returns the `@id` of `<partner>`: the switch at the other end of the side track.
    pub fn partner_id(&self) -> Option<&'a str> {
        self.node.child("partner")?.attr("id")
    }
}

view! {
    /// A `<mainTrack>` or `<sideTrack>` of a switch (15.3).
    Track {
        /// `@id` of the road.
        id: text "id",
        /// `@s` on that road, in metres.
        s: number "s",
        /// `@dir`: the direction on that road.
        dir: direction "dir",
    }
}

view! {
    /// A `<station>` (15.4), where trains stop.
    RailroadStation {
        /// `@id`.
        id: text "id",
        /// `@name`.
        name: text "name",
        /// `@type`.
        kind: text "type",
    }
}

impl<'a> RailroadStation<'a> {
    children! {
        /// The platforms.
        platforms: Platform "platform",
    }
}

view! {
    /// A `<platform>` of a station (15.4).
    Platform {
        /// `@id`.
        id: text "id",
        /// `@name`.
        name: text "name",
    }
}

impl<'a> Platform<'a> {
    children! {
        /// The stretches of road beside the platform.
        segments: PlatformSegment "segment",
    }
}

view! {
    /// A `<segment>` of a platform (15.4).
    PlatformSegment {
        /// `@roadId`.
        road_id: text "roadId",
        /// `@sStart`, in metres.
        s_start: number "sStart",
        /// `@sEnd`, in metres.
        s_end: number "sEnd",
        /// `@side`: `left` or `right`.
        side: text "side",
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

view! {
    /// A `<junctionGroup>` (12.13).
    JunctionGroup {
        /// `@id`.
        id: text "id",
        /// `@name`.
        name: text "name",
        /// `@type`.
        kind: text "type",
    }
}

impl<'a> JunctionGroup<'a> {
    children! {
        /// The junctions of the group.
        references: JunctionReference "junctionReference",
    }
}

view! {
    /// A `<junctionReference>` (12.13).
    JunctionReference {
        /// `@junction`: the junction's id.
        junction: text "junction",
    }
}
