use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.01,
    "m",
    "a first record that starts at or before this s counts as a record at s = 0",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        check(road, "elevation", road.elevation(), found);
        check(
            road,
            "superelevation",
            &road.lateral().superelevation,
            found,
        );
        if let Some(layer) = road.permanent() {
            // Before the first record the offset is 0. A first record that starts at 0 continues
            // it.
            let first = layer.offset().in_order().next();
            let from_zero =
                first.is_some_and(|first| first.start().and_then(|s| first.at(s)) == Some(0.0));
            if !from_zero {
                check(road, "lane offset", layer.offset(), found);
            }
        }
    }
}

fn check(road: &Road<'_>, what: &str, profile: &Profile<'_>, found: &mut Sink<'_>) {
    let Some(first) = profile.in_order().next() else {
        return;
    };
    let Some(s) = first.start().filter(|s| *s > found.number(&TOLERANCE)) else {
        return;
    };
    // If the only record is zero everywhere, further records would not change anything.
    let flat = |at: f64| first.at(at) == Some(0.0);
    if profile.records().len() == 1 && flat(0.0) && flat(1.0) && flat(2.0) {
        return;
    }
    let text = format!(
        "the first record of the {what} of road `{}` starts at s = {}, so the value before it is undefined; \
         there should be a record at s = 0",
        road.id(),
        number(s)
    );
    found
        .issue(Place::attribute_or_node(first.node(), "s"), text)
        .road(road.id(), s, 0.0);
}
