//! Measures the time for building and querying the whole model, by size of the map.
//!
//! `cargo run --release -p qcbus-opendrive --example build_time -- MAP.xodr [MEGABYTES]` repeats
//! the roads of the map with fresh ids until the file has that size.

#![expect(
    clippy::print_stdout,
    reason = "an example that prints its measurements"
)]

use std::path::Path;
use std::time::{Duration, Instant};

use qcbus_document::Document;
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_opendrive::{Edge, RoadMap};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let Some(path) = arguments.next() else {
        println!("usage: build_time MAP.xodr [MEGABYTES]");
        return;
    };
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("{path} cannot be read");
        return;
    };
    let megabytes: usize = arguments
        .next()
        .and_then(|word| word.parse().ok())
        .unwrap_or(20);
    for size in [megabytes * 500_000, megabytes * 1_000_000] {
        measure(Path::new(&path), &repeat_roads(&text, size));
    }
}

/// Repeats the roads of the map with fresh ids until the text has `size` bytes.
fn repeat_roads(text: &str, size: usize) -> String {
    let (Some(from), Some(to)) = (text.find("<road "), text.rfind("</road>")) else {
        return text.to_owned();
    };
    let (head, roads, tail) = (&text[..from], &text[from..to + 7], &text[to + 7..]);
    let mut map = head.to_owned();
    let mut copy = 0;
    while map.len() + tail.len() < size {
        let linked = roads.replace("elementId=\"", &format!("elementId=\"{copy}-"));
        for road in linked.split("<road ").skip(1) {
            map.push_str("<road ");
            map.push_str(&road.replacen("id=\"", &format!("id=\"{copy}-"), 1));
        }
        copy += 1;
    }
    map + tail
}

fn measure(path: &Path, text: &str) {
    let image = prepare_bytes(path, text.as_bytes().to_vec(), &Limits::default()).build();
    let Ok(document) = Document::open(&image) else {
        println!("no image");
        return;
    };
    let times = (0..7).map(|_| run(document));
    let best = times.reduce(|one, other| [0, 1, 2, 3].map(|at| one[at].min(other[at])));
    let [map, lanes, joints, borders] = best
        .unwrap_or_default()
        .map(|time| time.as_secs_f64() * 1e3);
    println!(
        "{:6.2} MB, {} nodes: map {map:.2} ms, all roads and lanes {lanes:.2} ms, joints {joints:.2} ms, borders of all lanes at both ends {borders:.2} ms",
        text.len() as f64 / 1e6,
        document.len(),
    );
}

fn run(document: Document<'_>) -> [Duration; 4] {
    let clock = Instant::now();
    let map = RoadMap::new(document);
    let built = clock.elapsed();
    let mut records = 0;
    for road in map.roads() {
        records += road.plan_view().geometries().len() + road.elevation().records().len();
        records += road.lateral().superelevation.records().len();
    }
    for lane in map.lanes() {
        records += lane.widths().records().len() + lane.heights().len();
    }
    let read = clock.elapsed();
    records += map.lane_joints().count();
    let joined = clock.elapsed();
    for lane in map.lanes() {
        let ends = [
            qcbus_opendrive::ContactPoint::Start,
            qcbus_opendrive::ContactPoint::End,
        ];
        records += ends
            .iter()
            .filter(|end| lane.border_at(Edge::Outer, **end).is_some())
            .count();
    }
    let evaluated = clock.elapsed();
    std::hint::black_box(records);
    [built, read - built, joined - read, evaluated - joined]
}
