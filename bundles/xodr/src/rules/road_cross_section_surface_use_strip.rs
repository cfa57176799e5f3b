use std::collections::HashMap;

use crate::prelude::*;
use qcbus_opendrive::Strip;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(surface) = &road.lateral().cross_section_surface else {
            continue;
        };
        for side in Side::BOTH {
            let of_side = |strip: &&Strip<'_>| strip.id.and_then(Side::of_lane_id) == Some(side);
            let strips: Vec<&Strip<'_>> = surface.strips.iter().filter(of_side).collect();
            if let [only] = strips.as_slice() {
                check_only(only, side, found);
            }
        }
        check_ids(&surface.strips, found);
    }
}

fn check_only(strip: &Strip<'_>, side: Side, found: &mut Sink<'_>) {
    let inner = match side {
        Side::Left => 1,
        Side::Right => -1,
    };
    if let Some(id) = strip.id.filter(|id| *id == 2 * inner) {
        let text = format!(
            "strip {id} is the only one on its side; a single strip must have the id {inner}"
        );
        found.issue(Place::attribute_or_node(strip.node(), "id"), text);
    }
    if let Some(width) = strip.node().child("width") {
        let text = "the only strip on its side has a width; it extends to the edge of the road and must not have \
                    a width";
        found.issue(width, text);
    }
}

fn check_ids(strips: &[Strip<'_>], found: &mut Sink<'_>) {
    let mut seen = HashMap::new();
    for strip in strips {
        let Some(id) = strip.id else { continue };
        let place = Place::attribute_or_node(strip.node(), "id");
        if let Some(mode) = strip
            .node()
            .attribute("mode")
            .filter(|_| matches!(id, 1 | -1))
        {
            let text = format!("inner strip {id} has a mode; only outer strips may have one");
            found.issue(mode, text).level(Level::Warning);
        }
        if !matches!(id, -2 | -1 | 1 | 2) {
            let text = format!(
                "the strip has id {id}; inner strips must have id 1 or -1, outer strips must have id 2 or -2"
            );
            found.issue(place, text);
        } else if let Some(first) = seen.get(&id) {
            let text =
                format!("strip {id} is defined twice; each side has one inner and one outer strip");
            found.issue(place, text).at(*first, "the first one");
        } else {
            seen.insert(id, strip.node());
        }
    }
}
