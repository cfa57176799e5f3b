use crate::families::junction_area::{beside, boundary, reference_line};
use crate::families::on_road::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::ElevationGrid;

const STEP: Param = Param::number(
    "step",
    0.05,
    "m",
    "maximum accepted difference in height between road and grid",
);

/// Number of places across the mouth of a road at which heights are compared.
const SAMPLES: usize = 5;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.8.0..",
    params: &[STEP],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let (Some(grid), Some(line)) = (junction.elevation_grid(), reference_line(junction)) else {
            continue;
        };
        let (Some(grid), Some(stretches)) = (Heights::of(grid), boundary(map, junction)) else {
            continue;
        };
        for stretch in &stretches {
            // A transition connects different heights, so only joints without one are checked.
            let joint = stretch.segment.kind() == Some("joint");
            let sudden = stretch
                .segment
                .node()
                .attribute("transitionLength")
                .is_none()
                || stretch.segment.transition_length() == Some(0.0);
            let ends = stretch.first().zip(stretch.last());
            let road = stretch.segment.road_id().and_then(|id| map.road(id));
            if let (true, true, Some(ends), Some(road)) = (joint, sudden, ends, road) {
                check(
                    junction,
                    (&grid, &line),
                    (road, stretch.segment),
                    ends,
                    found,
                );
            }
        }
    }
}

fn check(
    junction: &Junction<'_>,
    (grid, line): (&Heights, &Placed),
    (road, segment): (&Road<'_>, BoundarySegment<'_>),
    (one, other): (Point, Point),
    found: &mut Sink<'_>,
) {
    let end = segment.contact_point();
    let Some((s, pose)) = end.and_then(|end| road.end_s(end).zip(road.end_pose(end))) else {
        return;
    };
    let (sin, cos) = pose.hdg.sin_cos();
    let steps = (0..SAMPLES).filter_map(|index| {
        let share = index as f64 / (SAMPLES - 1) as f64;
        let point = Point {
            x: one.x + share * (other.x - one.x),
            y: one.y + share * (other.y - one.y),
        };
        let t = (point.y - pose.y) * cos - (point.x - pose.x) * sin;
        let frame = road.end_frame(end?)?;
        let (_, up) = frame.tilted(t, road.lateral().height(s, t)?);
        let here = frame.z + up;
        let (grid_s, grid_t) = beside(line, point);
        let readings = grid.at(grid_s, grid_t)?;
        let nearest = readings
            .into_iter()
            .min_by(|one, other| (one - here).abs().total_cmp(&(other - here).abs()))?;
        Some((nearest - here, here, nearest, t))
    });
    let worst = steps.max_by(|one, other| one.0.abs().total_cmp(&other.0.abs()));
    let limit = found.number(&STEP);
    if let Some((step, here, there, t)) = worst.filter(|worst| worst.0.abs() > limit) {
        let text = format!(
            "road `{}` meets junction `{}` at a height of {here:.3} m, where the elevation grid has {there:.3} \
             m: a step of {:.3} m; without `transitionLength`, at most {limit} m is allowed",
            road.id(),
            junction.id(),
            step.abs()
        );
        found.issue(segment.node(), text).on(road, s, t);
    }
}

/// The heights of a grid, by row from right to left, with the index of the reference line.
struct Heights {
    start: f64,
    spacing: f64,
    rows: Vec<(Vec<f64>, usize)>,
}

impl Heights {
    fn of(grid: ElevationGrid<'_>) -> Option<Heights> {
        let rows = grid.rows().map(|row| {
            let mut heights = row.right()?;
            heights.reverse();
            let center = heights.len();
            heights.push(row.center()?);
            heights.extend(row.left()?);
            Some((heights, center))
        });
        Some(Heights {
            start: grid.s_start()?,
            spacing: grid.grid_spacing().filter(|spacing| *spacing > 0.0)?,
            rows: rows.collect::<Option<Vec<_>>>()?,
        })
    }

    /// Returns the height by linear and by cubic interpolation, or `None` outside the grid.
    fn at(&self, s: f64, t: f64) -> Option<[f64; 2]> {
        // A position on the last row belongs to the square before it.
        let split = |x: f64| {
            let cell = (x + 1e-9).floor();
            (cell as i64, (x - cell).clamp(0.0, 1.0))
        };
        let (row, along) = split((s - self.start) / self.spacing);
        let (column, across) = split(t / self.spacing);
        let height = |row: i64, column: i64| {
            let (heights, center) = self.rows.get(usize::try_from(row).ok()?)?;
            let column = column.checked_add(i64::try_from(*center).ok()?)?;
            heights.get(usize::try_from(column).ok()?).copied()
        };
        let line = |row: i64| {
            let points = [-1, 0, 1, 2].map(|by| height(row, column.saturating_add(by)));
            interpolated(points, across)
        };
        let rows = [-1, 0, 1, 2].map(|by| line(row.saturating_add(by)));
        let straight = interpolated(
            [None, rows[1].map(|it| it[0]), rows[2].map(|it| it[0]), None],
            along,
        )?;
        let cubic = interpolated(rows.map(|it| it.map(|it| it[1])), along)?;
        Some([straight[0], cubic[1]])
    }
}

/// Interpolates between the second and the third of four heights: linear, and cubic with slopes
/// from the neighbours if both exist. `share` is the fraction of the distance.
fn interpolated([before, from, to, after]: [Option<f64>; 4], share: f64) -> Option<[f64; 2]> {
    let from = from?;
    let to = match to {
        Some(to) => to,
        None if share < 1e-6 => from,
        None => return None,
    };
    let straight = from + share * (to - from);
    let (Some(before), Some(after)) = (before, after) else {
        return Some([straight, straight]);
    };
    let slopes = [0.5 * (to - before), 0.5 * (after - from)];
    let (square, cube) = (share * share, share * share * share);
    let cubic = from
        + slopes[0] * share
        + (3.0 * (to - from) - 2.0 * slopes[0] - slopes[1]) * square
        + (2.0 * (from - to) + slopes[0] + slopes[1]) * cube;
    Some([straight, cubic])
}
