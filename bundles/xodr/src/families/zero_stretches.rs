//! Stretches over which a lane has no width (OpenDRIVE 1.9, 11.4).

use qcbus_opendrive::LaneRef;

/// Up to which width, in metres, a lane has none.
pub(crate) const NO_WIDTH: f64 = 0.001;

/// The stretches of a lane without width, from and to in metres from the section's start; those
/// that touch are one. `None` when the lane has no widths.
pub(crate) fn zero_stretches(lane: LaneRef<'_, '_>) -> Option<Vec<(f64, f64)>> {
    let length = lane.length()?;
    let mut zero: Vec<(f64, f64)> = Vec::new();
    for stretch in lane.widths().stretches(length) {
        // Most have width at their start: no need to look for the widest place.
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
