//! A road on the plan.

use qcbus_opendrive::Road;
use qcbus_opendrive::geometry::Cubic;

use crate::frame::{Piece, Rows};
use crate::origin::Shift;
use crate::sample::{NotDrawn, Sampler};
use crate::section::{self, SectionPlan, TOLERANCE};
use crate::simplify::{Vertex, profile};

/// Maximum number of straight lines for one record of the elevation.
const MOST_STEPS: f64 = 256.0;

#[derive(Debug, Default)]
pub(crate) struct RoadPlan<'a> {
    pub(crate) line: Vec<Vertex>,
    /// s and height, in centimetres.
    pub(crate) elevation: Vec<[f64; 2]>,
    pub(crate) sections: Vec<SectionPlan<'a>>,
}

/// Returns the road's part of the plan and the number of computed points, at most `work`.
pub(crate) fn road<'a>(
    road: &Road<'a>,
    origin: Shift,
    work: usize,
) -> (Result<RoadPlan<'a>, NotDrawn>, usize) {
    let mut sampler = Sampler { origin, left: work };
    let plan = draw(road, &mut sampler);
    (plan, work - sampler.left)
}

fn draw<'a>(road: &Road<'a>, sampler: &mut Sampler) -> Result<RoadPlan<'a>, NotDrawn> {
    let reach = section::reach(road).ok_or(NotDrawn::Nowhere)?;
    let mut rows = Rows::default();
    section::each_piece(reach, own_starts(road), |piece| {
        let piece = Piece::of(road, piece, vec![Cubic::default()]).ok_or(NotDrawn::Nowhere)?;
        sampler.take(&piece, &mut rows)
    })?;
    let mut own = own_starts(road);
    own.sort_unstable_by(f64::total_cmp);
    let mut sections = Vec::new();
    for layer in road.layers() {
        let offsets = layer.offset().records().iter();
        let mut offsets: Vec<f64> = offsets.filter_map(|record| record.start()).collect();
        offsets.sort_unstable_by(f64::total_cmp);
        for each in layer.sections(road) {
            sections.push(section::section(each, reach, [&own, &offsets], sampler)?);
        }
    }
    Ok(RoadPlan {
        line: section::reference_line(&rows),
        elevation: elevation(road, reach),
        sections,
    })
}

/// Returns the starts of geometries and superelevations.
fn own_starts(road: &Road<'_>) -> Vec<f64> {
    let geometries = road.plan_view().geometries().iter();
    let rolls = road.lateral().superelevation.records().iter();
    let starts = geometries.filter_map(|geometry| geometry.s());
    starts
        .chain(rolls.filter_map(|record| record.start()))
        .collect()
}

/// Returns the heights of the reference line; empty where they are undefined.
fn elevation(road: &Road<'_>, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let mut heights = Vec::new();
    for stretch in road.elevation().stretches(to) {
        let start = stretch.from.max(from);
        let length = stretch.to - start;
        let cubic = stretch.cubic.shifted(start - stretch.from);
        // A chord of length h lies at most h²/8·|f''| from the curve; f'' is largest at an end.
        let bent = cubic
            .second_derivative(0.0)
            .abs()
            .max(cubic.second_derivative(length).abs());
        let bend = 100.0 * bent * length * length / 8.0;
        let steps = (2.0 * bend / TOLERANCE).sqrt().ceil();
        let steps = if steps.is_nan() {
            1.0
        } else {
            steps.clamp(1.0, MOST_STEPS)
        };
        let mut step = 0.0;
        while length > 0.0 && step <= steps {
            let ds = length * (step / steps);
            let height = cubic.eval(ds).map(|z| [100.0 * (start + ds), 100.0 * z]);
            heights.extend(height);
            step += 1.0;
        }
    }
    profile(&heights, TOLERANCE / 2.0)
}
