//! Benchmark of building an image against quick-xml's own loop with attributes, on a generated map.
//!
//! `cargo run --release -p qcbus-ingest --example build_speed -- [MEGABYTES]`

#![expect(clippy::print_stdout, reason = "a benchmark prints its measurements")]

use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use qcbus_ingest::{Limits, prepare_bytes};
use quick_xml::Reader;
use quick_xml::events::Event;

fn main() {
    let megabytes = std::env::args()
        .nth(1)
        .and_then(|text| text.parse().ok())
        .unwrap_or(100);
    let text = map(megabytes << 20);
    let prepared = prepare_bytes(
        Path::new("map.xodr"),
        text.clone().into_bytes(),
        &Limits::default(),
    );
    let mut image = vec![1u8; prepared.upper_bound()];
    let len = prepared.build_into(&mut image).unwrap_or(0);
    let (mut own, mut build, mut prepare) = (Duration::MAX, Duration::MAX, Duration::MAX);
    for _ in 0..7 {
        own = own.min(time(|| quick_xml_loop(&text)));
        build = build.min(time(|| prepared.build_into(&mut image).unwrap_or(0)));
        let bytes = text.clone().into_bytes();
        prepare = prepare.min(time(|| {
            prepare_bytes(Path::new("map.xodr"), bytes, &Limits::default()).upper_bound()
        }));
    }
    let rate = |time: Duration| text.len() as f64 / 1e6 / time.as_secs_f64();
    println!("source            {:>8.1} MB", text.len() as f64 / 1e6);
    println!("quick-xml's loop  {:>8.0} MB/s", rate(own));
    println!(
        "build             {:>8.0} MB/s ({:.2} of it)",
        rate(build),
        rate(build) / rate(own)
    );
    println!(
        "prepare           {:>8.0} MB/s (SHA-256, UTF-8, characters, bound)",
        rate(prepare)
    );
    println!("image / source    {:>8.2}", len as f64 / text.len() as f64);
    println!(
        "bound / source    {:>8.2}",
        prepared.upper_bound() as f64 / text.len() as f64
    );
}

fn time(work: impl FnOnce() -> usize) -> Duration {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed()
}

fn quick_xml_loop(text: &str) -> usize {
    let mut reader = Reader::from_str(text);
    let mut sum = 0;
    loop {
        match reader.read_event() {
            Ok(Event::Start(tag) | Event::Empty(tag)) => {
                let mut attributes = tag.attributes();
                attributes.with_checks(false);
                sum += attributes
                    .flatten()
                    .map(|attribute| attribute.value.len())
                    .sum::<usize>();
            }
            Ok(Event::Eof) | Err(_) => return sum,
            Ok(_) => {}
        }
    }
}

/// Creates roads with geometries, elevations and lanes, about as dense as exported city maps.
fn map(len: usize) -> String {
    let mut text = String::with_capacity(len + 4096);
    text.push_str("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n    <header revMajor=\"1\" revMinor=\"7\" name=\"generated\"/>\n");
    let mut id = 0u32;
    while text.len() < len {
        id += 1;
        road(&mut text, id);
    }
    text.push_str("</OpenDRIVE>\n");
    text
}

fn road(text: &mut String, id: u32) {
    let x = f64::from(id) * 1.618_033_988_749_895;
    let _ = writeln!(
        text,
        "    <road name=\"Road {id}\" length=\"{:.16e}\" id=\"{id}\" junction=\"-1\">\n        <planView>",
        x * 7.0
    );
    for part in 0..8 {
        let s = f64::from(part) * 12.345_678_9;
        let _ = writeln!(
            text,
            "            <geometry s=\"{s:.16e}\" x=\"{:.16e}\" y=\"{:.16e}\" hdg=\"{:.16e}\" length=\"{:.16e}\">\n                <line/>\n            </geometry>",
            x + s,
            x - s,
            x / 3.0,
            s + 1.0
        );
    }
    text.push_str("        </planView>\n        <lanes>\n            <laneSection s=\"0\">\n                <right>\n");
    for lane in 1..6 {
        let _ = writeln!(
            text,
            "                    <lane id=\"-{lane}\" type=\"driving\" level=\"false\">\n                        <width sOffset=\"0\" a=\"3.5\" b=\"{:.16e}\" c=\"0\" d=\"0\"/>\n                    </lane>",
            x / f64::from(lane)
        );
    }
    text.push_str(
        "                </right>\n            </laneSection>\n        </lanes>\n    </road>\n",
    );
}
