use crate::families::ascending;
use crate::families::object_parts::{is_by_schema, named, number};
use crate::families::places_on_roads;
use crate::families::shown;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[TOLERANCE, ROADSIDE, CLEAR],
    each: Some(each),
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest distance beyond the end that is accepted",
);

const ROADSIDE: Param = Param::number(
    "roadside",
    0.05,
    "m",
    "largest distance beyond the end that is accepted for signals, references, tunnels and bridges",
);

const CLEAR: Param = Param::number(
    "clear",
    1.0,
    "m",
    "distance beyond the end above which signals, references, tunnels and bridges are errors",
);

/// Those of them whose last record may give a value at the end of the section.
const CURVES: [&str; 3] = ["width", "border", "height"];

/// Distance from the end of a lane section below which a start counts as its end, in metres.
const ROUNDING: f64 = 1e-9;

/// The records of a lane that start at `sOffset`.
const LANE_RECORDS: [&str; 8] = [
    "width", "border", "height", "roadMark", "material", "speed", "access", "rule",
];

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let written = |name: &&str| {
        let document = map.root().map(|root| root.document());
        document.is_some_and(|document| document.elements(name).next().is_some())
    };
    let lane_records: Vec<&'static str> = LANE_RECORDS.iter().copied().filter(written).collect();
    for road in map.part(part).roads() {
        let Some(length) = road.length() else {
            continue;
        };
        let whole = Extent {
            start: "s",
            length,
            limit: length + tolerance,
            what: "the road",
            from: 0.0,
            road: road.id(),
        };
        let lists = [
            (Some(road.node()), "type"),
            (road.elevation_node(), "elevation"),
            (road.lateral_node(), "superelevation"),
            (road.lateral_node(), "shape"),
        ];
        let layers = road
            .layers()
            .iter()
            .map(|layer| (Some(layer.node()), "laneOffset"));
        for (parent, name) in lists.into_iter().chain(layers) {
            whole.check(ascending::children(parent, name), name, found);
        }
        for (parent, name) in [
            (road.signals_node(), "signal"),
            (road.signals_node(), "signalReference"),
            (road.objects_node(), "objectReference"),
        ] {
            whole.stands(parent, name, found);
        }
        for name in ["tunnel", "bridge"] {
            whole.ends(road.objects_node(), name, found);
        }
        for lane in road.sections().flat_map(SectionRef::lanes) {
            // Another rule reports a section without length.
            let length = lane.length().filter(|length| *length > 0.0);
            let Some((length, from)) = length.zip(lane.at.s()) else {
                continue;
            };
            let section = Extent {
                start: "sOffset",
                length,
                limit: length + tolerance,
                what: "its lane section",
                from,
                road: road.id(),
            };
            for &name in &lane_records {
                let limit = if CURVES.contains(&name) {
                    section.limit
                } else {
                    // A record at the very end never applies either. Some readers never end there.
                    length - ROUNDING
                };
                let section = Extent { limit, ..section };
                if !all_start_by(lane, name, section.limit) {
                    section.check(lane.elements(name), name, found);
                }
            }
        }
    }
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let (near, far) = (found.number(&ROADSIDE), found.number(&CLEAR));
    places_on_roads::check(map, [near, far], found);
}

/// Checks whether the records of a lane are known to start at `limit` or earlier.
fn all_start_by(lane: LaneRef<'_, '_>, name: &str, limit: f64) -> bool {
    let fits = |start: Option<f64>| start.is_some_and(|start| start <= limit);
    let profile = match name {
        "width" => lane.widths(),
        "border" => lane.borders(),
        "height" => return lane.heights().iter().all(|one| fits(one.s_offset())),
        _ => return false,
    };
    profile.records().iter().all(|record| fits(record.start()))
}

