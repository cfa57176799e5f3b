//! Lane layers and lane sections (OpenDRIVE 1.9, 11.2 to 11.5).

use std::sync::OnceLock;

use qcbus_document::Node;

use crate::geometry::finite;
use crate::types::lane::{Lane, LaneGroup};
use crate::types::names::{Name, Names};
use crate::types::profile::Profile;
use crate::types::steps::{Starts, Steps};
use crate::types::value::{ContactPoint, LayerKind, Side, flag, known, layer, number};

/// One `<lanes>` element. Until 1.8 a road has one; since 1.9 a temporary one may lie over it.
#[derive(Debug)]
pub struct LaneLayer<'a> {
    node: Node<'a>,
    index: u32,
    kind: LayerKind,
    offset: Profile<'a>,
    pub(crate) steps: Steps<LaneSection<'a>>,
    /// The first and the last section, each for the left and right side.
    terminal: [[Option<u32>; 2]; 2],
}

impl<'a> LaneLayer<'a> {
    pub(crate) fn read(
        node: Node<'a>,
        index: usize,
        road_length: f64,
        names: &Names,
    ) -> LaneLayer<'a> {
        let nodes = names.children(node, Name::LaneSection);
        let sections = nodes
            .zip(0..)
            .map(|(node, at)| LaneSection::read(node, at, names));
        let mut steps = Steps::new(sections.collect());
        let terminal = chain(&mut steps, road_length);
        LaneLayer {
            node,
            index: u32::try_from(index).unwrap_or(u32::MAX),
            kind: layer(node, "layer"),
            offset: Profile::read(node.children_named("laneOffset"), "s"),
            steps,
            terminal,
        }
    }

    /// Returns the `<lanes>` element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns the place among the layers of the road.
    #[inline]
    pub fn index(&self) -> usize {
        self.index as usize
    }

    /// Returns the kind of the layer: permanent or temporary.
    #[inline]
    pub fn kind(&self) -> LayerKind {
        self.kind
    }

    /// Returns the lane offset (11.5): t of the center lane over s.
    #[inline]
    pub fn offset(&self) -> &Profile<'a> {
        &self.offset
    }

    /// Returns the number of sections.
    pub fn section_count(&self) -> usize {
        self.steps.items().len()
    }

    /// Returns the place of the first or last section that is valid for a side.
    pub(crate) fn terminal(&self, side: Side, end: ContactPoint) -> Option<usize> {
        let at = match end {
            ContactPoint::Start => self.terminal[0],
            ContactPoint::End => self.terminal[1],
        };
        Some(at[slot(side)]? as usize)
    }
}

impl Starts for LaneSection<'_> {
    fn start(&self) -> f64 {
        self.s
    }
}

/// Sets the neighbours and the end of every section, for each side. A section ends where the next
/// one starts, after `@length` (1.9, temporary layer), or at the end of the road. Returns the first
/// and last section of both sides.
fn chain(steps: &mut Steps<LaneSection<'_>>, road_length: f64) -> [[Option<u32>; 2]; 2] {
    let order: Vec<usize> = (0..steps.ranks())
        .filter_map(|rank| steps.index(rank))
        .collect();
    let sides =
        Side::BOTH.map(|side| chain_side(steps.items_mut(), &order, slot(side), road_length));
    let [[left_first, left_last], [right_first, right_last]] = sides;
    [[left_first, right_first], [left_last, right_last]]
}

