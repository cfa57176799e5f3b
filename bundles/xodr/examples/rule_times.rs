//! How long every rule takes, by size of the map.
//!
//! `cargo run --release -p qcbus-xodr --example rule_times -- MAP.xodr [MEGABYTES]` repeats the roads
//! of the map with fresh ids, each copy a kilometre further north, until the file has that size.

#![expect(
    clippy::print_stdout,
    reason = "an example that prints its measurements"
)]

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use qcbus_sdk::{Issue, Listener, Loaded, Outcome, Plan, check};

/// The measurements are the best of so many runs.
const RUNS: usize = 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let Some(path) = arguments.next() else {
        println!("usage: rule_times MAP.xodr [MEGABYTES]");
        return Ok(());
    };
    let text = std::fs::read_to_string(&path)?;
    let megabytes = arguments.next().and_then(|word| word.parse().ok());
    let size = megabytes.unwrap_or(20) * 1_000_000;
    let half = measure(&repeat_roads(&text, size / 2))?;
    let whole = measure(&repeat_roads(&text, size))?;
    let mut rules: Vec<(&String, &Duration)> = whole.iter().collect();
    rules.sort_by_key(|(_, took)| std::cmp::Reverse(**took));
    let milliseconds = |took: &Duration| took.as_secs_f64() * 1e3;
    for (id, took) in &rules {
        let before = half.get(*id).map_or(0.0, milliseconds);
        println!("{before:9.2} ms {:9.2} ms  {id}", milliseconds(took));
    }
    let sum = |all: &BTreeMap<String, Duration>| milliseconds(&all.values().sum());
    println!("{:9.2} ms {:9.2} ms  all together", sum(&half), sum(&whole));
    Ok(())
}

/// The map with its roads repeated under fresh ids until it has `size` bytes.
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
            let road = road.replacen(" id=\"", &format!(" id=\"{copy}-"), 1);
            map.push_str(&moved(&road, f64::from(copy) * 1000.0));
        }
        copy += 1;
    }
    map + tail
}

/// The road with all its geometries moved to the north.
fn moved(road: &str, by: f64) -> String {
    let mut parts = road.split("<geometry ");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text.push_str("<geometry ");
        let y = part.split_once(" y=\"");
        let number = y.and_then(|(before, rest)| Some((before, rest.split_once('"')?)));
        match number {
            Some((before, (y, rest))) => {
                let y = y.parse::<f64>().unwrap_or(0.0) + by;
                text.push_str(&format!("{before} y=\"{y}\"{rest}"));
            }
            None => text.push_str(part),
        }
    }
    text
}

fn measure(text: &str) -> Result<BTreeMap<String, Duration>, Box<dyn std::error::Error>> {
    let loaded = Loaded::from_bytes(Path::new("map.xodr"), text.as_bytes().to_vec())?;
    let subject = loaded.subject(&qcbus_xodr::BUNDLE)?;
    let plan = Plan::by_default(&qcbus_xodr::BUNDLE);
    let mut best: BTreeMap<String, Duration> = BTreeMap::new();
    for _ in 0..RUNS {
        let mut times = Times {
            plan: &plan,
            took: BTreeMap::new(),
        };
        check(&plan, &subject, &mut times);
        for (id, took) in times.took {
            let slot = best.entry(id).or_insert(took);
            *slot = took.min(*slot);
        }
    }
    Ok(best)
}

struct Times<'p> {
    plan: &'p Plan,
    took: BTreeMap<String, Duration>,
}

impl Listener for Times<'_> {
    fn ended(&mut self, checker: usize, _: Vec<Issue>, outcome: Outcome) {
        let id = self.plan.checkers()[checker].id.clone();
        self.took.insert(id, outcome.took);
    }
}
