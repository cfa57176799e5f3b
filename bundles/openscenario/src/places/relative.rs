//! Positions relative to another on the same road: the lane and the station.

use qcbus_opendrive::Road;

use crate::queries::element::Element;

/// A place on a road.
#[derive(Debug, Clone, Copy)]
pub struct OnRoad<'w, 'r> {
    /// The road.
    pub road: &'w Road<'r>,
    /// The station.
    pub s: f64,
    /// The distance to the left of the reference line.
    pub t: f64,
    /// The lane, if it is known.
    pub lane: Option<i64>,
    /// Whether an entity here certainly faces along the road.
    pub along: bool,
}

/// Returns the lanes that a `RelativeLanePosition` may mean. Tools disagree on whether the center
/// lane counts. Against the road they also disagree on which side is left.
pub fn lanes(position: Element<'_, '_>, on: OnRoad<'_, '_>) -> Option<Vec<i64>> {
    lanes_by(position.integer("dLane")?, on)
}

/// Like [`lanes`], for a change by a number of lanes.
pub fn lanes_by(by: i64, on: OnRoad<'_, '_>) -> Option<Vec<i64>> {
    let from = on.lane.filter(|lane| *lane != 0)?;
    let mut lanes = Vec::new();
    let signs: &[i64] = if on.along || by == 0 { &[1] } else { &[1, -1] };
    for sign in signs {
        let by = by.checked_mul(*sign)?;
        let plain = from.checked_add(by)?;
        let crosses = plain == 0 || (plain > 0) != (from > 0);
        if crosses {
            lanes.push(plain.checked_add(by.signum())?);
        }
        if plain != 0 {
            lanes.push(plain);
        }
    }
    Some(lanes)
}

/// Returns the possible distances along the road. Against the road there are two interpretations.
pub fn ways(position: Element<'_, '_>, on: OnRoad<'_, '_>) -> Option<Vec<f64>> {
    let ds = position.number("ds")?;
    let is_plain = on.along || ds == 0.0 || position.is("RelativeRoadPosition");
    Some(if is_plain { vec![ds] } else { vec![ds, -ds] })
}
