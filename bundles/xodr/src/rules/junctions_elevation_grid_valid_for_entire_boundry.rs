use crate::families::junction_area::{beside, boundary, reference_line, ring};
use crate::prelude::*;
use qcbus_opendrive::ElevationGrid;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.01,
    "m",
    "maximum distance by which the junction may extend beyond the grid",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let line = reference_line(junction);
        if let (Some(grid), Some(line)) = (junction.elevation_grid(), line)
            && let Some(stretches) = boundary(map, junction)
        {
            check(junction, grid, &line, &ring(&stretches), found);
        }
    }
}

fn check(
    junction: &Junction<'_>,
    grid: ElevationGrid<'_>,
    line: &Placed,
    ring: &[Point],
    found: &mut Sink<'_>,
) {
    let Some(area) = Area::of(grid) else { return };
    let beyond = ring.iter().map(|point| {
        let (s, t) = beside(line, *point);
        (area.beyond(s, t), *point)
    });
    let worst = beyond.max_by(|one, other| one.0.total_cmp(&other.0));
    if let Some((beyond, point)) = worst.filter(|(beyond, _)| *beyond > found.number(&TOLERANCE)) {
        let text = format!(
            "the boundary of junction `{}` extends {beyond:.2} m beyond its elevation grid; the grid must cover \
             all of it",
            junction.id()
        );
        found.issue(grid.node(), text).point(point.x, point.y, 0.0);
    }
}

/// The extent of the rows of a grid.
struct Area {
    start: f64,
    spacing: f64,
    /// Extent to the left and to the right, in metres.
    rows: Vec<(f64, f64)>,
}

impl Area {
    fn of(grid: ElevationGrid<'_>) -> Option<Area> {
        let spacing = grid.grid_spacing().filter(|spacing| *spacing > 0.0)?;
        let rows = grid.rows().map(|row| {
            let reach = |heights: Vec<f64>| heights.len() as f64 * spacing;
            Some((reach(row.left()?), reach(row.right()?)))
        });
        let rows = rows.collect::<Option<Vec<_>>>()?;
        let start = grid.s_start()?;
        (!rows.is_empty()).then_some(Area {
            start,
            spacing,
            rows,
        })
    }

    /// Returns the distance of a position from the grid, negative inside.
    fn beyond(&self, s: f64, t: f64) -> f64 {
        let along = (s - self.start) / self.spacing;
        let last = (self.rows.len() - 1) as f64;
        let outside = (-along).max(along - last) * self.spacing;
        // The position lies between these two rows. Both must cover it.
        let around =
            [along.floor(), along.ceil()].map(|row| self.rows[row.clamp(0.0, last) as usize]);
        let aside = around.map(|(left, right)| (t - left).max(-t - right));
        outside.max(aside[0]).max(aside[1])
    }
}