/// Does the work of [`chain`] for one side. Returns the first and last section of the side.
fn chain_side(
    sections: &mut [LaneSection<'_>],
    order: &[usize],
    slot: usize,
    road_length: f64,
) -> [Option<u32>; 2] {
    let (mut first, mut last) = (None, None);
    for at in order {
        let section = &mut sections[*at];
        section.previous[slot] = last;
        if section.sides[slot] {
            last = Some(section.index);
            first = first.or(last);
        }
    }
    let (mut next, mut end) = (None, road_length);
    for at in order.iter().rev() {
        let section = &mut sections[*at];
        section.next[slot] = next;
        section.ends[slot] = end.min(section.s + section.own_length);
        if section.sides[slot] {
            (next, end) = (Some(section.index), section.s);
        }
    }
    [first, last]
}

/// One `<laneSection>`.
#[derive(Debug)]
pub struct LaneSection<'a> {
    node: Node<'a>,
    index: u32,
    s: f64,
    /// End of the section for the left and right side. Not finite if unknown.
    ends: [f64; 2],
    /// The previous and the next section, for either side.
    previous: [Option<u32>; 2],
    next: [Option<u32>; 2],
    /// `@length`, or infinity if missing.
    own_length: f64,
    /// Whether the section covers the left and right side.
    sides: [bool; 2],
    lanes: Box<[Lane<'a>]>,
    /// Places in `lanes` from the center outward, left and right.
    outward: [Box<[u32]>; 2],
    /// Whether the ids of a side define the order of its lanes.
    numbered: [bool; 2],
    /// Whether a side has `<width>` records, computed on first use.
    widths: OnceLock<[bool; 2]>,
}

impl<'a> LaneSection<'a> {
    fn read(node: Node<'a>, index: u32, names: &Names) -> LaneSection<'a> {
        let mut lanes = Vec::new();
        for part in node.children() {
            let group = match names.name(part) {
                Name::Left => LaneGroup::Left,
                Name::Center => LaneGroup::Center,
                Name::Right => LaneGroup::Right,
                _ => continue,
            };
            let nodes = names.children(part, Name::Lane);
            lanes.extend(nodes.map(|node| Lane::read(node, group, names)));
        }
        let holds = |side: Side| lanes.iter().any(|lane| lane.group().side() == Some(side));
        let single = flag(node, "singleSide").unwrap_or(false);
        let sides = Side::BOTH.map(|side| !single || holds(side));
        let outward = Side::BOTH.map(|side| outward(&mut lanes, side));
        let numbered = [
            is_numbered(&lanes, &outward[0], Side::Left),
            is_numbered(&lanes, &outward[1], Side::Right),
        ];
        LaneSection {
            node,
            index,
            s: number(node, "s").unwrap_or(f64::NAN),
            ends: [f64::NAN; 2],
            previous: [None; 2],
            next: [None; 2],
            own_length: number(node, "length").unwrap_or(f64::INFINITY),
            sides,
            lanes: lanes.into(),
            outward: outward.map(Vec::into_boxed_slice),
            numbered,
            widths: OnceLock::new(),
        }
    }

    /// Returns the `<laneSection>` element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns the place among the sections of the layer, in document order.
    #[inline]
    pub fn index(&self) -> usize {
        self.index as usize
    }

    /// Returns `@s`, in metres.
    #[inline]
    pub fn s(&self) -> Option<f64> {
        known(self.s)
    }

    /// Returns `@singleSide`.
    pub fn single_side(&self) -> Option<bool> {
        flag(self.node, "singleSide")
    }

    /// Checks whether the section covers this side. A section for a single side does not cover the
    /// other.
    #[inline]
    pub fn covers(&self, side: Side) -> bool {
        self.sides[slot(side)]
    }

    /// Returns the end of the section for a side, in metres along s.
    #[inline]
    pub fn end(&self, side: Side) -> Option<f64> {
        finite(self.ends[slot(side)])
    }

    /// Returns the length for a side in metres. It is zero or negative in faulty files.
    #[inline]
    pub fn length(&self, side: Side) -> Option<f64> {
        finite(self.end(side)? - self.s()?)
    }

    /// Returns the shortest length of all covered sides.
    pub fn shortest_length(&self) -> Option<f64> {
        let sides = Side::BOTH.into_iter().filter(|side| self.covers(*side));
        let lengths = sides
            .map(|side| self.length(side))
            .collect::<Option<Vec<f64>>>()?;
        lengths.into_iter().reduce(f64::min)
    }

    /// Checks whether the ids of a side define the order of its lanes, so that borders can be
    /// evaluated. There are at most 256 ids, all unique integers with the sign of the side.
    #[inline]
    pub fn is_numbered(&self, side: Side) -> bool {
        self.numbered[slot(side)]
    }

    /// Returns the previous or next section for a side.
    #[inline]
    pub(crate) fn beside(&self, side: Side, end: ContactPoint) -> Option<u32> {
        match end {
            ContactPoint::Start => self.previous[slot(side)],
            ContactPoint::End => self.next[slot(side)],
        }
    }

    /// Checks whether a lane of the side has `<width>` records. If so, `<border>` records of the
    /// side do not count (11.7.2).
    #[inline]
    pub fn has_widths(&self, side: Side) -> bool {
        let has = |at: &u32| !self.lanes[*at as usize].widths().is_empty();
        let any = |side| self.outward(side).iter().any(has);
        self.widths.get_or_init(|| Side::BOTH.map(any))[slot(side)]
    }

    #[inline]
    pub(crate) fn own_lanes(&self) -> &[Lane<'a>] {
        &self.lanes
    }

    #[inline]
    pub(crate) fn outward(&self, side: Side) -> &[u32] {
        &self.outward[slot(side)]
    }
}

/// Maximum number of lanes per side on a real road. A border is the sum of all inner widths. The
/// limit keeps the work on a hostile file linear.
const MAX_LANES: usize = 256;

fn slot(side: Side) -> usize {
    match side {
        Side::Left => 0,
        Side::Right => 1,
    }
}

/// Returns the places of a side's lanes from the center outward and sets the rank of each lane.
fn outward(lanes: &mut [Lane<'_>], side: Side) -> Vec<u32> {
    let of_side = lanes
        .iter()
        .zip(0_u32..)
        .filter(|(lane, _)| lane.group().side() == Some(side));
    let mut places: Vec<u32> = of_side.map(|(_, at)| at).collect();
    places.sort_by_key(|at| lanes[*at as usize].distance());
    for (at, rank) in places.iter().zip(0..) {
        lanes[*at as usize].set_rank(rank);
    }
    places
}

fn is_numbered(lanes: &[Lane<'_>], outward: &[u32], side: Side) -> bool {
    let id = |at: &u32| lanes[*at as usize].id();
    if outward.len() > MAX_LANES {
        return false;
    }
    let right_sign = outward
        .iter()
        .all(|at| id(at).and_then(Side::of_lane_id) == Some(side));
    right_sign && outward.windows(2).all(|pair| id(&pair[0]) != id(&pair[1]))
}
