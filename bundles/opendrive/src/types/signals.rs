//! Signals, boards and controllers (OpenDRIVE 1.9, chapter 14).

use crate::types::objects::Validity;
use crate::types::road::Road;
use crate::types::view::{children, listed, view};

impl<'a> Road<'a> {
    /// Returns the signals of the road (14.1).
    pub fn signals(&self) -> impl Iterator<Item = Signal<'a>> + use<'a> {
        listed(self.signals_node(), "signal").map(Signal::of)
    }

    /// Returns the references to signals of other roads (14.5).
    pub fn signal_references(&self) -> impl Iterator<Item = SignalReference<'a>> + use<'a> {
        listed(self.signals_node(), "signalReference").map(SignalReference::of)
    }
}

view! {
    /// A `<signal>` (14.1).
    Signal {
        /// `@id`.
        id: text "id",
        /// `@type`.
        kind: text "type",
        /// `@subtype`.
        subtype: text "subtype",
        /// `@s`, in metres.
        s: number "s",
        /// `@t`, in metres.
        t: number "t",
        /// `@zOffset`, in metres.
        z_offset: number "zOffset",
        /// `@orientation`: `+`, `-` or `none`.
        orientation: text "orientation",
        /// `@dynamic`.
        dynamic: flag "dynamic",
        /// `@country`.
        country: text "country",
        /// `@countryRevision`.
        country_revision: text "countryRevision",
        /// `@value`.
        value: number "value",
        /// `@unit`.
        unit: text "unit",
        /// `@hOffset`, in radians.
        h_offset: number "hOffset",
        /// `@height`, in metres.
        height: number "height",
        /// `@width`, in metres.
        width: number "width",
        /// `@length`, in metres.
        length: number "length",
    }
}

impl<'a> Signal<'a> {
    children! {
        /// The lanes for which the signal is valid (14.2).
        validities: Validity "validity",
        /// The signals that this signal controls (14.3).
        dependencies: SignalDependency "dependency",
        /// The elements that the signal is linked with (14.4).
        references: ElementReference "reference",
        /// The boards with fixed signs (14.7).
        static_boards: SignalBoard "staticBoard",
        /// The boards with variable messages (14.7).
        vms_boards: SignalBoard "vmsBoard",
        /// The boards that combine both (14.7).
        multi_boards: SignalBoard "multiBoard",
    }
}

view! {
    /// A `<staticBoard>`, `<vmsBoard>` or `<multiBoard>` (14.7).
    SignalBoard {
        /// `@displayType` of a variable board.
        display_type: text "displayType",
        /// `@v` on the signal, in metres.
        v: number "v",
        /// `@z` on the signal, in metres.
        z: number "z",
    }
}

impl<'a> SignalBoard<'a> {
    children! {
        /// The signs on the board.
        signs: Signal "sign",
        /// The display areas of a variable board.
        display_areas: DisplayArea "displayArea",
    }
}

view! {
    /// A `<displayArea>` of a board with variable messages (14.7).
    DisplayArea {
        /// `@index`.
        index: integer "index",
        /// `@v` on the board, in metres.
        v: number "v",
        /// `@z` on the board, in metres.
        z: number "z",
        /// `@width`, in metres.
        width: number "width",
        /// `@height`, in metres.
        height: number "height",
    }
}

view! {
    /// A `<dependency>` of a signal (14.3).
    SignalDependency {
        /// `@id` of the controlled signal.
        id: text "id",
        /// `@type`.
        kind: text "type",
    }
}

view! {
    /// A `<reference>` of a signal (14.4).
    ElementReference {
        /// `@elementId`.
        element_id: text "elementId",
        /// `@elementType`: `object` or `signal`.
        element_type: text "elementType",
        /// `@type`.
        kind: text "type",
    }
}

view! {
    /// A `<signalReference>` (14.5).
    SignalReference {
        /// `@id` of the signal.
        id: text "id",
        /// `@s`, in metres.
        s: number "s",
        /// `@t`, in metres.
        t: number "t",
        /// `@orientation`: `+`, `-` or `none`.
        orientation: text "orientation",
    }
}

impl<'a> SignalReference<'a> {
    children! {
        /// The lanes for which the reference is valid.
        validities: Validity "validity",
    }
}

view! {
    /// A `<controller>` of the map: signals that switch together (14.6).
    Controller {
        /// `@id`.
        id: text "id",
        /// `@name`.
        name: text "name",
        /// `@sequence`.
        sequence: integer "sequence",
    }
}

impl<'a> Controller<'a> {
    children! {
        /// The controlled signals.
        controls: Control "control",
    }
}

view! {
    /// A `<control>` of a controller (14.6).
    Control {
        /// `@signalId`.
        signal_id: text "signalId",
        /// `@type`.
        kind: text "type",
    }
}

view! {
    /// A `<vmsGroup>`: boards that show one message (14.7).
    VmsGroup {
        /// `@id`.
        id: text "id",
    }
}

impl<'a> VmsGroup<'a> {
    children! {
        /// The boards.
        references: VmsBoardReference "vmsBoardReference",
    }
}

view! {
    /// A `<vmsBoardReference>` (14.7).
    VmsBoardReference {
        /// `@signalId`.
        signal_id: text "signalId",
        /// `@vmsIndex`: the number of the board on the signal.
        vms_index: integer "vmsIndex",
        /// `@groupIndex`: the place of the board in the group.
        group_index: integer "groupIndex",
    }
}
