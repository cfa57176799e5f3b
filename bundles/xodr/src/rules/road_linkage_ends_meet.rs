use crate::families::faults::OfFault as _;
use std::cell::OnceCell;

use crate::families::gap_levels::GAP_BROKEN_FROM;
use crate::families::mouths;
use crate::families::on_road::OnRoad;
use crate::families::shown::beside;
use crate::families::unlinked_arms::UnlinkedArms;
use crate::families::virtual_links::leads_to_main_road;
use crate::prelude::*;
use foldhash::{HashMap, HashSet};

const FAR: Param = Param::number(
    "far",
    20.0,
    "m",
    "largest accepted distance of a road end from a junction that has no connection for it; the size of the \
     junction applies if it is larger",
);

/// Distance in metres below which a road counts as the intended one.
const THERE: f64 = 0.1;

/// Maximum number of checked roads around a junction with a wrong link. Real ones have fewer.
const MOST_ARMS: usize = 64;

/// Maximum number of road ends. Larger junctions get no findings about unconnected roads.
const MOST_ENDS: usize = 256;

pub const RULE: Rule<Roads> = Rule {
    params: &[GAP_BROKEN_FROM, FAR],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut told: HashSet<(RoadEnd, RoadEnd)> = HashSet::default();
    // The road ends at which a junction is, according to its connections and roads.
    let mut joined: HashSet<(usize, RoadEnd)> = HashSet::default();
    // The rules `junctions.connection.start_along_linkage` and `…end_opposite_linkage` report
    // contradictions.
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
    // `junctions.incoming_road_linked` reports these roads.
    let unlinked = UnlinkedArms::of(map);
    for road in map.roads() {
        for end in ContactPoint::BOTH {
            let at = RoadEnd::of(road, end);
            if !unlinked.contains(at) {
                junction(map, (road, end), &joined, found);
            }
        }
    }
}

/// Returns the index of the junction to which a road belongs.
fn junction_of(map: &RoadMap<'_>, at: RoadEnd) -> Option<usize> {
    let id = map.road_at(at.road)?.junction()?;
    Some(map.junction(id)?.index())
}

/// Returns the contacts of road links and connections. It skips reference lines outside junctions
/// with a gap of `broken` metres or more, which `road.geometry.contact_point` reports. If
/// `contradicted` is set, it skips connections that contradict the links. A separate rule reports
/// those.
fn contacts<'a>(
    map: &RoadMap<'a>,
    contradicted: bool,
    broken: f64,
) -> impl Iterator<Item = RoadContact<'a>> {
    let links = map.roads().iter().flat_map(move |road| {
        // The main road of a virtual junction is not split, so the contact is somewhere along it.
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

/// Checks whether reference lines outside junctions are apart. Then mouths are unreliable.
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

/// Checks whether the connecting road is linked there to a road other than the incoming one.
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
        "{says} states that the {} of road `{}` meets the {} of road `{}`, but they lie {} m apart{meant}; ends \
         that meet must lie at the same place (less than {limit} m apart)",
        contact.from.end,
        one.id(),
        contact.to.end,
        other.id(),
        beside(in_micrometres(apart), limit)
    );
    found
        .issue(contact.node, text)
        .at_end(one, contact.from.end)
        .at(one.node(), "the first road")
        .at(other.node(), "the other road")
        .at_end(other, contact.to.end)
        .at_gap([contact.from, contact.to]);
}

/// Rounds a length to micrometres, to remove digits from calculation errors.
fn in_micrometres(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}

/// Returns the road end at the place of the contact. This is the other end of the same road, or for
/// connecting roads the end of another road at the junction.
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
    /// Computed on the first fault.
    by_junction: OnceCell<HashMap<&'d str, Vec<RoadEnd>>>,
}

impl<'m, 'd> Arms<'m, 'd> {
    /// Returns the road around the junction that lies at an end of one of its connecting roads.
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
                    arms.push(RoadEnd::of(road, end));
                }
            }
        }
        arms
    }
}

/// Reports a road end with a link to a distant junction that does not mention the end.
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
    let at = RoadEnd::of(road, end);
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
        "the {} of road `{}` is junction `{id}`, but the nearest end of one of the junction's roads lies \
         {apart:.1} m away, which is more than the size of the junction; a road must end at the junction to \
         which it links",
        end.link_name(),
        road.id()
    );
    found
        .issue(link.node(), text)
        .at_end(road, end)
        .at(junction.node(), "the junction")
        .of_junction(junction.node());
}

/// Returns the distance of a road end from the nearest end of a junction's roads. It returns `None`
/// unless this is more than `far` and more than the size of the junction.
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

/// Bounding rectangle of some points.
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
