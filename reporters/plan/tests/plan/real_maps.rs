//! Tests with the maps of other projects, if they are available. Drawn lines must match the model.

use std::path::{Path, PathBuf};

use crate::support::{Border, Decoded, decode, with_bytes};
use qcbus_opendrive::{Edge, RoadMap, SectionRef};
use qcbus_plan::{Locator, Plan, Said};

/// Returns all maps below a directory, in a fixed order.
fn maps(directory: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(directory) else {
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let below = |path: PathBuf| {
        if path.is_dir() {
            maps(&path)
        } else {
            vec![path]
        }
    };
    let files = paths.into_iter().flat_map(below);
    files
        .filter(|path| path.extension().is_some_and(|suffix| suffix == "xodr"))
        .collect()
}

#[test]
fn borders_lie_within_two_centimetres_of_the_model() {
    let real = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases/real");
    let (mut seen, mut looked_at) = (0, 0);
    for path in maps(&real) {
        let bytes = std::fs::read(&path).unwrap();
        with_bytes(bytes, |map| {
            let plan = decode(&Plan::of(map).bytes());
            assert_eq!(plan.roads.len(), map.roads().len(), "{}", path.display());
            looked_at += borders(map, &plan, &path);
            everything_has_a_place(map, &path);
        });
        seen += 1;
    }
    if seen == 0 {
        println!("skipped: no maps in ../shared/cases/real");
        return;
    }
    println!("{looked_at} places on the borders of {seen} maps");
    assert!(looked_at > 10_000);
}

/// Checks some places of all lanes of a map. Returns their number.
fn borders(map: &RoadMap<'_>, plan: &Decoded, path: &Path) -> usize {
    let mut count = 0;
    for (road, drawn) in map.roads().iter().zip(&plan.roads) {
        for (section, drawn) in road.sections().zip(&drawn.sections) {
            let lanes = drawn.left.iter().chain(&drawn.right);
            for lane in lanes.filter(|lane| !lane.border.points.is_empty()) {
                for step in 0..7 {
                    let share = 0.03 + 0.15 * f64::from(step);
                    let Some(off) = off(section, lane.id, &lane.border, share, plan.origin) else {
                        continue;
                    };
                    count += 1;
                    let id = road.id();
                    let path = path.display();
                    assert!(
                        off <= 2.0,
                        "{path}, road {id}, lane {}, {share}: {off} cm",
                        lane.id
                    );
                }
            }
        }
    }
    count
}

/// Returns the distance between the outer border of a lane and its drawn line, in centimetres.
fn off(
    section: SectionRef<'_, '_>,
    lane: i64,
    drawn: &Border,
    share: f64,
    origin: [f64; 2],
) -> Option<f64> {
    let lane = section.lane(lane)?;
    let ds = share * lane.length()?;
    let t = lane.t(Edge::Outer, ds)?;
    let s = section.s()? + ds;
    // No line is drawn beyond the end of the reference line.
    section.road.plan_view().end().filter(|end| s < *end)?;
    let point = section.road.point(s, t, 0.0)?;
    let at = [100.0 * (point.x - origin[0]), 100.0 * (point.y - origin[1])];
    let places = drawn.places();
    let pairs = places.windows(2);
    let near = pairs.map(|pair| distance(at, pair[0], pair[1]));
    near.reduce(f64::min)
}

fn distance([x, y]: [f64; 2], from: [i64; 2], to: [i64; 2]) -> f64 {
    let [dx, dy] = [0, 1].map(|axis| (to[axis] - from[axis]) as f64);
    let (x, y) = (x - from[0] as f64, y - from[1] as f64);
    let square = dx * dx + dy * dy;
    let share = if square > 0.0 {
        ((x * dx + y * dy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (x - share * dx).hypot(y - share * dy)
}

/// Asserts that every hundredth element of the roads has a place.
fn everything_has_a_place(map: &RoadMap<'_>, path: &Path) {
    let locator = Locator::new(map);
    let drawable = map
        .roads()
        .iter()
        .filter(|road| road.plan_view().first().is_some());
    for road in drawable {
        let inside = road.node().descendants().step_by(100);
        for node in inside.chain([road.node()]) {
            let xpath = node.xpath();
            let said = Said {
                xpath: Some(&xpath),
                ..Said::default()
            };
            let spot = locator.locate(&said);
            assert!(
                spot.at.is_some() && spot.on.len() == 1,
                "{}: {xpath}",
                path.display()
            );
        }
    }
}
