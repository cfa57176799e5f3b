use crate::families::written_numbers::{Written, shown};
use crate::prelude::*;
use qcbus_opendrive::{ElevationGrid, GridRow};

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

const CENTER: &str = "it must be the height on the reference line of the junction, in metres";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if let Some(grid) = junction.elevation_grid() {
            spacing(junction, grid, found);
            for row in grid.rows() {
                heights(row, found);
            }
        }
    }
}

/// Reports a spacing that is no number above zero. `numbers.computable` reports NaN and infinity.
fn spacing(junction: &Junction<'_>, grid: ElevationGrid<'_>, found: &mut Sink<'_>) {
    let Some(attribute) = grid.node().attribute("gridSpacing") else {
        return;
    };
    let text = attribute.value().trim();
    let is_odd = match grid.grid_spacing() {
        Some(spacing) => spacing <= 0.0,
        None => Written::read(text).is_none(),
    };
    if is_odd {
        let text = format!(
            "`gridSpacing` of the elevation grid of junction `{}` is `{}`; it must be the distance between two points in \
             metres, a number above 0, otherwise the heights have no places",
            junction.id(),
            shown(text)
        );
        found.issue(attribute, text);
    }
}

/// Reports the first height of each list that is not a number. `numbers.computable` reports NaN and
/// infinity.
fn heights(row: GridRow<'_>, found: &mut Sink<'_>) {
    for name in ["left", "center", "right"] {
        let Some(attribute) = row.node().attribute(name) else {
            if name == "center" {
                let text = format!("this `elevation` has no `center`; {CENTER}");
                found.issue(row.node(), text);
            }
            continue;
        };
        let list = attribute.value();
        let mut words = list.split_ascii_whitespace();
        if name == "center" && words.clone().next().is_none() {
            found.issue(attribute, format!("`center` is empty; {CENTER}"));
            continue;
        }
        let is_number = |word: &str| word.parse::<f64>().is_ok() || Written::read(word).is_some();
        if let Some(word) = words.find(|word| !is_number(word)) {
            let text = format!(
                "a height in `{name}` is `{}`, which is not a number; heights must be numbers in metres with a \
                 point as the decimal separator, separated by spaces",
                shown(word)
            );
            found.issue(attribute, text);
        }
    }
}
