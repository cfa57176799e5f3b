//! Places of findings on the plan.

mod element;
mod find;
mod paths;

use std::cell::{OnceCell, RefCell};
use std::collections::HashMap;

use qcbus_document::Node;
use qcbus_opendrive::geometry::Point;
use qcbus_opendrive::{Junction, Road, RoadMap};

use crate::hull::centroid;
use crate::junction::{Outlines, Roads};
use crate::origin::Shift;
use crate::plan::allowance;
use crate::road::{RoadPlan, road};
use paths::Paths;

/// Place data of a finding.
#[derive(Debug, Clone, Copy, Default)]
pub struct Said<'a> {
    /// XPath of an element of the map.
    pub xpath: Option<&'a str>,
    /// Id of a road, with s and t in metres.
    pub road: Option<(&'a str, f64, f64)>,
    /// x and y in metres, in the coordinates of the map.
    pub position: Option<(f64, f64)>,
}

/// Place of a finding on the plan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spot {
    /// x and y in metres, in the original coordinates of the map.
    pub at: Option<[f64; 2]>,
    /// Source of `at`; `None` if `at` is `None`.
    pub how: Option<How>,
    /// Targets of the finding, the most specific first.
    pub on: Vec<Target>,
}

/// Source of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// The finding gives x and y.
    Position,
    /// The finding gives road, s and t.
    Road,
    /// The finding names an element that has a place.
    Element,
}

/// An element of the plan, by its index in the plan's lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A road.
    Road {
        /// Index in the list of roads.
        road: usize,
    },
    /// A lane section.
    Section {
        /// Index of its road in the list of roads.
        road: usize,
        /// Index among the sections of the road, over all layers.
        section: usize,
    },
    /// A lane.
    Lane {
        /// Index of its road in the list of roads.
        road: usize,
        /// Index of its section among the sections of the road, over all layers.
        section: usize,
        /// Id of the lane.
        lane: i64,
    },
    /// A junction.
    Junction {
        /// Index in the list of junctions.
        junction: usize,
    },
    /// A signal.
    Signal {
        /// Index in the list of signals.
        signal: usize,
    },
    /// An object.
    Object {
        /// Index in the list of objects.
        object: usize,
    },
}

/// Locator of findings on the plan. Its lookups are cached and shared by all findings.
pub struct Locator<'m, 'a> {
    map: &'m RoadMap<'a>,
    origin: Shift,
    paths: Option<Paths<'a>>,
    signals: OnceCell<Vec<Node<'a>>>,
    objects: OnceCell<Vec<Node<'a>>>,
    junctions: RefCell<Junctions>,
}

/// Cached middles of junctions.
struct Junctions {
    outlines: OnceCell<Outlines>,
    middles: HashMap<usize, Option<[f64; 2]>>,
    /// Remaining number of road points that may be computed.
    left: usize,
}

/// Maximum number of road points that are computed for the middles of junctions.
const WORK: usize = 8_000_000;

impl std::fmt::Debug for Locator<'_, '_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Locator")
            .field("origin", &self.origin)
            .finish_non_exhaustive()
    }
}

impl<'m, 'a> Locator<'m, 'a> {
    /// Creates a locator for the plan of this map.
    pub fn new(map: &'m RoadMap<'a>) -> Locator<'m, 'a> {
        let root = map.root();
        Locator {
            map,
            origin: Shift::of(map),
            paths: root.map(|root| Paths::new(root.document())),
            signals: OnceCell::new(),
            objects: OnceCell::new(),
            junctions: RefCell::new(Junctions {
                outlines: OnceCell::new(),
                middles: HashMap::new(),
                left: WORK,
            }),
        }
    }

    /// Returns the place of a finding: its position, else road, s and t, else the element of its
    /// XPath. A place outside the plan (NaN, or more than 1,000 km from the middle) is ignored.
    pub fn locate(&self, said: &Said<'_>) -> Spot {
        let node = said.xpath.zip(self.paths.as_ref());
        let node = node.and_then(|(xpath, paths)| paths.find(xpath));
        let found = node.map(|node| self.element(node)).unwrap_or_default();
        let road = said.road.and_then(|(id, _, _)| self.road(id, node));
        let position = said.position.map(|(x, y)| Point { x, y });
        let on_road = || {
            let ((_, s, t), road) = said.road.zip(road)?;
            road.point(s, t, 0.0).map(|point| point.plan())
        };
        let ways = [
            (How::Position, self.on_plan(position)),
            (How::Road, self.on_plan(on_road())),
            (How::Element, self.on_plan(found.at)),
        ];
        let way = ways.into_iter().find_map(|(how, at)| Some((how, at?)));
        let mut on = found.on;
        if on.is_empty() {
            on.extend(road.map(|road| Target::Road { road: road.index() }));
        }
        Spot {
            at: way.map(|(_, at)| at),
            how: way.map(|(how, _)| how),
            on,
        }
    }

    /// Returns the road of a finding. Of several with this id, it is the one around the element.
    fn road(&self, id: &str, node: Option<Node<'a>>) -> Option<&'m Road<'a>> {
        let around = node.and_then(|node| self.map.road_of(node));
        around
            .filter(|road| road.id() == id)
            .or_else(|| self.map.road(id))
    }

    fn on_plan(&self, point: Option<Point>) -> Option<[f64; 2]> {
        let point = point?;
        self.origin.spot(point)?;
        Some([point.x, point.y])
    }

    /// Returns the middle of a junction's outline.
    fn middle(&self, junction: &Junction<'a>) -> Option<Point> {
        let mut junctions = self.junctions.borrow_mut();
        let junctions = &mut *junctions;
        if let Some(known) = junctions.middles.get(&junction.index()) {
            return known.map(|[x, y]| Point { x, y });
        }
        let mut outlines = junctions
            .outlines
            .take()
            .unwrap_or_else(|| Outlines::new(self.map));
        let mut roads = RoadsWhenAsked {
            map: self.map,
            origin: self.origin,
            left: &mut junctions.left,
        };
        let outline = outlines.outline(self.map, junction, &mut roads);
        let middle = centroid(&outline).map(|at| self.origin.unshifted(at));
        let _ = junctions.outlines.set(outlines);
        junctions.middles.insert(junction.index(), middle);
        middle.map(|[x, y]| Point { x, y })
    }
}

/// Roads that are drawn on demand for the outline of a junction.
struct RoadsWhenAsked<'m, 'a, 'w> {
    map: &'m RoadMap<'a>,
    origin: Shift,
    left: &'w mut usize,
}

impl Roads for RoadsWhenAsked<'_, '_, '_> {
    fn with<T>(&mut self, index: usize, look: impl FnOnce(&RoadPlan<'_>) -> T) -> Option<T> {
        let one = self.map.roads().get(index)?;
        let work = allowance(self.map, one).min(*self.left);
        let (drawn, spent) = road(one, self.origin, work);
        *self.left -= spent;
        drawn.ok().map(|plan| look(&plan))
    }
}
