use crate::families::object_parts::{is_before, is_by_schema, number, objects};
use crate::families::shown;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[VALID, LATERAL],
    versions: "1.9.0..",
    backport: Backport::Alike { since: "" },
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const VALID: &str = "asam.net:xodr:1.9.0:road.object.repeating.valid_s_length";
/// UID of a requirement in the same list without an identifier.
const LATERAL: &str = "qcbus.dev:xodr:1.9.0:road.object.repeating.t_end";
const TOLERANCE: Param = Param::number(
    "s_tolerance",
    1e-3,
    "m",
    "largest distance by which a repetition may extend beyond the ends of the road, or by which the cubic for t \
     may miss `tEnd`",
);

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for object in objects(map) {
        for repeat in object.children_named("repeat") {
            along(map, repeat, tolerance, found);
            across(repeat, tolerance, found);
        }
    }
}

/// Checks that the section of repetition is on the road.
fn along<'a>(map: &RoadMap<'a>, repeat: Node<'a>, tolerance: f64, found: &mut Sink<'_>) {
    let (Some(s), Some(length)) = (number(repeat, "s"), number(repeat, "length")) else {
        return;
    };
    // A negative length is meaningless in every version. Only 1.9 forbids parts beyond the road.
    let older = is_before(found, (1, 9));
    if length < 0.0 {
        if !is_by_schema(found, (1, 5), (1, 8)) {
            let text =
                format!("the repetition is {length} m long, but its length must not be negative");
            found.issue(Place::attribute_or_node(repeat, "length"), text);
        }
    } else if length == 0.0 && number(repeat, "distance") == Some(0.0) {
        let text = "the repetition is continuous and has a length of 0 m, so it produces no object";
        found
            .issue(Place::attribute_or_node(repeat, "length"), text)
            .level(if older {
                Level::Information
            } else {
                Level::Warning
            });
    }
    let Some(road) = map.road_of(repeat) else {
        return;
    };
    let Some(end) = road.length() else { return };
    let (attribute, text) = if s < -tolerance || s > end + tolerance {
        (
            "s",
            format!("the repetition starts at s = {} m", shown::beside(s, 0.0)),
        )
    } else if s + length > end + tolerance {
        (
            "length",
            format!(
                "the repetition ends at s = {} m ({} + {})",
                shown::beside(s + length, end),
                shown::number(s),
                shown::number(length)
            ),
        )
    } else {
        return;
    };
    let text = format!(
        "{text}, but road `{}` extends from 0 to {} m",
        road.id(),
        shown::number(end)
    );
    let finding = found.issue(Place::attribute_or_node(repeat, attribute), text);
    let finding = finding.road(road.id(), s, number(repeat, "tStart").unwrap_or(0.0));
    if older {
        finding.level(Level::Warning);
    }
}

/// Checks that a cubic for t ends at `tEnd`.
fn across(repeat: Node<'_>, tolerance: f64, found: &mut Sink<'_>) {
    if !["bT", "cT", "dT"]
        .iter()
        .any(|name| repeat.attr(name).is_some())
    {
        return;
    }
    let given = |name: &str| number(repeat, name);
    let (Some(length), Some(start), Some(end)) = (given("length"), given("tStart"), given("tEnd"))
    else {
        return;
    };
    let or_zero = |name: &str| match repeat.attr(name) {
        None => Some(0.0),
        Some(_) => given(name),
    };
    let (Some(b), Some(c), Some(d)) = (or_zero("bT"), or_zero("cT"), or_zero("dT")) else {
        return;
    };
    let t = start + length * (b + length * (c + length * d));
    if (t - end).abs() > tolerance {
        let text = format!(
            "the cubic for t gives {t} m at the end of the repetition, but `tEnd` is {end} m; they must be equal"
        );
        found
            .issue(Place::attribute_or_node(repeat, "tEnd"), text)
            .uid(LATERAL);
    }
}
