//! A position along a road, along a lane section or across it, with the direction of approach.

/// Maximum distance between equal stations, in metres. Exporters write `1e-12` for the start and
/// `24.999999999999996` for 25.
const SAME_STATION: f64 = 1e-9;

/// A position along s or t, approached from above or from below. From above, elements that start
/// there are already valid. From below, they are not valid yet.
///
/// A plain number is the usual case: `profile.at(12.5)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    x: f64,
    below: bool,
}

impl Station {
    /// Returns the station at `x`. Elements that start at `x` are valid.
    #[inline]
    pub fn at(x: f64) -> Station {
        Station { x, below: false }
    }

    /// Returns the station just before `x`. Elements that end at `x` are still valid.
    #[inline]
    pub fn before(x: f64) -> Station {
        Station { x, below: true }
    }

    /// Returns the coordinate.
    #[inline]
    pub fn x(self) -> f64 {
        self.x
    }

    /// Returns the same station relative to an origin that is `by` further back.
    #[inline]
    pub fn shifted(self, by: f64) -> Station {
        Station {
            x: self.x + by,
            ..self
        }
    }

    /// Checks whether an element that starts at `start` is valid here.
    #[inline]
    pub fn is_after(self, start: f64) -> bool {
        start <= self.horizon()
    }

    /// Returns the largest start of an element that is valid here.
    #[inline]
    fn horizon(self) -> f64 {
        if self.below {
            self.x - SAME_STATION
        } else {
            self.x + SAME_STATION
        }
    }
}

impl From<f64> for Station {
    fn from(x: f64) -> Station {
        Station::at(x)
    }
}