/// The extent in which records lie.
#[derive(Clone, Copy)]
struct Extent<'m> {
    /// Name of the attribute that gives the start of a record.
    start: &'static str,
    /// Length in metres, measured like the starts of the records.
    length: f64,
    /// Maximum start of a record.
    limit: f64,
    what: &'static str,
    /// Start of the extent on the road, in metres.
    from: f64,
    road: &'m str,
}

impl Extent<'_> {
    /// Reports each element with this name that stands beyond the end.
    fn stands(&self, parent: Option<Node<'_>>, name: &'static str, found: &mut Sink<'_>) {
        let limit = self.length + found.number(&ROADSIDE);
        for node in ascending::children(parent, name) {
            if self.begins_before(node, found) {
                continue;
            }
            let Some(s) = number(node, self.start).filter(|s| *s > limit) else {
                continue;
            };
            let text = format!(
                "{} is at s = {}, but {} is {} m long; it must lie on the road",
                named(node),
                shown::number(s),
                self.what,
                shown::number(self.length)
            );
            let level = self.severity(s, found);
            found
                .issue(Place::attribute_or_node(node, self.start), text)
                .level(level)
                .road(self.road, s, number(node, "t").unwrap_or(0.0));
        }
    }

    /// Reports each element with this name that reaches beyond the end.
    fn ends(&self, parent: Option<Node<'_>>, name: &'static str, found: &mut Sink<'_>) {
        let limit = self.length + found.number(&ROADSIDE);
        for node in ascending::children(parent, name) {
            if self.begins_before(node, found) {
                continue;
            }
            let Some((s, length)) = number(node, self.start).zip(number(node, "length")) else {
                continue;
            };
            if s + length > limit {
                let text = format!(
                    "{} extends from s = {} to s = {}, but {} is {} m long; it must end on the road",
                    named(node),
                    shown::number(s),
                    shown::number(s + length),
                    self.what,
                    shown::number(self.length)
                );
                let level = self.severity(s + length, found);
                found
                    .issue(Place::attribute_or_node(node, "length"), text)
                    .level(level)
                    .road(self.road, self.length, 0.0);
            }
        }
    }

    /// Returns an error if rounding cannot explain the value, otherwise a warning.
    fn severity(&self, s: f64, found: &Sink<'_>) -> Level {
        if s > self.length + found.number(&CLEAR) {
            Level::Error
        } else {
            Level::Warning
        }
    }

    /// Reports an element that begins before the road, which the schemas of some versions forbid.
    fn begins_before(&self, node: Node<'_>, found: &mut Sink<'_>) -> bool {
        let tolerance = found.number(&TOLERANCE);
        let Some(s) = number(node, self.start).filter(|s| *s < -tolerance) else {
            return false;
        };
        if !is_by_schema(found, (1, 5), (1, 8)) {
            let text = format!(
                "{} has s = {s}, but {} starts at s = 0; s must not be less than that",
                named(node),
                self.what
            );
            found
                .issue(Place::attribute_or_node(node, self.start), text)
                .level(Level::Error)
                .road(self.road, s, number(node, "t").unwrap_or(0.0));
        }
        true
    }

    /// Reports the first record with this name that starts beyond the end.
    fn check<'a>(
        &self,
        mut records: impl Iterator<Item = Node<'a>>,
        name: &'static str,
        found: &mut Sink<'_>,
    ) {
        let limit = self.limit;
        let (by, what, length) = (self.start, self.what, self.length);
        let beyond = |node: Node<'_>| node.f64(self.start).is_ok_and(|start| start > limit);
        let Some(node) = records.find(|node| beyond(*node)) else {
            return;
        };
        let Ok(start) = node.f64(self.start) else {
            return;
        };
        let text = format!(
            "this `{name}` starts at {by} = {}, but {what} is {} m long; it should start before the end, because \
             otherwise it never applies",
            shown::number(start),
            shown::number(length)
        );
        found.issue(Place::attribute_or_node(node, by), text).road(
            self.road,
            self.from + start,
            0.0,
        );
    }
}
