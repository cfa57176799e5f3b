//! Lane layers and lane sections (OpenDRIVE 1.9, 11.2 to 11.5).

use std::sync::OnceLock;

use qcbus_document::Node;

use crate::geometry::finite;
use crate::lane::{Lane, LaneGroup};
use crate::names::{Name, Names};
use crate::profile::Profile;
use crate::road::Road;
use crate::section_ref::SectionRef;
use crate::station::Station;
use crate::steps::{Starts, Steps};
use crate::value::{ContactPoint, LayerKind, Side, flag, known, layer, number};

/// One `<lanes>` element: until 1.8 a road has one, since 1.9 a temporary one may lie over it.
#[derive(Debug)]
pub struct LaneLayer<'a> {
    node: Node<'a>,
    index: u32,
    kind: LayerKind,
    offset: Profile<'a>,
    steps: Steps<LaneSection<'a>>,
    /// The first and the last section, each for the left and the right side.
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

    /// The `<lanes>` element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Its place among the road's layers.
    #[inline]
    pub fn index(&self) -> usize {
        self.index as usize
    }

    /// Permanent or temporary.
    #[inline]
    pub fn kind(&self) -> LayerKind {
        self.kind
    }

    /// The lane offset (11.5): t of the center lane over s.
    #[inline]
    pub fn offset(&self) -> &Profile<'a> {
        &self.offset
    }

    /// How many sections there are.
    pub fn section_count(&self) -> usize {
        self.steps.items().len()
    }

    /// The sections in document order; `road` is the road that the layer belongs to.
    #[inline]
    pub fn sections<'m>(
        &'m self,
        road: &'m Road<'a>,
    ) -> impl DoubleEndedIterator<Item = SectionRef<'m, 'a>> {
        self.steps
            .items()
            .iter()
            .map(move |section| SectionRef::new(road, self, section))
    }

    /// The section at a place in document order.
    #[inline]
    pub fn section<'m>(&'m self, road: &'m Road<'a>, index: usize) -> Option<SectionRef<'m, 'a>> {
        let section = self.steps.items().get(index)?;
        Some(SectionRef::new(road, self, section))
    }

    /// The sections in ascending order of `@s`; none when one has no `@s`.
    pub fn in_order<'m>(
        &'m self,
        road: &'m Road<'a>,
    ) -> impl DoubleEndedIterator<Item = SectionRef<'m, 'a>> {
        self.steps
            .in_order()
            .map(move |section| SectionRef::new(road, self, section))
    }

    /// The section that holds for a side at `s`: the last of those for this side that start at
    /// or before it, unless it has ended.
    pub fn section_at<'m>(
        &'m self,
        road: &'m Road<'a>,
        side: Side,
        s: impl Into<Station>,
    ) -> Option<SectionRef<'m, 'a>> {
        let station = s.into();
        let last = self.steps.index(self.steps.rank_at(station)?)?;
        let mut section = self.section(road, last)?;
        if !section.covers(side) {
            section = section.previous(side)?;
        }
        let over = section.end(side).is_some_and(|end| station.is_after(end));
        let at_very_end = section.next(side).is_none() && section.end(side) == Some(station.x());
        (!over || at_very_end).then_some(section)
    }

    /// The first or the last section that holds for a side.
    pub fn end_section<'m>(
        &'m self,
        road: &'m Road<'a>,
        side: Side,
        end: ContactPoint,
    ) -> Option<SectionRef<'m, 'a>> {
        let at = match end {
            ContactPoint::Start => self.terminal[0],
            ContactPoint::End => self.terminal[1],
        };
        self.section(road, at[slot(side)]? as usize)
    }
}

impl Starts for LaneSection<'_> {
    fn start(&self) -> f64 {
        self.s
    }
}

/// Tells every section, side by side, its neighbours and where it ends: where the next section
/// takes over, where `@length` is used up (1.9, temporary layer), or where the road ends.
/// Returns the first and the last section of both sides.
fn chain(steps: &mut Steps<LaneSection<'_>>, road_length: f64) -> [[Option<u32>; 2]; 2] {
    let order: Vec<usize> = (0..steps.ranks())
        .filter_map(|rank| steps.index(rank))
        .collect();
    let sides =
        Side::BOTH.map(|side| chain_side(steps.items_mut(), &order, slot(side), road_length));
    let [[left_first, left_last], [right_first, right_last]] = sides;
    [[left_first, right_first], [left_last, right_last]]
}

/// [`chain`] for one side; returns its first and its last section.
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
    /// Where it ends for the left and for the right side; not finite when nobody knows.
    ends: [f64; 2],
    /// The sections before and after it, for either side.
    previous: [Option<u32>; 2],
    next: [Option<u32>; 2],
    /// `@length`, infinite when missing.
    own_length: f64,
    /// Whether it covers the left and the right side.
    sides: [bool; 2],
    lanes: Box<[Lane<'a>]>,
    /// Places in `lanes` from the center outward, left and right.
    outward: [Box<[u32]>; 2],
    /// Whether the ids of a side tell the order of its lanes.
    numbered: [bool; 2],
    /// Whether a side has `<width>` records; found when first asked.
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

    /// The `<laneSection>` element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Its place among the sections of its layer, in document order.
    #[inline]
    pub fn index(&self) -> usize {
        self.index as usize
    }

    /// `@s`, in metres.
    #[inline]
    pub fn s(&self) -> Option<f64> {
        known(self.s)
    }

    /// `@singleSide`.
    pub fn single_side(&self) -> Option<bool> {
        flag(self.node, "singleSide")
    }

    /// Whether the section says something about this side: a section for a single side is silent
    /// about the other.
    #[inline]
    pub fn covers(&self, side: Side) -> bool {
        self.sides[slot(side)]
    }

    /// Where the section ends for a side, in metres along s.
    #[inline]
    pub fn end(&self, side: Side) -> Option<f64> {
        finite(self.ends[slot(side)])
    }

    /// The length for a side in metres; zero or negative in faulty files.
    #[inline]
    pub fn length(&self, side: Side) -> Option<f64> {
        finite(self.end(side)? - self.s()?)
    }

    /// The length over all sides that it covers: the shorter one if they differ.
    pub fn shortest_length(&self) -> Option<f64> {
        let sides = Side::BOTH.into_iter().filter(|side| self.covers(*side));
        let lengths = sides
            .map(|side| self.length(side))
            .collect::<Option<Vec<f64>>>()?;
        lengths.into_iter().reduce(f64::min)
    }

    /// Whether the ids of a side tell the order of its lanes: all are integers of the side's
    /// sign, none occurs twice, and there are at most 256. Otherwise its borders cannot be evaluated.
    #[inline]
    pub fn is_numbered(&self, side: Side) -> bool {
        self.numbered[slot(side)]
    }

    /// The section before or after it for a side.
    #[inline]
    pub(crate) fn beside(&self, side: Side, end: ContactPoint) -> Option<u32> {
        match end {
            ContactPoint::Start => self.previous[slot(side)],
            ContactPoint::End => self.next[slot(side)],
        }
    }

    /// Whether a side has widths, as `any` finds out when it is asked for the first time.
    #[inline]
    pub(crate) fn widths_or(&self, side: Side, any: impl Fn(Side) -> bool) -> bool {
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

/// More lanes on one side than this are no road any more. Borders add up all widths further in,
/// so that a limit keeps the work on a hostile file linear.
const MAX_LANES: usize = 256;

fn slot(side: Side) -> usize {
    match side {
        Side::Left => 0,
        Side::Right => 1,
    }
}

/// The places of a side's lanes from the center outward; every lane learns its rank.
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
