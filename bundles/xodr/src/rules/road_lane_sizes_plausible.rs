use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

const MARK_WIDTH: Param =
    Param::number("mark_width", 1.0, "m", "largest plausible width of a line");
const MARK_HEIGHT: Param = Param::number(
    "mark_height",
    0.5,
    "m",
    "largest plausible height of a road mark",
);
const LANE_HEIGHT: Param = Param::number(
    "lane_height",
    1.0,
    "m",
    "largest plausible height of a lane above or below the road",
);

const FRICTION: Param = Param::number(
    "friction",
    2.0,
    "",
    "largest plausible coefficient of friction",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[MARK_WIDTH, MARK_HEIGHT, LANE_HEIGHT, FRICTION],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        for height in lane.heights() {
            let limit = found.number(&LANE_HEIGHT);
            let node = height.node();
            let edges = [("inner", height.inner()), ("outer", height.outer())];
            let odd = edges
                .into_iter()
                .filter_map(|(name, value)| {
                    Some((name, value.filter(|value| value.abs() > limit)?))
                })
                .max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()));
            if let Some((name, value)) = odd {
                say(
                    lane,
                    node,
                    node,
                    name,
                    (value, limit),
                    "the height of this lane",
                    found,
                );
            }
        }
        for material in lane.elements("material") {
            friction(lane, material, found);
        }
        for mark in lane.elements("roadMark") {
            // A mark without paint has no size, and a strip of grass may have any size.
            if !matches!(mark.attr("type"), Some("none" | "grass")) {
                look_at_mark(lane, mark, found);
            }
        }
    }
}

/// Reports a friction that no surface has. Usually it is written in percent.
fn friction(lane: LaneRef<'_, '_>, material: Node<'_>, found: &mut Sink<'_>) {
    let most = found.number(&FRICTION);
    let Some(value) = too_large(material, "friction", most) else {
        return;
    };
    let text = format!(
        "the friction of this material is {value}, on {}; a coefficient of friction is about 0.8 on a dry road, and \
         more than {most} is implausible",
        lane_name(lane)
    );
    let finding = found.issue(Place::attribute_or_node(material, "friction"), text);
    if let Ok(ds) = material.f64("sOffset") {
        finding.in_lane(lane, ds);
    }
}

/// Reports too large sizes of a mark and of its lines, if there are any.
fn look_at_mark(lane: LaneRef<'_, '_>, mark: Node<'_>, found: &mut Sink<'_>) {
    let (width, height) = (found.number(&MARK_WIDTH), found.number(&MARK_HEIGHT));
    for (name, limit, what) in [
        ("width", width, "the width of this road mark"),
        ("height", height, "the height of this road mark"),
    ] {
        if let Some(value) = too_large(mark, name, limit) {
            say(lane, mark, mark, name, (value, limit), what, found);
        }
    }
    let parts = mark
        .children()
        .filter(|child| child.is("type") || child.is("explicit"));
    for line in parts.flat_map(|part| part.children_named("line")) {
        if let Some(value) = too_large(line, "width", width) {
            let what = "the width of this line of a road mark";
            say(lane, mark, line, "width", (value, width), what, found);
        }
    }
}

fn too_large(node: Node<'_>, name: &'static str, limit: f64) -> Option<f64> {
    let value = node.f64(name).ok()?;
    (value.is_finite() && value.abs() > limit).then_some(value)
}

fn say(
    lane: LaneRef<'_, '_>,
    record: Node<'_>,
    node: Node<'_>,
    name: &str,
    (value, limit): (f64, f64),
    what: &str,
    found: &mut Sink<'_>,
) {
    let text = format!(
        "{what} is {value} m, on {}; more than {limit} m is implausible; sizes are in metres",
        lane_name(lane)
    );
    let finding = found.issue(Place::attribute_or_node(node, name), text);
    if let Ok(ds) = record.f64("sOffset") {
        finding.in_lane(lane, ds);
    }
}
