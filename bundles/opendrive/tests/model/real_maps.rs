//! Checks that the model understands the maps of other projects, if they are available.

use std::path::{Path, PathBuf};

use qcbus_document::Document;
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_opendrive::geometry::heading_difference;
use qcbus_opendrive::{Edge, LaneEnd, LaneJoint, RoadMap};

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

#[derive(Debug, Default)]
struct Seen {
    maps: usize,
    geometries: usize,
    not_evaluated: usize,
    gaps: usize,
    kinks: usize,
    joints: usize,
    torn: usize,
}

#[test]
fn reference_lines_are_continuous_and_linked_lanes_meet() {
    let real = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases/real");
    let mut seen = Seen::default();
    for path in maps(&real) {
        let bytes = std::fs::read(&path).expect("the map is readable");
        let image = prepare_bytes(&path, bytes, &Limits::default()).build();
        let map = RoadMap::new(Document::open(&image).expect("the image is valid"));
        seen.maps += 1;
        look_at_lines(&map, &mut seen);
        look_at_joints(&map, &mut seen, &path);
    }
    if seen.maps == 0 {
        println!("skipped: no maps in ../shared/cases/real");
        return;
    }
    println!("{seen:?}");
    // Some maps have errors of their authors. A model that misreads a curve or a width would exceed
    // these limits by far.
    assert!(seen.not_evaluated * 100 <= seen.geometries, "{seen:?}");
    assert!(
        seen.gaps * 100 <= seen.geometries && seen.kinks * 50 <= seen.geometries,
        "{seen:?}"
    );
    assert!(seen.torn * 20 <= seen.joints, "{seen:?}");
}

fn look_at_lines(map: &RoadMap<'_>, seen: &mut Seen) {
    for road in map.roads() {
        for pair in road.plan_view().geometries().windows(2) {
            seen.geometries += 1;
            let (Some(end), Some(start)) = (pair[0].end(), pair[1].start()) else {
                seen.not_evaluated += 1;
                continue;
            };
            seen.gaps += usize::from(end.point().distance(start.point()) > 0.01);
            seen.kinks +=
                usize::from(heading_difference(end.hdg, start.hdg).is_none_or(|kink| kink > 0.01));
        }
    }
}

fn look_at_joints(map: &RoadMap<'_>, seen: &mut Seen, path: &Path) {
    for joint in map.lane_joints() {
        let outer = |end: LaneEnd, edge: Edge| {
            let lane = map.lane(end.lane)?;
            let drivable = lane.kind() == Some("driving") && lane.width_at(end.end)? > 0.1;
            lane.border_at(edge, end.end).filter(|_| drivable)
        };
        // Inner and outer edge stay the same if the direction of s changes, because the center lane
        // is shared.
        let distances = Edge::BOTH.map(|edge| {
            let (one, other) = (outer(joint.from, edge)?, outer(joint.to, edge)?);
            Some(one.point.plan().distance(other.point.plan()))
        });
        let [Some(inner), Some(outer)] = distances else {
            continue;
        };
        seen.joints += 1;
        if inner > 0.2 && outer > 0.2 {
            seen.torn += 1;
            report(map, joint, inner, outer, path);
        }
    }
}

fn report(map: &RoadMap<'_>, joint: &LaneJoint<'_>, inner: f64, outer: f64, path: &Path) {
    let name = |end: LaneEnd| {
        let lane = map.lane(end.lane).expect("the lane is in the map");
        format!(
            "road {} section {} lane {:?} {}",
            lane.at.road.id(),
            lane.at.index(),
            lane.id(),
            end.end
        )
    };
    let file = path.file_name().unwrap_or_default().display();
    println!(
        "{file}: {} | {} | {inner:.2} {outer:.2} {}",
        name(joint.from),
        name(joint.to),
        joint.node.name()
    );
}
