//! Comparison of two builds of the program, alternating on one machine: it shows the cost of a
//! change.
//!
//! `cargo build --release -p qcbus && QCBUS_BESIDE=…/qcbus cargo bench -p qcbus-benches --bench beside`;
//! `QCBUS_ROUNDS=1000` for more than 400 small files.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use qcbus_benches::Result;
use qcbus_benches::farm::{Farm, program};
use qcbus_benches::figures::{digits, head, millis, quantile, row, size};
use qcbus_benches::maps::map;

/// Default number of small files, one after the other.
const ROUNDS: u64 = 400;
/// Number of bursts of many files.
const BURSTS: u64 = 9;
/// Number of starts of a process.
const CHECKS: u64 = 40;

/// Values of the other build and of this one.
type Pair<T> = [T; 2];

fn main() -> Result<()> {
    let Some(other) = std::env::var_os("QCBUS_BESIDE").map(PathBuf::from) else {
        writeln!(
            std::io::stderr(),
            "skipped: QCBUS_BESIDE names no other qcbus"
        )?;
        return Ok(());
    };
    let programs = [other, program()?];
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}\n", qcbus_benches::machine::describe())?;
    let columns = [
        "what",
        "other",
        "this",
        "this ÷ other, pair by pair: p25",
        "median",
        "p75",
    ];
    writeln!(out, "{}", head(&columns))?;
    one_by_one(&programs, &mut out)?;
    for (files, bytes) in [(500, 10_000), (60, 500_000)] {
        at_once(&programs, files, bytes, &mut out)?;
    }
    whole_processes(&programs, &mut out)
}

/// Writes a line of the table: medians and their ratios.
fn compare(what: &str, mut times: Pair<Vec<f64>>, out: &mut impl Write) -> Result<()> {
    let pairs = times[0].iter().zip(&times[1]);
    let mut ratios: Vec<f64> = pairs.map(|(other, this)| this / other).collect();
    let mut cells = vec![what.to_owned()];
    cells.extend(times.iter_mut().map(|it| digits(quantile(it, 0.5))));
    cells.extend([0.25, 0.5, 0.75].map(|q| format!("{:.3}", quantile(&mut ratios, q))));
    writeln!(out, "{}", row(&cells))?;
    Ok(())
}

/// Returns the order of the two builds. It alternates, so that neither always comes first.
fn in_turn(round: u64) -> Pair<usize> {
    if round.is_multiple_of(2) {
        [0, 1]
    } else {
        [1, 0]
    }
}

fn one_by_one(programs: &Pair<PathBuf>, out: &mut impl Write) -> Result<()> {
    let rounds = match std::env::var("QCBUS_ROUNDS") {
        Ok(text) => text.parse()?,
        Err(_) => ROUNDS,
    };
    let mut farms = [
        Farm::start(&programs[0], false)?,
        Farm::start(&programs[1], false)?,
    ];
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..rounds {
        let text = map(10_000, round);
        for who in in_turn(round) {
            let delivered = farms[who].deliver(&format!("f{round}.xodr"), text.as_bytes())?;
            times[who].push(millis(delivered.answered - delivered.closed));
        }
    }
    farms.into_iter().try_for_each(Farm::stop)?;
    let what = format!(
        "{rounds} × {} one by one, file closed → verdict, ms",
        size(10_000)
    );
    compare(&what, times, out)
}

fn at_once(programs: &Pair<PathBuf>, files: u64, bytes: usize, out: &mut impl Write) -> Result<()> {
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..BURSTS {
        for who in in_turn(round) {
            times[who].push(burst(&programs[who], files, bytes)?);
        }
    }
    compare(
        &format!("{files} × {} at once, ms for all", size(bytes)),
        times,
        out,
    )
}

fn burst(program: &Path, files: u64, bytes: usize) -> Result<f64> {
    let mut farm = Farm::start(program, false)?;
    let texts: Vec<String> = (0..files).map(|number| map(bytes, number)).collect();
    let start = Instant::now();
    let mut paths = Vec::new();
    for (number, text) in texts.iter().enumerate() {
        let path = farm.watched.join(format!("b{number}.xodr"));
        std::fs::write(&path, text)?;
        paths.push(path);
    }
    for path in &paths {
        farm.wait(path)?;
    }
    let took = millis(start.elapsed());
    farm.stop()?;
    Ok(took)
}

fn whole_processes(programs: &Pair<PathBuf>, out: &mut impl Write) -> Result<()> {
    let dir = tempfile::TempDir::new()?;
    let path = dir.path().join("f.xodr");
    std::fs::write(&path, map(10_000, 0))?;
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..CHECKS {
        for who in in_turn(round) {
            let start = Instant::now();
            let status = Command::new(&programs[who])
                .args(["check", "--quiet"])
                .arg(&path)
                .arg("--out")
                .arg(dir.path().join(format!("out{who}")))
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status()?;
            if !matches!(status.code(), Some(0 | 1)) {
                return Err(format!("{} check: {status}", programs[who].display()).into());
            }
            times[who].push(millis(start.elapsed()));
        }
    }
    compare("`check` of 10 KB, a whole process, ms", times, out)
}
