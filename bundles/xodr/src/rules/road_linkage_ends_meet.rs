use std::cell::OnceCell;

use foldhash::{HashMap, HashSet};
use qcbus_opendrive::{ContactPoint, JunctionType, Road, RoadContact, RoadEnd, RoadMap};
use qcbus_sdk::{Param, Rule, Sink, Version};

use crate::families::gap_levels::GAP_BROKEN_FROM;
use crate::families::mouths;
use crate::families::on_road::OnRoad;
use crate::families::shown::beside;
use crate::families::unlinked_arms::UnlinkedArms;
use crate::families::virtual_links::leads_to_main_road;
use crate::model::Roads;

const FAR: Param = Param::number(
    "far",
    20.0,
    "m",
    "how far a road may end from a junction that has no connection for it, or the junction's size if that is more",
);

/// A road that lies nearer than this, in metres, is the one that is meant.
const THERE: f64 = 0.1;

/// Roads around one junction that are looked at when one of its links is wrong. No real junction has as many.
const MOST_ARMS: usize = 64;

/// Of junctions with more roads than this nothing is said about roads that they do not connect.
const MOST_ENDS: usize = 256;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_road_linkage_ends_meet",
    uids: &["qcbus.dev:xodr:1.4.0:road.linkage.ends_meet"],
    after: super::READABLE,
    params: &[GAP_BROKEN_FROM, FAR],
    page: include_str!("road_linkage_ends_meet.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut told: HashSet<(RoadEnd, RoadEnd)> = HashSet::default();
    // Which junctions say that they are at which road ends.
    let mut joined: HashSet<(usize, RoadEnd)> = HashSet::default();
    // `junctions.connection.start_along_linkage` and `…end_opposite_linkage` say so.
    let arms = Arms {
        map,
        by_junction: OnceCell::new(),
    };
    let contradicted = found.version() >= Some(Version::new(1, 7));
    let broken = found.number(&GAP_BROKEN_FROM);
    for contact in contacts(map, contradicted, broken) {
        let (one, other) = (contact.from, contact.to);
        if told.insert((one.min(other), one.max(other))) {
            check(map, &contact, &arms, found);
        }
        let junction = contact.junction.or_else(|| junction_of(map, one));
        joined.extend(junction.into_iter().flat_map(|at| [(at, one), (at, other)]));
    }
    // `junctions.incoming_road_linked` speaks of them.
    let unlinked = UnlinkedArms::of(map);
    for road in map.roads() {
        for end in ContactPoint::BOTH {
            let at = RoadEnd {
                road: road.index(),
                end,
            };
            if !unlinked.contains(at) {
                junction(map, (road, end), &joined, found);
            }
        }
    }
}

/// The place of the junction that a road belongs to.
fn junction_of(map: &RoadMap<'_>, at: RoadEnd) -> Option<usize> {
    let id = map.road_at(at.road)?.junction()?;
    Some(map.junction(id)?.index())
}

/// What links of roads and connections of junctions say to meet. Of reference lines outside of junctions that do
/// not, by `broken` metres or more, `road.geometry.contact_point` speaks; connections that the links contradict
/// are left out if they are `contradicted` by a rule of their own.
fn contacts<'a>(
    map: &RoadMap<'a>,
    contradicted: bool,
    broken: f64,
) -> impl Iterator<Item = RoadContact<'a>> {
    let links = map.roads().iter().flat_map(move |road| {
        // The main road of a virtual junction is not cut, and met somewhere along it.
        let links = ContactPoint::BOTH.map(|end| Some((end, road.link(end)?)));
        let links = links.into_iter().flatten();
        let cut = links.filter(move |(_, link)| !leads_to_main_road(map, road, *link));
        let contacts = cut.filter_map(move |(end, _)| map.linked_end(road, end));
        contacts.filter(move |contact| !is_of_lines(map, contact, broken))
    });
    let connections = map
        .connections()
        .filter_map(|(junction, connection)| map.connection_contact(junction, connection))
        .filter(move |contact| !contradicted || !is_contradicted(map, contact));
    links.chain(connections)
}

