use crate::families::object_parts::{has_outline, named, number};
use crate::families::on_road::OnRoad;
use crate::families::roadside::{place, stands_itself};
use crate::families::strips::{area, common};
use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[SHARE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const SHARE: Param = Param::number(
    "share",
    0.5,
    "",
    "share of a parking space or building above which another one must not cover it",
);

/// Differences in metres below which two objects have the same place or the same size.
const SAME: f64 = 0.01;
/// Height difference in metres from which objects stand above each other.
const ABOVE: f64 = 1.5;
/// Maximum number of objects with which each one is compared.
const MOST: usize = 32;

/// An object that is a box, in s and t as if the road were straight there.
struct Boxed<'a> {
    node: Node<'a>,
    s: f64,
    t: f64,
    size: [f64; 2],
    height: f64,
    corners: Vec<Point>,
}

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let all = road.objects().map(|object| object.node());
        let of_kind =
            all.filter(|node| matches!(node.attr("type"), Some("parkingSpace" | "building")));
        let mut boxes: Vec<Boxed<'_>> = Vec::new();
        for node in of_kind {
            for repeat in node.children_named("repeat") {
                row(road, node, repeat, found);
            }
            boxes.extend(Boxed::of(node, road));
        }
        boxes.sort_by(|one, other| one.s.total_cmp(&other.s));
        for (at, one) in boxes.iter().enumerate() {
            let later = boxes.iter().skip(at + 1).take(MOST);
            if let Some(other) = later.into_iter().find(|other| covers(one, other, found)) {
                report(road, one, other, found);
            }
        }
    }
}

impl<'a> Boxed<'a> {
    fn of(node: Node<'a>, road: &Road<'a>) -> Option<Boxed<'a>> {
        let (s, t) = place(node, road)?;
        let size = [number(node, "length")?, number(node, "width")?];
        let is_box = stands_itself(node) && !has_outline(node) && node.child("skeleton").is_none();
        if !is_box || size.iter().any(|size| *size <= 0.0) {
            return None;
        }
        let (sin, cos) = number(node, "hdg").unwrap_or(0.0).sin_cos();
        let corner = |(u, v): (f64, f64)| {
            let (u, v) = (u * size[0], v * size[1]);
            Point::finite(s + u * cos - v * sin, t + u * sin + v * cos)
        };
        let signs = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        Some(Boxed {
            node,
            s,
            t,
            size,
            height: number(node, "zOffset").unwrap_or(0.0),
            corners: signs.into_iter().map(corner).collect::<Option<_>>()?,
        })
    }
}

/// Checks whether two objects cover each other. Another rule reports two objects at one place.
/// Buildings may consist of parts, so only buildings of the same size count.
fn covers(one: &Boxed<'_>, other: &Boxed<'_>, found: &Sink<'_>) -> bool {
    let kinds = [one, other].map(|it| it.node.attr("type").unwrap_or_default());
    let is_same = |one: f64, other: f64| (one - other).abs() < SAME;
    let sizes = || (0..2).all(|at| is_same(one.size[at], other.size[at]));
    let twins = is_same(one.s, other.s) && is_same(one.t, other.t);
    if kinds[0] != kinds[1] || twins || (one.height - other.height).abs() > ABOVE {
        return false;
    }
    if kinds[0] == "building" && !sizes() {
        return false;
    }
    let smaller = (one.size[0] * one.size[1]).min(other.size[0] * other.size[1]);
    common(&one.corners, &other.corners)
        .is_some_and(|shape| area(&shape) > smaller * found.number(&SHARE))
}

fn report(road: &Road<'_>, one: &Boxed<'_>, other: &Boxed<'_>, found: &mut Sink<'_>) {
    let text = format!(
        "{} of type `{}` covers more than half of {}; they should lie beside each other",
        named(other.node),
        other.node.attr("type").unwrap_or_default(),
        named(one.node)
    );
    found
        .issue(Place::attribute_or_node(other.node, "s"), text)
        .on(road, other.s, other.t)
        .at(one.node, "the other one")
        .fault(format!("space of {}", fault_of(one.node)))
        .fault(format!("space of {}", fault_of(other.node)));
}

/// Reports copies of an object that cover each other.
fn row(road: &Road<'_>, object: Node<'_>, repeat: Node<'_>, found: &mut Sink<'_>) {
    let distance = number(repeat, "distance").filter(|distance| *distance > 0.0);
    let size = |names: [&str; 2], own: &str| {
        let given = names.map(|name| number(repeat, name));
        match given {
            [Some(one), Some(other)] => Some(one.min(other)),
            [Some(one), None] | [None, Some(one)] => Some(one),
            [None, None] => number(object, own),
        }
    };
    let length = size(["lengthStart", "lengthEnd"], "length");
    let width = size(["widthStart", "widthEnd"], "width");
    let known = distance.zip(length.zip(width));
    let Some((distance, (length, width))) = known.filter(|_| !has_outline(object)) else {
        return;
    };
    // Copies move sideways as well if `tStart` and `tEnd` differ.
    let slanted = number(repeat, "tStart") != number(repeat, "tEnd");
    if slanted || number(repeat, "length").is_none_or(|row| row < distance) {
        return;
    }
    let (sin, cos) = number(object, "hdg").unwrap_or(0.0).sin_cos();
    // The shorter way out of a turned box is one of its sides, seen along the road.
    let (sin, cos) = (sin.abs(), cos.abs());
    let along = (length / cos.max(1e-9)).min(width / sin.max(1e-9));
    let least = along * (1.0 - found.number(&SHARE));
    if distance < least {
        let text = format!(
            "the copies of {} lie {distance} m apart, but each is {along:.1} m long along the road, so they cover \
             each other; `distance` should be at least {along:.1}",
            named(object)
        );
        found
            .issue(Place::attribute_or_node(repeat, "distance"), text)
            .on(
                road,
                number(repeat, "s").unwrap_or(0.0),
                number(repeat, "tStart").unwrap_or(0.0),
            );
    }
}
