//! Signals, boards and controllers (OpenDRIVE 1.9, chapter 14).

use crate::types::road::Road;
use crate::types::view::{children, listed, view};

impl<'a> Road<'a> {
    /// Returns the signals of the road (14.1).
    pub fn signals(&self) -> impl Iterator<Item = Signal<'a>> + use<'a> {
        listed(self.signals_node(), "signal").map(Signal::of)
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
        /// `@orientation`: `+`, `-` or `none`.
        orientation: text "orientation",
        /// `@dynamic`.
        dynamic: flag "dynamic",
        /// `@hOffset`, in radians.
        h_offset: number "hOffset",
    }
}

impl<'a> Signal<'a> {
    children! {
        /// The signals that this signal controls (14.3).
        dependencies: SignalDependency "dependency",
        /// The elements that the signal is linked with (14.4).
        references: ElementReference "reference",
        /// The boards with variable messages (14.7).
        vms_boards: SignalBoard "vmsBoard",
    }
}

view! {
    /// A `<vmsBoard>` (14.7).
    SignalBoard {}
}

view! {
    /// A `<dependency>` of a signal (14.3).
    SignalDependency {
        /// `@id` of the controlled signal.
        id: text "id",
    }
}

view! {
    /// A `<reference>` of a signal (14.4).
    ElementReference {
        /// `@elementId`.
        element_id: text "elementId",
        /// `@elementType`: `object` or `signal`.
        element_type: text "elementType",
    }
}

view! {
    /// A `<controller>` of the map: signals that switch together (14.6).
    Controller {
        /// `@id`.
        id: text "id",
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
    }
}