/// Whether reference lines of two roads outside of junctions lie apart: then little is known of the mouths.
fn is_of_lines(map: &RoadMap<'_>, contact: &RoadContact<'_>, broken: f64) -> bool {
    let ends = [contact.from, contact.to].map(|at| Some((map.road_at(at.road)?, at.end)));
    let [Some((one, from)), Some((other, to))] = ends else {
        return true;
    };
    if one.junction().is_some() || other.junction().is_some() {
        return false;
    }
    let frames = one.end_frame(from).zip(other.end_frame(to));
    frames.is_none_or(|(here, there)| {
        let (x, y) = (here.pose.x - there.pose.x, here.pose.y - there.pose.y);
        x.hypot(y) >= broken
    })
}

/// Whether the connecting road says of that end that it meets another road than the incoming one.
fn is_contradicted(map: &RoadMap<'_>, contact: &RoadContact<'_>) -> bool {
    let roads = map
        .road_at(contact.from.road)
        .zip(map.road_at(contact.to.road));
    roads.is_some_and(|(incoming, connecting)| {
        let linked = connecting
            .link(contact.to.end)
            .and_then(|link| link.road_id());
        linked.is_some_and(|id| id != incoming.id())
    })
}

fn check<'m, 'a>(
    map: &'m RoadMap<'a>,
    contact: &RoadContact<'_>,
    arms: &Arms<'m, 'a>,
    found: &mut Sink<'_>,
) {
    let limit = found.number(&GAP_BROKEN_FROM);
    let roads = map
        .road_at(contact.from.road)
        .zip(map.road_at(contact.to.road));
    let apart = mouths::apart(map, contact.from, contact.to);
    let (Some((one, other)), Some(apart)) = (roads, apart.filter(|apart| *apart >= limit)) else {
        return;
    };
    let says = match contact.junction {
        Some(_) => "the connection",
        None => "the link",
    };
    let meant = meant(contact, other, arms).map_or(String::new(), |(road, end)| {
        format!(" (the {end} of road `{}` lies there)", road.id())
    });
    let text = format!(
        "{says} says that the {} of road `{}` meets the {} of road `{}`, but they lie {} m apart{meant}; ends that \
         meet must lie at one place (less than {limit} m apart)",
        contact.from.end,
        one.id(),
        contact.to.end,
        other.id(),
        beside(in_micrometres(apart), limit)
    );
    found
        .issue(contact.node, text)
        .at_end(one, contact.from.end)
        .at(one.node(), "the one road")
        .at(other.node(), "the other road")
        .at_end(other, contact.to.end);
}

/// The same without the digits that calculation leaves.
fn in_micrometres(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}

/// The road end that lies where another is said to be: the other end of the same road, or of connecting roads that
/// of another arm of the junction.
fn meant<'m, 'a>(
    contact: &RoadContact<'_>,
    other: &'m Road<'a>,
    arms: &Arms<'m, 'a>,
) -> Option<(&'m Road<'a>, ContactPoint)> {
    let end = contact.to.end.other();
    let road = contact.to.road;
    let apart = mouths::apart(arms.map, contact.from, RoadEnd { road, end });
    if apart.is_some_and(|apart| apart < THERE) {
        return Some((other, end));
    }
    let one = arms.map.road_at(contact.from.road)?;
    contact
        .junction
        .is_none()
        .then(|| arms.at(one, contact.from))?
}

/// The road ends around the junctions.
struct Arms<'m, 'd> {
    map: &'m RoadMap<'d>,
    /// Found out when something is wrong somewhere.
    by_junction: OnceCell<HashMap<&'d str, Vec<RoadEnd>>>,
}

