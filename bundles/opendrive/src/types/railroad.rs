//! Railroads and stations (OpenDRIVE 1.9, chapter 15).

use crate::types::road::Road;
use crate::types::view::{children, listed, view};

impl<'a> Road<'a> {
    /// Returns the switches of a railroad (15.3).
    pub fn switches(&self) -> impl Iterator<Item = Switch<'a>> + use<'a> {
        listed(self.railroad_node(), "switch").map(Switch::of)
    }
}

view! {
    /// A `<switch>` (15.3).
    Switch {
        /// `@id`.
        id: text "id",
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
    }
}

view! {
    /// A `<station>` (15.4), where trains stop.
    RailroadStation {}
}

impl<'a> RailroadStation<'a> {
    children! {
        /// The platforms.
        platforms: Platform "platform",
    }
}

view! {
    /// A `<platform>` of a station (15.4).
    Platform {}
}

impl<'a> Platform<'a> {
    children! {
        /// The stretches of road beside the platform.
        segments: PlatformSegment "segment",
    }
}

view! {
    /// A `<segment>` of a platform (15.4).
    PlatformSegment {}
}
