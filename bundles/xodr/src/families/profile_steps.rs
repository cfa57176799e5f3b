//! Checks for steps in elevation and lateral profile (OpenDRIVE 1.9, 10.5, annex D.1.4).

use std::collections::BTreeSet;

use super::gap_levels::Misfit;
use super::on_road::OnRoad;
use super::shown::number;
use super::touching::STEP;
use crate::prelude::*;

/// Returns the starts of all records except the first, with their elements.
fn breaks<'p, 'a>(profile: &'p Profile<'a>) -> impl Iterator<Item = (f64, Node<'a>)> + use<'p, 'a> {
    let inner = profile.in_order().skip(1);
    inner.filter_map(|record| Some((record.start()?, record.node())))
}

/// Reports steps of the elevation.
pub(crate) fn elevation(road: &Road<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&STEP);
    let profile = road.elevation();
    for (s, node) in breaks(profile) {
        let (Some(before), Some(after)) = (profile.at(Station::before(s)), profile.at(s)) else {
            continue;
        };
        let step = (after - before).abs();
        if step > limit {
            let text = format!(
                "the elevation of road `{}` jumps from {before:.3} m to {after:.3} m at s = {}; at most \
                 {limit} m is allowed",
                road.id(),
                number(s)
            );
            let misfit = Misfit::step(step, found);
            misfit.put(found.issue(node, text)).on(road, s, 0.0);
        }
    }
}

/// Reports steps of superelevation and cross section surface within the width of the lanes.
pub(crate) fn lateral(road: &Road<'_>, found: &mut Sink<'_>) {
    let lateral = road.lateral();
    let roll = &lateral.superelevation;
    for (s, node) in breaks(roll) {
        let (Some(before), Some(after)) = (roll.at(Station::before(s)), roll.at(s)) else {
            continue;
        };
        let step = move |t: f64| Some(t * (after.sin() - before.sin()));
        report(road, "superelevation", s, node, step, found);
    }
    let Some(surface) = &lateral.cross_section_surface else {
        return;
    };
    let of_strips = surface
        .strips
        .iter()
        .flat_map(|strip| strip.coefficients.iter().chain([&strip.width]));
    let mut seen = BTreeSet::new();
    for (s, node) in of_strips.chain([&surface.t_offset]).flat_map(breaks) {
        // Several components may have a record at the same place. One check covers all of them.
        if seen.insert(s.to_bits()) {
            let step =
                |t: f64| Some(surface.height(s, t)? - surface.height(Station::before(s), t)?);
            report(road, "cross section surface", s, node, step, found);
        }
    }
}

fn report(
    road: &Road<'_>,
    what: &str,
    s: f64,
    node: Node<'_>,
    step: impl Fn(f64) -> Option<f64>,
    found: &mut Sink<'_>,
) {
    let limit = found.number(&STEP);
    let edges = Side::BOTH.map(|side| {
        let section = road.permanent()?.section_at(road, side, s)?;
        section.edge_t(side, s - section.s()?)
    });
    let [Some(left), Some(right)] = edges else {
        return;
    };
    // The points halfway are checked as well, because a surface may be curved.
    let places = [left, right, 0.5 * left, 0.5 * right, 0.5 * (left + right)];
    let steps = places.into_iter().filter_map(|t| Some((t, step(t)?.abs())));
    let worst = steps.max_by(|one, other| one.1.total_cmp(&other.1));
    if let Some((t, step)) = worst.filter(|(_, step)| *step > limit) {
        let text = format!(
            "the {what} of road `{}` jumps at s = {}: the surface at t = {t:.2} changes by {step:.3} m; at most \
             {limit} m is allowed",
            road.id(),
            number(s)
        );
        let misfit = Misfit::step(step, found);
        misfit.put(found.issue(node, text)).on(road, s, t);
    }
}
