//! Lanes and their records (OpenDRIVE 1.9, 11.3, 11.6, 11.7).

use std::sync::OnceLock;

use qcbus_document::Node;

use crate::names::{Name, Names};
use crate::profile::Profile;
use crate::station::Station;
use crate::steps::{Starts, Steps};
use crate::surface::BorderPoint;
use crate::value::{ContactPoint, Side, flag, known, numbers, parse_flag, parse_integer};
use crate::view::view;

/// The part of a lane section in which a lane is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LaneGroup {
    /// `<left>`
    Left,
    /// `<center>`
    Center,
    /// `<right>`
    Right,
}

impl LaneGroup {
    /// The group that an element stands for.
    pub fn of(node: Node<'_>) -> Option<LaneGroup> {
        match node.name() {
            "left" => Some(LaneGroup::Left),
            "center" => Some(LaneGroup::Center),
            "right" => Some(LaneGroup::Right),
            _ => None,
        }
    }

    /// The side of the road; `None` for the center.
    pub fn side(self) -> Option<Side> {
        match self {
            LaneGroup::Left => Some(Side::Left),
            LaneGroup::Center => None,
            LaneGroup::Right => Some(Side::Right),
        }
    }
}

/// One `<lane>`; its records are read when first asked for.
#[derive(Debug)]
pub struct Lane<'a> {
    node: Node<'a>,
    id: Option<i64>,
    group: LaneGroup,
    /// Its place on its side, counted from the center outward.
    rank: u32,
    id_text: Option<&'a str>,
    kind: Option<&'a str>,
    level: Option<bool>,
    /// Whether it says anything about the direction of traffic: hardly any does.
    has_direction: bool,
    link: Option<Node<'a>>,
    /// What it is linked to at its start and at its end.
    linked: [Linked<'a>; 2],
    /// Which elements it has, by [`Name::bit`].
    has: u32,
    records: OnceLock<Box<LaneRecords<'a>>>,
    /// Its borders at the start and at the end, once somebody has asked.
    borders: [OnceLock<Box<Borders>>; 2],
}

/// The links of a lane at an end, of which there mostly is one at most.
#[derive(Debug, Clone, Copy, Default)]
enum Linked<'a> {
    #[default]
    Nowhere,
    Once(Node<'a>),
    /// They are looked up when somebody asks.
    Several,
}

impl<'a> Linked<'a> {
    fn with(self, link: Node<'a>) -> Linked<'a> {
        match self {
            Linked::Nowhere => Linked::Once(link),
            Linked::Once(_) | Linked::Several => Linked::Several,
        }
    }

    fn read(link: Node<'a>, names: &Names) -> [Linked<'a>; 2] {
        let mut linked = [Linked::Nowhere; 2];
        for child in link.children() {
            let slot = match names.name(child) {
                Name::Predecessor => &mut linked[0],
                Name::Successor => &mut linked[1],
                _ => continue,
            };
            *slot = slot.with(child);
        }
        linked
    }
}

/// The inner and the outer border of a lane at an end.
pub(crate) type Borders = [Option<BorderPoint>; 2];

/// The records that give a lane its shape.
#[derive(Debug)]
struct LaneRecords<'a> {
    widths: Profile<'a>,
    borders: Profile<'a>,
    heights: Steps<LaneHeight<'a>>,
}

impl<'a> Lane<'a> {
    pub(crate) fn read(node: Node<'a>, group: LaneGroup, names: &Names) -> Lane<'a> {
        let (mut id_text, mut kind, mut level) = (None, None, None);
        let mut has_direction = false;
        for attribute in node.attributes() {
            let slot = match attribute.name() {
                "id" => &mut id_text,
                "type" => &mut kind,
                "level" => &mut level,
                "direction" | "dynamicLaneDirection" => {
                    has_direction = true;
                    continue;
                }
                _ => continue,
            };
            *slot = slot.or(Some(attribute.value()));
        }
        let (mut has, mut link) = (0, None);
        for child in node.children() {
            let name = names.name(child);
            has |= name.bit();
            if name == Name::Link {
                link = link.or(Some(child));
            }
        }
        Lane {
            node,
            id: id_text.and_then(parse_integer),
            group,
            rank: 0,
            id_text,
            kind,
            level: level.map_or(Some(false), parse_flag),
            has_direction,
            link,
            linked: link.map_or_else(Default::default, |link| Linked::read(link, names)),
            has,
            records: OnceLock::new(),
            borders: [OnceLock::new(), OnceLock::new()],
        }
    }

    /// The `<lane>` element.
    #[inline]
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// `@id`, if it is an integer.
    #[inline]
    pub fn id(&self) -> Option<i64> {
        self.id
    }

    /// `@id` as written.
    #[inline]
    pub fn id_text(&self) -> Option<&'a str> {
        self.id_text
    }

    /// The group in which it is written, whatever its id says.
    #[inline]
    pub fn group(&self) -> LaneGroup {
        self.group
    }

