//! Stretches on which a lane has no width (OpenDRIVE 1.9, 11.4).

use crate::prelude::*;

/// Width in metres up to which a lane counts as having none.
pub(crate) const NO_WIDTH: f64 = 0.001;

/// Returns the stretches of a lane without width, as start and end in metres from the start of the
/// section. Adjacent stretches are merged. Returns `None` if the lane has no widths.
pub(crate) fn zero_stretches(lane: LaneRef<'_, '_>) -> Option<Vec<(f64, f64)>> {
    let length = lane.length()?;
    let mut zero: Vec<(f64, f64)> = Vec::new();
    for stretch in lane.widths().stretches(length) {
        // Most stretches have width at their start, so the search for the maximum is skipped.
        if stretch.cubic.a > NO_WIDTH {
            continue;
        }
        let highest = stretch.cubic.maximum(0.0, stretch.length())?;
        if highest.value > NO_WIDTH {
            continue;
        }
        match zero.last_mut() {
            Some((_, to)) if (*to - stretch.from).abs() < 1e-9 => *to = stretch.to,
            _ => zero.push((stretch.from, stretch.to)),
        }
    }
    (!lane.widths().is_empty()).then_some(zero)
}
