//! Lanes and their records (OpenDRIVE 1.9, 11.3, 11.6, 11.7).

use std::sync::OnceLock;

use qcbus_document::Node;

use crate::types::frame::BorderPoint;
use crate::types::names::{Name, Names};
use crate::types::profile::Profile;
use crate::types::station::Station;
use crate::types::steps::{Starts, Steps};
use crate::types::value::{ContactPoint, Side, flag, known, numbers, parse_flag, parse_integer};
use crate::types::view::view;

/// The part of a lane section that contains a lane.
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
    /// Returns the side of the road, or `None` for the center.
    pub fn side(self) -> Option<Side> {
        match self {
            LaneGroup::Left => Some(Side::Left),
            LaneGroup::Center => None,
            LaneGroup::Right => Some(Side::Right),
        }
    }
}

/// One `<lane>`. Its records are read on first use.
#[derive(Debug)]
pub struct Lane<'a> {
    node: Node<'a>,
    id: Option<i64>,
    group: LaneGroup,
    /// Rank on its side, counted from the center outward.
    rank: u32,
    id_text: Option<&'a str>,
    kind: Option<&'a str>,
    level: Option<bool>,
    /// Whether the lane has an attribute about the direction of traffic. Few lanes have one.
    has_direction: bool,
    link: Option<Node<'a>>,
    /// Links at the start and at the end.
    linked: [Linked<'a>; 2],
    /// Set of the child element names, by [`Name::bit`].
    has: u32,
    records: OnceLock<Box<LaneRecords<'a>>>,
    /// Borders at the start and at the end, computed on first use.
    borders: [OnceLock<Box<Borders>>; 2],
}

/// The links of a lane at an end. Most lanes have at most one.
#[derive(Debug, Clone, Copy, Default)]
enum Linked<'a> {
    #[default]
    Nowhere,
    Once(Node<'a>),
    /// Several links, which are looked up on demand.
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

/// The records that define the shape of a lane.
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

    /// Returns the `<lane>` element.
    #[inline]
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns `@id` if it is an integer.
    #[inline]
    pub fn id(&self) -> Option<i64> {
        self.id
    }

    /// Returns `@id` as written.
    #[inline]
    pub fn id_text(&self) -> Option<&'a str> {
        self.id_text
    }

    /// Returns the group that contains the lane, regardless of its id.
    #[inline]
    pub fn group(&self) -> LaneGroup {
        self.group
    }

    /// Returns `@type`.
    #[inline]
    pub fn kind(&self) -> Option<&'a str> {
        self.kind
    }

    /// Returns `@level`: whether the lane is outside of the lateral profile; false when missing.
    #[inline]
    pub fn level(&self) -> Option<bool> {
        self.level
    }

    /// Returns `@direction`: `standard`, `reversed` or `both`.
    pub fn direction(&self) -> Option<&'a str> {
        self.has_direction.then(|| self.node.attr("direction"))?
    }

    /// Returns `@dynamicLaneDirection`.
    pub fn dynamic_direction(&self) -> Option<bool> {
        self.has_direction
            .then(|| flag(self.node, "dynamicLaneDirection"))?
    }

    /// Returns `@advisory`.
    pub fn advisory(&self) -> Option<&'a str> {
        self.node.attr("advisory")
    }

    /// Returns the links at an end: any number of `<predecessor>` or `<successor>` elements.
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

    /// Returns the `<width>` records (11.7.1): metres over the distance from the section's start.
    #[inline]
    pub fn widths(&self) -> &Profile<'a> {
        &self.records().widths
    }

    /// Returns the `<border>` records (11.7.2): t of the outer border.
    #[inline]
    pub fn borders(&self) -> &Profile<'a> {
        &self.records().borders
    }

    /// Returns the `<height>` records (11.7.3) in document order.
    #[inline]
    pub fn heights(&self) -> &[LaneHeight<'a>] {
        self.records().heights.items()
    }

    /// Returns records by name, in document order: `roadMark`, `material`, `speed`, `access`,
    /// `rule`.
    pub fn records_named<'s>(
        &self,
        name: &'s str,
    ) -> impl Iterator<Item = LaneRecord<'a>> + use<'a, 's> {
        self.elements(name).map(LaneRecord::of)
    }

    /// Returns the child elements of any name. The call is cheap if there are none.
    #[inline]
    pub fn elements<'s>(&self, name: &'s str) -> impl Iterator<Item = Node<'a>> + use<'a, 's> {
        let any = self.has & Name::bit_of(name) != 0;
        let node = any.then_some(self.node).into_iter();
        node.flat_map(move |node| node.children_named(name))
    }

    /// Returns the borders at an end. On first use, `find` computes them.
    pub(crate) fn borders_or(&self, end: ContactPoint, find: impl FnOnce() -> Borders) -> &Borders {
        let slot = match end {
            ContactPoint::Start => &self.borders[0],
            ContactPoint::End => &self.borders[1],
        };
        slot.get_or_init(|| Box::new(find()))
    }

    /// Returns the heights of the inner and outer border above the road surface at `ds`, in metres.
    /// They come from the valid height record and are zero without a record.
    pub fn lift(&self, ds: impl Into<Station>) -> Option<(f64, f64)> {
        let (heights, ds) = (&self.records().heights, ds.into());
        if heights.silent_at(ds) {
            return Some((0.0, 0.0));
        }
        let record = heights.ranked(heights.rank_at(ds)?)?;
        Some((record.inner()?, record.outer()?))
    }

    /// Returns the absolute value of the id. Lanes without an id are farthest out.
    #[inline]
    pub(crate) fn distance(&self) -> u64 {
        self.id.map_or(u64::MAX, i64::unsigned_abs)
    }

    /// Returns the rank on its side, counted from the center outward from zero.
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

    /// Returns the element.
    #[inline]
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns `@sOffset`, in metres from the section's start.
    pub fn s_offset(&self) -> Option<f64> {
        known(self.s_offset)
    }

    /// Returns `@inner`: the height of the inner border above the road surface, in metres.
    pub fn inner(&self) -> Option<f64> {
        known(self.inner)
    }

    /// Returns `@outer`: the height of the outer border above the road surface, in metres.
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
