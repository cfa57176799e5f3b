use crate::families::object_parts::{Stands, below, named};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_signal_reference_specify_direction",
    uids: &["asam.net:xodr:1.7.0:road.signal.reference.specify_direction"],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_signal_reference_specify_direction.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for reference in below(map, "signalReference", "signals") {
        let orientation = reference.attr("orientation").map_or("", str::trim);
        if matches!(orientation, "+" | "-" | "none") {
            continue;
        }
        let has = match orientation {
            "" => "no `orientation`".to_owned(),
            other => format!("the unknown orientation `{other}`"),
        };
        let text = format!(
            "{} has {has}; it must define whether the signal is valid along the road (`+`), against it (`-`) or \
             in both directions (`none`)",
            named(reference)
        );
        found
            .issue(Place::attribute_or_node(reference, "orientation"), text)
            .stands(map, reference);
    }
}
