//! The whole plan.

use std::sync::atomic::{AtomicUsize, Ordering};

use qcbus_opendrive::{Road, RoadMap};

use crate::encode;
use crate::furniture;
use crate::junction::{Outlines, Roads};
use crate::origin::Shift;
use crate::road::{RoadPlan, road};
use crate::sample::NotDrawn;
use crate::writer::{Writer, unsigned};

/// Magic bytes at the beginning of the plan.
const MAGIC: &[u8] = b"QCPL";
const VERSION: u64 = 1;

/// Number of border points that the roads share equally; each road also has [`PER_BYTE`]. Real maps
/// take about a tenth of a point per byte.
const SHARED: usize = 8_000_000;
const PER_BYTE: usize = 1;

/// Number of further points for roads that exceeded their part, used one road after the other.
const RESERVE: usize = 8_000_000;

/// Maximum number of points of a single road, besides those for its bytes. They stay in memory
/// until it is drawn.
const RESERVE_OF_A_ROAD: usize = 2_000_000;

/// Number of roads that a thread takes at once. A map with at most this many roads is drawn on one
/// thread.
const PORTION: usize = 32;

/// Maximum number of threads that draw roads, because the machine has other work too.
const MOST_THREADS: usize = 4;

/// Maximum number of names in a sentence.
const NAMED: usize = 5;

/// Maximum number of characters of a name within a sentence.
const LONGEST_NAME: usize = 24;

/// The plan of a road network.
#[derive(Debug, Clone)]
pub struct Plan {
    origin: Shift,
    strings: Vec<String>,
    /// Everything after the strings.
    body: Vec<u8>,
    cuts: Vec<String>,
}

/// Result of drawing a road.
type Drawn<'a> = Result<RoadPlan<'a>, NotDrawn>;

impl Plan {
    /// Draws a map. It takes 2 to 10 ms per megabyte. For any content, the time is proportional to
    /// the size.
    pub fn of(map: &RoadMap<'_>) -> Plan {
        let origin = Shift::of(map);
        let mut roads = draw(map, origin);
        redraw(map, origin, &mut roads);
        let mut cuts = Vec::new();
        let failed = |not_drawn| {
            let pairs = map.roads().iter().zip(&roads);
            let failed = pairs.filter(move |(_, drawn)| drawn.as_ref().err() == Some(&not_drawn));
            failed.map(|(road, _)| road.id())
        };
        cuts.extend(sentence(
            failed(NotDrawn::Nowhere),
            "road",
            "no finite place within 1,000 km of the other roads",
        ));
        cuts.extend(sentence(
            failed(NotDrawn::TooLong),
            "road",
            "too many points",
        ));
        let mut out = Writer::default();
        out.count(roads.len());
        for (road, drawn) in map.roads().iter().zip(&roads) {
            encode::road(&mut out, map, road, drawn.as_ref().ok());
        }
        junctions(&mut out, map, &roads, &mut cuts);
        signals(&mut out, map, origin, &mut cuts);
        objects(&mut out, map, origin, &mut cuts);
        out.count(cuts.len());
        for cut in &cuts {
            out.string(cut);
        }
        Plan {
            origin,
            strings: out.strings.list,
            body: out.bytes,
            cuts,
        }
    }

    /// Returns the uncompressed plan as `docs/html-report.md` describes it.
    pub fn bytes(&self) -> Vec<u8> {
        let texts: usize = self.strings.iter().map(|text| text.len() + 2).sum();
        let mut bytes = Vec::with_capacity(self.body.len() + texts + 64);
        bytes.extend_from_slice(MAGIC);
        unsigned(&mut bytes, VERSION);
        bytes.extend_from_slice(&self.origin.x.to_le_bytes());
        bytes.extend_from_slice(&self.origin.y.to_le_bytes());
        unsigned(&mut bytes, self.strings.len() as u64);
        for text in &self.strings {
            unsigned(&mut bytes, text.len() as u64);
            bytes.extend_from_slice(text.as_bytes());
        }
        bytes.extend_from_slice(&self.body);
        bytes
    }

    /// Returns sentences about the parts that were left out.
    pub fn cuts(&self) -> &[String] {
        &self.cuts
    }
}

/// Returns the maximum number of points of a road.
pub(crate) fn allowance(map: &RoadMap<'_>, road: &Road<'_>) -> usize {
    let node = road.node();
    let bytes = node.end_offset().saturating_sub(node.offset());
    let share = SHARED / map.roads().len().max(1);
    share.min(RESERVE_OF_A_ROAD) + PER_BYTE * bytes as usize
}

