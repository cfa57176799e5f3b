use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "largest distance from the ends of the road that is accepted",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(surface) = &road.lateral().cross_section_surface else {
            continue;
        };
        check("tOffset", &surface.t_offset, road, found);
        for strip in &surface.strips {
            check("width", &strip.width, road, found);
            let names = ["constant", "linear", "quadratic", "cubic"];
            for (name, profile) in names.into_iter().zip(&strip.coefficients) {
                check(name, profile, road, found);
            }
        }
    }
}

fn check(name: &str, profile: &Profile<'_>, road: &Road<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let (Some(first), Some(last)) = (profile.in_order().next(), profile.in_order().next_back())
    else {
        return;
    };
    if let Some(s) = first.start().filter(|s| s.abs() > tolerance) {
        let text = format!(
            "the first coefficients of `{name}` start at s = {s}; they must start at s = 0, where the \
             reference line starts"
        );
        found
            .issue(Place::attribute_or_node(first.node(), "s"), text)
            .road(road.id(), s, 0.0);
    }
    let (Some(s), Some(length)) = (last.start(), road.length()) else {
        return;
    };
    if s > length + tolerance {
        let text = format!(
            "these coefficients of `{name}` start at s = {s}; they must start before the end of the reference \
             line at s = {length}"
        );
        found
            .issue(Place::attribute_or_node(last.node(), "s"), text)
            .road(road.id(), length, 0.0);
    }
}
