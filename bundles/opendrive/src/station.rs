//! A position along a road, a lane section or across it, and from which side it is looked at.

/// Stations that differ by less than this, in metres, are the same: exporters write `1e-12`
/// for the start and `24.999999999999996` for 25.
const SAME_STATION: f64 = 1e-9;

/// A position along s or t, approached from above (what starts there is already valid) or from
/// below (what starts there is not valid yet).
///
/// A plain number is the usual case: `profile.at(12.5)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    x: f64,
    below: bool,
}

impl Station {
    /// At `x`: what starts at `x` is valid.
    #[inline]
    pub fn at(x: f64) -> Station {
        Station { x, below: false }
    }

    /// Just before `x`: what ends at `x` is still valid.
    #[inline]
    pub fn before(x: f64) -> Station {
        Station { x, below: true }
    }

    /// The coordinate.
    #[inline]
    pub fn x(self) -> f64 {
        self.x
    }

    /// The same station seen from an origin that lies `by` further back.
    #[inline]
    pub fn shifted(self, by: f64) -> Station {
        Station {
            x: self.x + by,
            ..self
        }
    }

    /// Whether something that starts at `start` is valid here.
    #[inline]
    pub fn is_after(self, start: f64) -> bool {
        start <= self.horizon()
    }

    /// Up to which start something is valid here.
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