impl<'m, 'd> Arms<'m, 'd> {
    /// The road around the junction that lies at an end of one of its connecting roads.
    fn at(&self, connecting: &Road<'d>, here: RoadEnd) -> Option<(&'m Road<'d>, ContactPoint)> {
        let junction = connecting.junction()?;
        let arms = self
            .by_junction
            .get_or_init(|| self.gather())
            .get(junction)?;
        let mouth = mouths::Mouth::at(self.map, here)?;
        let lies_there = |arm: &&RoadEnd| {
            let there = mouths::Mouth::at(self.map, **arm);
            there.is_some_and(|there| mouth.distance(there) < THERE)
        };
        let arm = arms.iter().find(lies_there)?;
        Some((self.map.road_at(arm.road)?, arm.end))
    }

    fn gather(&self) -> HashMap<&'d str, Vec<RoadEnd>> {
        let mut arms: HashMap<&'d str, Vec<RoadEnd>> = HashMap::default();
        for road in self.map.roads() {
            for end in ContactPoint::BOTH {
                let Some(id) = road.link(end).and_then(|link| link.junction_id()) else {
                    continue;
                };
                let arms = arms.entry(id).or_default();
                if arms.len() < MOST_ARMS {
                    arms.push(RoadEnd {
                        road: road.index(),
                        end,
                    });
                }
            }
        }
        arms
    }
}

/// Looks at a road end whose link names a junction that says nothing about it.
fn junction(
    map: &RoadMap<'_>,
    (road, end): (&Road<'_>, ContactPoint),
    joined: &HashSet<(usize, RoadEnd)>,
    found: &mut Sink<'_>,
) {
    let Some((link, id)) = road
        .link(end)
        .and_then(|link| Some((link, link.junction_id()?)))
    else {
        return;
    };
    let mut junctions = map.junctions_with_id(id);
    let (Some(junction), None) = (junctions.next(), junctions.next()) else {
        return;
    };
    let cuts = matches!(
        junction.kind(),
        Some(JunctionType::Common | JunctionType::Direct)
    );
    let at = RoadEnd {
        road: road.index(),
        end,
    };
    if !cuts || road.junction() == Some(id) || joined.contains(&(junction.index(), at)) {
        return;
    }
    let of_roads = junction
        .connections()
        .filter_map(|one| map.road(one.target_road()?));
    let ends: Vec<(&Road<'_>, ContactPoint)> = of_roads
        .flat_map(|road| ContactPoint::BOTH.map(|end| (road, end)))
        .take(MOST_ENDS + 1)
        .collect();
    let Some(apart) = nearest((road, end), &ends, found.number(&FAR)) else {
        return;
    };
    let text = format!(
        "the {} of road `{}` is junction `{id}`, but the nearest end of one of the junction's roads lies {apart:.1} m \
         away, farther than the junction is wide; a road must end at the junction that it names",
        end.link_name(),
        road.id()
    );
    found
        .issue(link.node(), text)
        .at_end(road, end)
        .at(junction.node(), "the junction");
}

/// How far a road end lies from the nearest end of a junction's roads, if that is farther than they lie from
/// each other, and than `far`.
fn nearest(
    (road, end): (&Road<'_>, ContactPoint),
    ends: &[(&Road<'_>, ContactPoint)],
    far: f64,
) -> Option<f64> {
    if ends.is_empty() || ends.len() > MOST_ENDS {
        return None;
    }
    let here = mouths::Mouth::of(road, end)?;
    let mut bounds = Bounds::default();
    let mut apart = f64::INFINITY;
    for (road, end) in ends {
        apart = apart.min(here.distance(mouths::Mouth::of(road, *end)?));
        let pose = road.end_frame(*end)?.pose;
        bounds.include(pose.x, pose.y);
    }
    (apart > far.max(bounds.diagonal())).then_some(apart)
}

/// The rectangle around some points.
#[derive(Default)]
struct Bounds(Option<[f64; 4]>);

impl Bounds {
    fn include(&mut self, x: f64, y: f64) {
        let [left, right, low, high] = self.0.unwrap_or([x, x, y, y]);
        self.0 = Some([left.min(x), right.max(x), low.min(y), high.max(y)]);
    }

    fn diagonal(&self) -> f64 {
        self.0.map_or(0.0, |[left, right, low, high]| {
            (right - left).hypot(high - low)
        })
    }
}
