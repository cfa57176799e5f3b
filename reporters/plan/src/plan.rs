//! The plan as a whole.

use std::sync::atomic::{AtomicUsize, Ordering};

use qcbus_opendrive::{Road, RoadMap};

use crate::encode;
use crate::furniture;
use crate::junction::{Outlines, Roads};
use crate::origin::Shift;
use crate::road::{RoadPlan, road};
use crate::sample::NotDrawn;
use crate::writer::{Writer, unsigned};

/// What the bytes begin with.
const MAGIC: &[u8] = b"QCPL";
const VERSION: u64 = 1;

/// How many points of borders are looked at, for roads that share this equally; besides each has [`PER_BYTE`].
/// Real maps take about a tenth of a point per byte.
const SHARED: usize = 8_000_000;
const PER_BYTE: usize = 1;

/// How many more those roads may take, one after the other, that their share was not enough for.
const RESERVE: usize = 8_000_000;

/// How many a single road may take besides those for its bytes: they are held in memory until it is drawn.
const RESERVE_OF_A_ROAD: usize = 2_000_000;

/// Roads are given to threads in portions of so many; maps with no more than this are drawn on one thread.
const PORTION: usize = 32;

/// At most so many threads draw roads: the plan is not the only thing that a machine has to do.
const MOST_THREADS: usize = 4;

/// At most so many names in a sentence.
const NAMED: usize = 5;

/// A name within a sentence is cut after so many characters.
const LONGEST_NAME: usize = 24;

/// The plan of a road network.
#[derive(Debug, Clone)]
pub struct Plan {
    origin: Shift,
    strings: Vec<String>,
    /// All that follows the strings.
    body: Vec<u8>,
    cuts: Vec<String>,
}

/// What became of a road.
type Drawn<'a> = Result<RoadPlan<'a>, NotDrawn>;

impl Plan {
    /// Draws a map. Takes 2 to 10 ms per megabyte of it, and whatever it says time in proportion to its size.
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
            "for want of a finite place within 1,000 km of the other roads",
        ));
        cuts.extend(sentence(
            failed(NotDrawn::TooLong),
            "road",
            "as it would take too many points",
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

    /// The plan as `docs/html-report.md` describes it, not compressed.
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

    /// Sentences about what was left out.
    pub fn cuts(&self) -> &[String] {
        &self.cuts
    }
}

/// How many points a road may take.
pub(crate) fn allowance(map: &RoadMap<'_>, road: &Road<'_>) -> usize {
    let node = road.node();
    let bytes = node.end_offset().saturating_sub(node.offset());
    let share = SHARED / map.roads().len().max(1);
    share.min(RESERVE_OF_A_ROAD) + PER_BYTE * bytes as usize
}

/// All roads, each with its own allowance, so that the result does not depend on the number of threads.
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

/// Gives the roads that have used up their share another try.
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

/// Roads that were drawn already.
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

const NO_PLACE: &str = "for want of a place that can be computed from the road";

/// A sentence about things of one kind that are not drawn; `None` when there are none.
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
    Some(format!("Not drawn, {why}: {kind}{plural} {names}."))
}

/// An id that can stand in a sentence.
fn name(id: &str) -> String {
    let shown = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    id.chars().take(LONGEST_NAME).map(shown).collect()
}
