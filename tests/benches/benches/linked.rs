//! Many scenarios on one map: the cost of one scenario, and the map's part of it.
//!
//! `cargo build --release -p qcbus && cargo bench -p qcbus-benches --bench linked`

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use qcbus_benches::Result;
use qcbus_benches::farm::{Farm, program};
use qcbus_benches::figures::{best_of, digits, head, millis, quantile, row, size, time};
use qcbus_benches::maps::map;
use qcbus_benches::scenarios::scenario;
use qcbus_document::Image;
use qcbus_opendrive::OwnedMap;

/// Number of scenarios on each map.
const SCENARIOS: usize = 100;
/// Sizes of the map in bytes. The additional cost of a scenario on the larger one comes from the
/// map.
const MAPS: [usize; 2] = [10_000, 20_000_000];
/// Age of a settled map. A change of a younger map since its reading cannot be detected.
const SETTLED: Duration = Duration::from_millis(2_200);

fn main() -> Result<()> {
    let program = program()?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", qcbus_benches::machine::describe())?;
    writeln!(out, "\nThe model of the map, ms:\n")?;
    let columns = ["map", "built", "every lane asked for", "asked again"];
    writeln!(out, "{}", head(&columns))?;
    for bytes in MAPS {
        let mut cells = vec![size(bytes)];
        cells.extend(model(bytes)?.map(digits));
        writeln!(out, "{}", row(&cells))?;
    }
    writeln!(out, "\nOne after the other, warm broker, ms (p50):\n")?;
    let columns = ["map", "each", "of it reading", "of it checking"];
    writeln!(out, "{}", head(&columns))?;
    for bytes in MAPS {
        let mut cells = vec![size(bytes)];
        cells.extend(one_by_one(&program, bytes)?.map(digits));
        writeln!(out, "{}", row(&cells))?;
    }
    writeln!(out, "\n{SCENARIOS} at once, ms each:\n")?;
    let columns = ["map", "warm broker", "again", "`check`", "its best"];
    writeln!(out, "{}", head(&columns))?;
    for bytes in MAPS {
        for settled in [true, false] {
            let mut cells = vec![name(bytes, settled)];
            cells.extend(at_once(&program, bytes, settled)?.map(digits));
            cells.extend(whole_process(&program, bytes, settled)?.map(digits));
            writeln!(out, "{}", row(&cells))?;
        }
    }
    Ok(())
}

fn name(bytes: usize, settled: bool) -> String {
    let when = if settled { "" } else { ", just written" };
    format!("{}{when}", size(bytes))
}

/// Measures the time that a cached model of a map saves a bundle on every job but the first.
fn model(bytes: usize) -> Result<[f64; 3]> {
    let limits = qcbus_ingest::Limits::default();
    let text = map(bytes, 0).into_bytes();
    let image =
        Image::new(qcbus_ingest::prepare_bytes(Path::new("/town.xodr"), text, &limits).build());
    let build = best_of(5, || OwnedMap::of(image.clone()));
    let map = OwnedMap::of(image)?;
    let lanes = || map.with(|map| map.lanes().count());
    Ok([build, time(lanes), time(lanes)].map(millis))
}

/// Writes a map beside a directory of scenarios.
fn write_map(beside: &Path, bytes: usize, settled: bool) -> Result<()> {
    let maps = beside.with_file_name("maps");
    std::fs::create_dir_all(&maps)?;
    std::fs::write(maps.join("town.xodr"), map(bytes, 0))?;
    if settled {
        std::thread::sleep(SETTLED);
    }
    Ok(())
}

/// Returns a small scenario on the map. A comment makes it different from the others.
fn on_map(number: usize) -> Vec<u8> {
    let text = scenario(0).replace("town.xodr", "../maps/town.xodr");
    format!("{text}<!-- {number} -->\n").into_bytes()
}

fn one_by_one(program: &Path, bytes: usize) -> Result<[f64; 3]> {
    let mut farm = Farm::start(program, true)?;
    write_map(&farm.watched, bytes, true)?;
    farm.deliver("first.xosc", &on_map(0))?;
    let (mut times, mut reading, mut checking) = (Vec::new(), Vec::new(), Vec::new());
    for number in 0..SCENARIOS {
        let delivered = farm.deliver(&format!("f{number}.xosc"), &on_map(number))?;
        times.push(millis(delivered.answered - delivered.closed));
        let stage = |stage: &str| farm.when(stage, &delivered.path);
        let (taken, gathered, checked) = (stage("taken")?, stage("gathered")?, stage("checked")?);
        reading.push((gathered - taken) * 1e3);
        checking.push((checked - gathered) * 1e3);
    }
    farm.stop()?;
    Ok([&mut times, &mut reading, &mut checking].map(|times| quantile(times, 0.5)))
}

/// Measures all scenarios at once, twice. Returns milliseconds for each.
fn at_once(program: &Path, bytes: usize, settled: bool) -> Result<[f64; 2]> {
    let farm = Farm::start(program, false)?;
    write_map(&farm.watched, bytes, settled)?;
    let burst = |prefix: &str| -> Result<f64> {
        let start = Instant::now();
        farm.wait_for_all(&write_scenarios(&farm.watched, prefix)?)?;
        Ok(millis(start.elapsed()) / SCENARIOS as f64)
    };
    let times = [burst("a")?, burst("b")?];
    farm.stop()?;
    Ok(times)
}

fn write_scenarios(directory: &Path, prefix: &str) -> Result<Vec<PathBuf>> {
    let write = |number: usize| {
        let path = directory.join(format!("{prefix}{number}.xosc"));
        std::fs::write(&path, on_map(number))?;
        Ok(path)
    };
    (0..SCENARIOS).map(write).collect()
}

/// Measures `check` of all scenarios, five times. Returns milliseconds for each, including the
/// start of the processes.
fn whole_process(program: &Path, bytes: usize, settled: bool) -> Result<[f64; 2]> {
    let mut times = Vec::new();
    for _ in 0..5 {
        let dir = tempfile::TempDir::new()?;
        let scenarios = dir.path().join("in");
        std::fs::create_dir(&scenarios)?;
        let paths = write_scenarios(&scenarios, "f")?;
        write_map(&scenarios, bytes, settled)?;
        let start = Instant::now();
        Command::new(program)
            .args(["check", "--quiet", "--out"])
            .arg(dir.path().join("out"))
            .args(paths)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()?;
        times.push(millis(start.elapsed()) / SCENARIOS as f64);
    }
    Ok([quantile(&mut times, 0.5), quantile(&mut times, 0.0)])
}
