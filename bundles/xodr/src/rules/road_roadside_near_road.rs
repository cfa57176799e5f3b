use crate::families::object_parts::{named, number};
use crate::families::on_road::OnRoad;
use crate::families::roadside::{NearRoads, Row, beside, place, stands_itself, things};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[FAR_SIGNAL, FAR_OBJECT, HIGH, HIGH_SIGNAL, DEEP, DEEP_SIGNAL],
    run,
    ..Rule::after(READABLE)
};

const FAR_SIGNAL: Param = Param::number(
    "far_signal",
    100.0,
    "m",
    "largest distance between a signal and the nearest road that is accepted",
);
const FAR_OBJECT: Param = Param::number(
    "far_object",
    500.0,
    "m",
    "largest distance between an object and the nearest road that is accepted",
);
const HIGH: Param = Param::number(
    "high",
    30.0,
    "m",
    "largest height above its road at which an object may begin; the limit is larger beside the road",
);
const HIGH_SIGNAL: Param = Param::number(
    "high_signal",
    20.0,
    "m",
    "largest height above its road at which a signal may hang",
);
const DEEP: Param = Param::number(
    "deep",
    20.0,
    "m",
    "largest depth below its road at which an object may begin; the limit is larger beside the road",
);
const DEEP_SIGNAL: Param = Param::number(
    "deep_signal",
    2.0,
    "m",
    "largest depth below its road at which a signal may begin",
);

/// Maximum change of the ground height per metre beside the road.
const SLOPE: f64 = 0.5;

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let near_signals = NearRoads::new(found.number(&FAR_SIGNAL));
    let near_objects = NearRoads::new(found.number(&FAR_OBJECT));
    for road in map.roads() {
        for thing in things(road).filter(|thing| stands_itself(*thing)) {
            let near = if thing.is("signal") {
                &near_signals
            } else {
                &near_objects
            };
            if let Some(at) = place(thing, road) {
                beside_all(map, road, (thing, "t"), at, near, found);
            }
            above_or_below(road, thing, ["zOffset", "t"], found);
        }
        for repeat in road.objects().flat_map(|object| object.repeats()) {
            let repeat = repeat.node();
            if let Some(row) = Row::of(repeat, road) {
                let ends = ["tStart", "tEnd"].into_iter().zip(row.ends);
                let mut ends = ends.map(|(name, at)| {
                    beside_all(map, road, (repeat, name), at, &near_objects, found)
                });
                let _ = ends.any(|is_told| is_told);
            }
            above_or_below(road, repeat, ["zOffsetStart", "tStart"], found);
        }
    }
}

/// Reports an object or signal that is far from all roads. Returns whether it did.
fn beside_all(
    map: &RoadMap<'_>,
    road: &Road<'_>,
    (thing, across): (Node<'_>, &str),
    (s, t): (f64, f64),
    near: &NearRoads,
    found: &mut Sink<'_>,
) -> bool {
    let (far, whose) = if thing.is("signal") {
        (found.number(&FAR_SIGNAL), "a signal")
    } else {
        (found.number(&FAR_OBJECT), "an object")
    };
    if t.abs() <= far {
        return false;
    }
    let distance = beside(road, s, t);
    if distance <= far || near.any(map, road, s, t) != Some(false) {
        return false;
    }
    let what = match (thing.is("repeat"), across) {
        (false, _) => format!("{} stands", named(thing)),
        (true, "tStart") => "the repetition begins".to_owned(),
        (true, _) => "the repetition ends".to_owned(),
    };
    let text = format!(
        "{what} {distance:.0} m away from the lanes of road `{}`, and no other road is near; {whose} should \
         stand within {far} m of a road",
        road.id()
    );
    found
        .issue(Place::attribute_or_node(thing, across), text)
        .on(road, s, t);
    true
}

/// Reports an object or signal so far above or below the road that only a wrong unit or sign
/// explains it. The value may also be a height above the sea instead of the road.
fn above_or_below(road: &Road<'_>, thing: Node<'_>, [up, across]: [&str; 2], found: &mut Sink<'_>) {
    let of_signal = thing.is("signal");
    let (high, deep) = if of_signal {
        (found.number(&HIGH_SIGNAL), found.number(&DEEP_SIGNAL))
    } else {
        (found.number(&HIGH), found.number(&DEEP))
    };
    let Some(z) = number(thing, up).filter(|z| *z > high || *z < -deep) else {
        return;
    };
    let Some((s, t)) = number(thing, "s").zip(number(thing, across)) else {
        return;
    };
    let ground = if of_signal {
        0.0
    } else {
        SLOPE * beside(road, s, t)
    };
    let (word, limit) = if z > 0.0 {
        ("above", high)
    } else {
        ("below", deep)
    };
    if z.abs() <= limit + ground || !(thing.is("repeat") || stands_itself(thing)) {
        return;
    }
    let name = if thing.is("repeat") {
        "the repetition begins".to_owned()
    } else {
        format!("{} begins", named(thing))
    };
    let text = format!(
        "{name} {:.1} m {word} the reference line of road `{}`; `{up}` is in metres relative to that line; at \
         most {:.0} m are plausible here",
        z.abs(),
        road.id(),
        limit + ground
    );
    found
        .issue(Place::attribute_or_node(thing, up), text)
        .on(road, s, t);
}
