//! From the map's coordinates to those of the plan.

use qcbus_opendrive::RoadMap;
use qcbus_opendrive::geometry::Point;

/// How far from the origin a point of the plan may lie, in metres: no road network is wider.
const FARTHEST: f64 = 1_000_000.0;

/// A place in the plan, in centimetres from the origin, not yet rounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spot {
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Spot {
    /// In whole centimetres, as the plan is written.
    pub(crate) fn rounded(self) -> [i64; 2] {
        // Saturates, and what is an `Shift`'s lies far within.
        [self.x.round() as i64, self.y.round() as i64]
    }
}

/// The line between two places.
pub(crate) struct Segment {
    from: Spot,
    along: Spot,
    /// One over the square of its length; zero when it has none.
    inverse: f64,
}

impl Segment {
    pub(crate) fn between(from: Spot, to: Spot) -> Segment {
        let along = Spot {
            x: to.x - from.x,
            y: to.y - from.y,
        };
        let square = along.x * along.x + along.y * along.y;
        let inverse = if square > 0.0 { 1.0 / square } else { 0.0 };
        Segment {
            from,
            along,
            inverse,
        }
    }

    /// The square of the distance to a place, in square centimetres.
    pub(crate) fn square(&self, at: Spot) -> f64 {
        let (x, y) = (at.x - self.from.x, at.y - self.from.y);
        let share = ((x * self.along.x + y * self.along.y) * self.inverse).clamp(0.0, 1.0);
        let (x, y) = (x - share * self.along.x, y - share * self.along.y);
        x * x + y * y
    }
}

/// The middle of the roads, which the plan's coordinates are counted from. Large coordinates (UTM) lose their
/// digits in single precision and their bytes in a file unless they are shifted first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Shift {
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Shift {
    /// The median of the starts of all roads, in whole metres: one road at the end of the world does not move it.
    pub(crate) fn of(map: &RoadMap<'_>) -> Shift {
        let starts = map.roads().iter();
        let starts = starts.filter_map(|road| road.plan_view().in_order().next()?.start_point());
        let (mut xs, mut ys): (Vec<f64>, Vec<f64>) = starts.map(|point| (point.x, point.y)).unzip();
        Shift {
            x: median(&mut xs).floor(),
            y: median(&mut ys).floor(),
        }
    }

    /// The place of a point in the plan; `None` when it is farther away than any road can be.
    pub(crate) fn spot(self, point: Point) -> Option<Spot> {
        let (x, y) = (point.x - self.x, point.y - self.y);
        // NaN is in no range.
        let near = |value: f64| value.abs() <= FARTHEST;
        (near(x) && near(y)).then_some(Spot {
            x: 100.0 * x,
            y: 100.0 * y,
        })
    }

    /// Where a place of the plan lies on the map, in metres.
    pub(crate) fn unshifted(self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x + x / 100.0, self.y + y / 100.0]
    }
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
