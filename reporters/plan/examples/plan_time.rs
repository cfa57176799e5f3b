//! Measures the time and the size of the plan of a map, and the time for locating findings:
//! `cargo run --release -p qcbus-plan --example plan_time -- MAP [COPIES [OUTPUT]]`.
//!
//! COPIES is the number of copies of the map's roads and junctions, for maps of any size.

#![expect(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a tool that prints its measurements, or the reason of a failure"
)]

use std::path::Path;
use std::time::Instant;

use qcbus_document::{Document, XPaths};
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_opendrive::RoadMap;
use qcbus_plan::{Locator, Plan, Said};

const FINDINGS: usize = 10_000;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("expected the path of a map");
    let copies = arguments
        .next()
        .map_or(1, |text| text.parse().expect("expected a number of copies"));
    let text = std::fs::read_to_string(&path).expect("the map is readable");
    let from = text.find("<road ").expect("the map has roads");
    let to = text.rfind("</OpenDRIVE>").expect("the map has an end tag");
    let text = [&text[..from], &text[from..to].repeat(copies), &text[to..]].concat();
    let megabytes = text.len() as f64 / 1e6;
    let image = prepare_bytes(Path::new(&path), text.into_bytes(), &Limits::default()).build();
    let document = Document::open(&image).expect("the image is valid");

    // Rules normally access most of a map before it is drawn. No rule runs here.
    let map = RoadMap::new(document);
    let start = Instant::now();
    let plan = Plan::of(&map);
    let cold = start.elapsed();
    let start = Instant::now();
    let bytes = Plan::of(&map).bytes();
    let warm = start.elapsed();
    println!(
        "{megabytes:.1} MB, {} roads: plan of {:.2} MB in {cold:.1?} ({warm:.1?} when the map has been read)",
        map.roads().len(),
        bytes.len() as f64 / 1e6
    );
    for cut in plan.cuts() {
        println!("{cut}");
    }

    let mut names = XPaths::new(document);
    let step = (document.len() as usize / FINDINGS).max(1);
    let nodes = (0..document.len())
        .step_by(step)
        .filter_map(|at| document.node(at));
    let xpaths: Vec<String> = nodes.map(|node| names.xpath(node)).collect();
    let start = Instant::now();
    let locator = Locator::new(&map);
    let placed = xpaths.iter().filter(|xpath| {
        let said = Said {
            xpath: Some(xpath),
            ..Said::default()
        };
        locator.locate(&said).at.is_some()
    });
    let placed = placed.count();
    println!(
        "{placed} of {} findings placed in {:.1?}",
        xpaths.len(),
        start.elapsed()
    );
    if let Some(output) = arguments.next() {
        std::fs::write(output, bytes).expect("the output file is writable");
    }
}
