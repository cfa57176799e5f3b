use crate::families::object_parts::{Stands, below, owner};
use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    uids: &[COMPLETE, PARTIAL],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

const COMPLETE: &str = "asam.net:xodr:1.7.0:road.object.borders.useCompleteOutline_true";
/// UID of the opposite case, for which the standard has no identifier.
const PARTIAL: &str = "qcbus.dev:xodr:1.7.0:road.object.borders.partial_outline";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for border in below(map, "border", "borders") {
        let references = border.children_named("cornerReference").count();
        let said = border.attr("useCompleteOutline").map(str::trim);
        let (uid, text) = match said {
            Some("false" | "0") if references < 2 => (
                PARTIAL,
                format!(
                    "the border does not use the complete outline and refers to only {references} corners; it \
                     must have at least 2 `cornerReference`"
                ),
            ),
            None | Some("true" | "1") if references > 0 => {
                let missing = if said.is_none() {
                    " (the default if `useCompleteOutline` is missing)"
                } else {
                    ""
                };
                let text = format!(
                    "the border uses the complete outline{missing}, but refers to {references} corners; it must \
                     have no `cornerReference`, or `useCompleteOutline` must be `false`"
                );
                (COMPLETE, text)
            }
            _ => continue,
        };
        let place = Place::attribute_or_node(border, "useCompleteOutline");
        let finding = found
            .issue(place, text)
            .stands(map, owner(border))
            .uid(uid)
            .fault(fault_of(border));
        if said.is_none() {
            // A part of the outline was clearly intended.
            finding.level(Level::Warning);
        }
    }
}