/// Draws all roads, each with its own limit, so the result does not depend on the number of
/// threads.
fn draw<'a>(map: &RoadMap<'a>, origin: Shift) -> Vec<Drawn<'a>> {
    let each = |one: &Road<'a>| road(one, origin, allowance(map, one)).0;
    if map.roads().len() <= PORTION {
        return map.roads().iter().map(each).collect();
    }
    let portions: Vec<&[Road<'a>]> = map.roads().chunks(PORTION).collect();
    let next = AtomicUsize::new(0);
    let take = || {
        let mut taken = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(portion) = portions.get(at) else {
                return taken;
            };
            taken.push((at, portion.iter().map(each).collect::<Vec<_>>()));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get());
    let mut taken = std::thread::scope(|scope| {
        let others = (1..threads.min(MOST_THREADS)).map(|_| scope.spawn(take));
        let others: Vec<_> = others.collect();
        let mut taken = take();
        for other in others {
            match other.join() {
                Ok(more) => taken.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        taken
    });
    taken.sort_unstable_by_key(|(at, _)| *at);
    taken.into_iter().flat_map(|(_, drawn)| drawn).collect()
}

/// Draws the roads again that exceeded their limit.
fn redraw<'a>(map: &RoadMap<'a>, origin: Shift, roads: &mut [Drawn<'a>]) {
    let mut left = RESERVE;
    for (one, drawn) in map.roads().iter().zip(roads) {
        let work = left.min(RESERVE_OF_A_ROAD);
        if matches!(drawn, Err(NotDrawn::TooLong)) && work > allowance(map, one) {
            let (again, spent) = road(one, origin, work);
            left -= spent;
            *drawn = again;
        }
    }
}

/// Access to roads that are already drawn.
struct DrawnRoads<'p, 'a>(&'p [Drawn<'a>]);

impl Roads for DrawnRoads<'_, '_> {
    fn with<T>(&mut self, road: usize, look: impl FnOnce(&RoadPlan<'_>) -> T) -> Option<T> {
        let drawn = self.0.get(road)?;
        drawn.as_ref().ok().map(look)
    }
}

fn junctions(out: &mut Writer, map: &RoadMap<'_>, roads: &[Drawn<'_>], cuts: &mut Vec<String>) {
    let mut outlines = Outlines::new(map);
    out.count(map.junctions().len());
    for junction in map.junctions() {
        let outline = outlines.outline(map, junction, &mut DrawnRoads(roads));
        encode::junction(out, map, junction, &outline);
    }
    if outlines.is_spent() {
        cuts.push(
            "The outlines of some junctions are not drawn: they have too many points.".to_owned(),
        );
    }
}

fn signals(out: &mut Writer, map: &RoadMap<'_>, origin: Shift, cuts: &mut Vec<String>) {
    let all = map.signals();
    let all: Vec<_> = all
        .map(|(road, signal)| furniture::signal(road, signal, origin))
        .collect();
    out.count(all.len());
    for plan in &all {
        encode::signal(out, plan);
    }
    let lost = all.iter().filter(|plan| plan.at.is_none());
    let lost = lost.map(|plan| plan.signal.id().unwrap_or(""));
    cuts.extend(sentence(lost, "signal", NO_PLACE));
}

fn objects(out: &mut Writer, map: &RoadMap<'_>, origin: Shift, cuts: &mut Vec<String>) {
    let all = map.objects();
    let all: Vec<_> = all
        .map(|(road, object)| furniture::object(road, object, origin))
        .collect();
    out.count(all.len());
    for plan in &all {
        encode::object(out, plan);
    }
    let lost = all.iter().filter(|plan| plan.outline.is_empty());
    let lost = lost.map(|plan| plan.object.id().unwrap_or(""));
    cuts.extend(sentence(lost, "object", NO_PLACE));
}

const NO_PLACE: &str = "no place can be computed from the road";

/// Returns a sentence about elements of one kind that are not drawn, or `None` if there are none.
fn sentence<'a>(ids: impl Iterator<Item = &'a str>, kind: &str, why: &str) -> Option<String> {
    let mut names = Vec::new();
    let mut more = 0_usize;
    for id in ids {
        if names.len() < NAMED {
            names.push(format!("'{}'", name(id)));
        } else {
            more += 1;
        }
    }
    let plural = if names.len() > 1 { "s" } else { "" };
    let names = match (names.is_empty(), more) {
        (true, _) => return None,
        (false, 0) => names.join(", "),
        (false, more) => format!("{} and {more} more", names.join(", ")),
    };
    Some(format!("Not drawn ({why}): {kind}{plural} {names}."))
}

/// Returns an id in a form suitable for a sentence.
fn name(id: &str) -> String {
    let shown = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    id.chars().take(LONGEST_NAME).map(shown).collect()
}
