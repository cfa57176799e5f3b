use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::is_route;
use crate::prelude::*;
use qcbus_opendrive::RoadType;

const SLOW: Param = Param::number(
    "slow",
    20.0,
    "m/s",
    "highest plausible limit where people walk, play or cycle",
);
const TOWN: Param = Param::number("town", 40.0, "m/s", "highest plausible limit in a town");
const RURAL: Param = Param::number(
    "rural",
    50.0,
    "m/s",
    "highest plausible limit on a rural road",
);
const MOTORWAY: Param = Param::number(
    "motorway",
    11.1,
    "m/s",
    "lowest plausible limit on a motorway",
);
const LEAST: Param = Param::number("least", 1.3, "m/s", "lowest plausible limit anywhere");
const MOST: Param = Param::number("most", 90.0, "m/s", "highest plausible limit anywhere");

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[SLOW, TOWN, RURAL, MOTORWAY, LEAST, MOST],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let part = map.part(part);
    for road in part.roads() {
        for record in road.types() {
            for speed in record.node().children_named("speed") {
                let Some(text) = judge(speed, record.kind(), found) else {
                    continue;
                };
                let finding = found.issue(Place::attribute_or_node(speed, "max"), text);
                if let Some(s) = record.s() {
                    finding.on(road, s, 0.0);
                }
            }
        }
    }
    for lane in part.lanes().filter(|lane| is_route(*lane)) {
        for speed in lane.elements("speed") {
            let ds = speed.f64("sOffset").unwrap_or(0.0);
            let kind = lane.at.s().and_then(|s| kind_at(lane.at.road, s + ds));
            let lost = lane
                .at
                .s()
                .and_then(|s| unit_lost(lane.at.road, speed, s + ds));
            if let Some(text) = judge(speed, kind, found).or(lost) {
                let text = format!("{text} ({})", lane_name(lane));
                found
                    .issue(Place::attribute_or_node(speed, "max"), text)
                    .in_lane(lane, ds);
            }
        }
    }
}

/// Returns a text for a lost unit: the number equals the road's own limit in another unit.
fn unit_lost(road: &Road<'_>, speed: Node<'_>, s: f64) -> Option<String> {
    let is_blank = speed.attr("unit").is_none_or(|unit| unit.trim().is_empty());
    let max = speed.f64("max").ok().filter(|max| is_blank && *max > 0.0)?;
    let mut of_road = record_at(road, s)?.node().children_named("speed");
    let like = of_road.find(|one| {
        one.f64("max").is_ok_and(|other| other == max)
            && matches!(one.attr("unit"), Some("km/h" | "mph"))
    })?;
    let unit = like.attr("unit")?;
    Some(format!(
        "the speed limit is {max} without `unit`, so it is in m/s ({:.0} km/h); the road's own limit is {max} \
         {unit}, so the unit was probably omitted by mistake",
        3.6 * max
    ))
}

/// Returns the type of a road at s.
fn kind_at<'a>(road: &Road<'a>, s: f64) -> Option<&'a str> {
    record_at(road, s)?.kind()
}

/// Returns the record of a road's type that applies at s.
fn record_at<'a>(road: &Road<'a>, s: f64) -> Option<RoadType<'a>> {
    let before = road.types().filter(|record| {
        let start = record.s();
        start.is_some_and(|start| start <= s + 1e-9)
    });
    before.max_by(|one, other| one.s().unwrap_or(0.0).total_cmp(&other.s().unwrap_or(0.0)))
}

/// Returns the fault of a limit on a road of a type. The schema reports limits below zero and
/// words.
fn judge(speed: Node<'_>, kind: Option<&str>, found: &Sink<'_>) -> Option<String> {
    let max = speed.f64("max").ok().filter(|max| *max >= 0.0)?;
    let (unit, factor) = match speed.attr("unit") {
        None | Some("" | "m/s") => ("m/s", 1.0),
        Some("km/h") => ("km/h", 1.0 / 3.6),
        Some("mph") => ("mph", 0.44704),
        Some(_) => return None,
    };
    if max == 0.0 {
        return Some(
            "a speed limit of 0 stops all traffic; if there is no limit, omit the element or use `no limit` or \
             `undefined`"
                .to_owned(),
        );
    }
    if let Some(text) = too_low(max, (unit, factor), kind, found) {
        return Some(text);
    }
    let (most, place) = match kind {
        Some("lowSpeed" | "pedestrian" | "bicycle" | "townPlayStreet") => {
            (found.number(&SLOW), kind)
        }
        Some(
            "town" | "townExpressway" | "townCollector" | "townArterial" | "townPrivate"
            | "townLocal",
        ) => (found.number(&TOWN), kind),
        Some("rural") => (found.number(&RURAL), kind),
        _ => (found.number(&MOST), None),
    };
    if max * factor <= most {
        return None;
    }
    let place = place.map_or_else(String::new, |kind| format!(" on a road of type `{kind}`"));
    let doubt = match (speed.attr("unit"), unit) {
        (None, _) => "; without `unit`, it is in m/s",
        (Some(_), "m/s") => "; its unit is m/s",
        _ => "",
    };
    let in_km = match unit {
        "km/h" => String::new(),
        _ => format!(" ({:.0} km/h)", 3.6 * max * factor),
    };
    Some(format!(
        "the speed limit is {max} {unit}{in_km}{doubt}; more than {:.0} km/h is implausible{place}",
        3.6 * most
    ))
}

/// Returns the fault of a limit that is too low. Usually a value in m/s was written with another
/// unit.
fn too_low(
    max: f64,
    (unit, factor): (&str, f64),
    kind: Option<&str>,
    found: &Sink<'_>,
) -> Option<String> {
    let least = match kind {
        Some("motorway") => found.number(&MOTORWAY),
        _ => found.number(&LEAST),
    };
    let place = kind.map_or_else(String::new, |kind| format!(" on a road of type `{kind}`"));
    let in_metres = in_metres_per_second(max, factor, unit);
    if max * factor >= least && in_metres.is_none() {
        return None;
    }
    let meant = in_metres.map_or_else(
        || format!("less than {:.0} km/h is implausible there", 3.6 * least),
        |meant| {
            format!(
                "{max} m/s are {meant:.0} {unit}, so the value is probably in m/s; write `max=\"{meant:.0}\"`, or \
                 `unit=\"m/s\"`"
            )
        },
    );
    Some(format!("the speed limit is {max} {unit}{place}; {meant}"))
}

/// Returns the round limit in the given unit that equals a fractional value in m/s, such as 50 km/h
/// for 13.89.
fn in_metres_per_second(max: f64, factor: f64, unit: &str) -> Option<f64> {
    let meant = max / factor;
    let step = if unit == "mph" { 5.0 } else { 10.0 };
    let round = (meant / step).round() * step;
    // The text of the value has at least two decimals.
    let has_decimals = (max * 10.0 - (max * 10.0).round()).abs() > 0.05;
    let is_round = (meant - round).abs() <= 0.02 && round >= 10.0;
    (unit != "m/s" && has_decimals && is_round).then_some(round)
}
