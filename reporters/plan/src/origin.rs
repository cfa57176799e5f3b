//! Conversion of map coordinates to plan coordinates.

use qcbus_opendrive::RoadMap;
use qcbus_opendrive::geometry::Point;

/// Maximum distance of a point of the plan from the origin, in metres: no road network is wider.
const FARTHEST: f64 = 1_000_000.0;

/// A place on the plan in centimetres from the origin, before rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spot {
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Spot {
    /// Returns the place in whole centimetres, as the plan stores it.
    pub(crate) fn rounded(self) -> [i64; 2] {
        // The conversion saturates, but values from a `Shift` are far below the limit.
        [self.x.round() as i64, self.y.round() as i64]
    }
}

/// A line segment between two places.
pub(crate) struct Segment {
    from: Spot,
    along: Spot,
    /// Inverse of the squared length; zero if the length is zero.
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

    /// Returns the squared distance to a place, in square centimetres.
    pub(crate) fn square(&self, at: Spot) -> f64 {
        let (x, y) = (at.x - self.from.x, at.y - self.from.y);
        let share = ((x * self.along.x + y * self.along.y) * self.inverse).clamp(0.0, 1.0);
        let (x, y) = (x - share * self.along.x, y - share * self.along.y);
        x * x + y * y
    }
}

/// The middle of the roads, the origin of the plan coordinates. Large coordinates (UTM) lose digits
/// in single precision and need more bytes in a file, so they are shifted first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Shift {
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Shift {
    /// Returns the median of the starts of all roads, in whole metres. A single road far away does
    /// not change it.
    pub(crate) fn of(map: &RoadMap<'_>) -> Shift {
        let starts = map.roads().iter();
        let starts = starts.filter_map(|road| road.plan_view().in_order().next()?.start_point());
        let (mut xs, mut ys): (Vec<f64>, Vec<f64>) = starts.map(|point| (point.x, point.y)).unzip();
        Shift {
            x: median(&mut xs).floor(),
            y: median(&mut ys).floor(),
        }
    }

    /// Returns the place of a point on the plan, or `None` if it is farther away than any road can
    /// be.
    pub(crate) fn spot(self, point: Point) -> Option<Spot> {
        let (x, y) = (point.x - self.x, point.y - self.y);
        // This comparison also excludes NaN.
        let near = |value: f64| value.abs() <= FARTHEST;
        (near(x) && near(y)).then_some(Spot {
            x: 100.0 * x,
            y: 100.0 * y,
        })
    }

    /// Converts a place of the plan to map coordinates, in metres.
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