    /// `@type`.
    #[inline]
    pub fn kind(&self) -> Option<&'a str> {
        self.kind
    }

    /// `@level`: whether the lane is kept out of the lateral profile; false when missing.
    #[inline]
    pub fn level(&self) -> Option<bool> {
        self.level
    }

    /// `@direction`: `standard`, `reversed` or `both`.
    pub fn direction(&self) -> Option<&'a str> {
        self.has_direction.then(|| self.node.attr("direction"))?
    }

    /// `@dynamicLaneDirection`.
    pub fn dynamic_direction(&self) -> Option<bool> {
        self.has_direction
            .then(|| flag(self.node, "dynamicLaneDirection"))?
    }

    /// `@advisory`.
    pub fn advisory(&self) -> Option<&'a str> {
        self.node.attr("advisory")
    }

    /// The `<link>` element.
    #[inline]
    pub fn link_node(&self) -> Option<Node<'a>> {
        self.link
    }

    /// The linked lanes at an end: `<predecessor>` or `<successor>` elements, of any number.
    #[inline]
    pub fn links(&self, end: ContactPoint) -> impl Iterator<Item = LaneLink<'a>> + use<'a> {
        let linked = match end {
            ContactPoint::Start => self.linked[0],
            ContactPoint::End => self.linked[1],
        };
        let (once, several) = match linked {
            Linked::Nowhere => (None, None),
            Linked::Once(link) => (Some(link), None),
            Linked::Several => (None, self.link),
        };
        let several = several.into_iter();
        let several = several.flat_map(move |link| link.children_named(end.link_name()));
        once.into_iter().chain(several).map(LaneLink::of)
    }

    #[inline]
    fn records(&self) -> &LaneRecords<'a> {
        self.records.get_or_init(|| {
            let nodes = |name: &'static str| self.elements(name);
            Box::new(LaneRecords {
                widths: Profile::read(nodes("width"), "sOffset"),
                borders: Profile::read(nodes("border"), "sOffset"),
                heights: Steps::new(nodes("height").map(LaneHeight::read).collect()),
            })
        })
    }

    /// The `<width>` records (11.7.1): metres over the distance from the section's start.
    #[inline]
    pub fn widths(&self) -> &Profile<'a> {
        &self.records().widths
    }

    /// The `<border>` records (11.7.2): t of the outer border.
    #[inline]
    pub fn borders(&self) -> &Profile<'a> {
        &self.records().borders
    }

    /// The `<height>` records (11.7.3) in document order.
    #[inline]
    pub fn heights(&self) -> &[LaneHeight<'a>] {
        self.records().heights.items()
    }

    /// Records of any name in document order: `roadMark`, `material`, `speed`, `access`, `rule`.
    pub fn records_named<'s>(
        &self,
        name: &'s str,
    ) -> impl Iterator<Item = LaneRecord<'a>> + use<'a, 's> {
        self.elements(name).map(LaneRecord::of)
    }

    /// The elements of any name directly within it; costs nothing where there are none.
    #[inline]
    pub fn elements<'s>(&self, name: &'s str) -> impl Iterator<Item = Node<'a>> + use<'a, 's> {
        let any = self.has & Name::bit_of(name) != 0;
        let node = any.then_some(self.node).into_iter();
        node.flat_map(move |node| node.children_named(name))
    }

    /// Its borders at an end, as `find` finds them when it is asked for the first time.
    pub(crate) fn borders_or(&self, end: ContactPoint, find: impl FnOnce() -> Borders) -> &Borders {
        let slot = match end {
            ContactPoint::Start => &self.borders[0],
            ContactPoint::End => &self.borders[1],
        };
        slot.get_or_init(|| Box::new(find()))
    }

    /// How far the height record that is valid at `ds` lifts the lane's borders above the road
    /// surface, inner and outer, in metres: zero without a record.
    pub fn lift(&self, ds: impl Into<Station>) -> Option<(f64, f64)> {
        let (heights, ds) = (&self.records().heights, ds.into());
        if heights.silent_at(ds) {
            return Some((0.0, 0.0));
        }
        let record = heights.ranked(heights.rank_at(ds)?)?;
        Some((record.inner()?, record.outer()?))
    }

    /// The absolute value of its id; lanes without one are farthest out.
    #[inline]
    pub(crate) fn distance(&self) -> u64 {
        self.id.map_or(u64::MAX, i64::unsigned_abs)
    }

    /// Its place on its side, counted from the center outward from zero.
    #[inline]
    pub(crate) fn rank(&self) -> u32 {
        self.rank
    }

    pub(crate) fn set_rank(&mut self, rank: u32) {
        self.rank = rank;
    }
}

/// A `<height>` record of a lane.
#[derive(Debug, Clone, Copy)]
pub struct LaneHeight<'a> {
    node: Node<'a>,
    s_offset: f64,
    inner: f64,
    outer: f64,
}

impl<'a> LaneHeight<'a> {
    fn read(node: Node<'a>) -> LaneHeight<'a> {
        let [s_offset, inner, outer] = numbers(node, ["sOffset", "inner", "outer"]);
        LaneHeight {
            node,
            s_offset,
            inner,
            outer,
        }
    }

    /// The element.
    #[inline]
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// `@sOffset`, in metres from the section's start.
    pub fn s_offset(&self) -> Option<f64> {
        known(self.s_offset)
    }

    /// `@inner`: height of the inner border above the road surface, in metres.
    pub fn inner(&self) -> Option<f64> {
        known(self.inner)
    }

    /// `@outer`: height of the outer border above the road surface, in metres.
    pub fn outer(&self) -> Option<f64> {
        known(self.outer)
    }
}

impl Starts for LaneHeight<'_> {
    fn start(&self) -> f64 {
        self.s_offset
    }
}

view! {
    /// A `<predecessor>` or `<successor>` of a lane (11.6).
    LaneLink {
        /// `@id`, if it is an integer.
        id: integer "id",
        /// `@id` as written.
        id_text: text "id",
        /// `@layer` of the linked lane; permanent when missing.
        layer: layer "layer",
    }
}

view! {
    /// Any record of a lane that starts at an offset within the section.
    LaneRecord {
        /// `@sOffset`, in metres from the section's start.
        s_offset: number "sOffset",
    }
}
