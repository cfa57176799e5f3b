//! The whole system with the real program: the time from file closed to verdict with a warm broker,
//! its parts, and `check` of one file as a process.
//!
//! `cargo build --release -p qcbus && cargo bench -p qcbus-benches --bench farm`

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use qcbus_benches::Result;
use qcbus_benches::farm::{Delivered, Farm, program};
use qcbus_benches::figures::{digits, head, millis, quantile, row, size};
use qcbus_benches::maps::map;

fn main() -> Result<()> {
    let program = program()?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", qcbus_benches::machine::describe())?;
    writeln!(out, "\nFile closed → verdict, warm broker:\n")?;
    warm(&program, &mut out)?;
    writeln!(out, "\nWhere the time goes (medians, ms; logging on):\n")?;
    stages(&program, &mut out)?;
    writeln!(out, "\nMany files at once:\n")?;
    burst(&program, &mut out)?;
    writeln!(out, "\n`check` of one file, a whole process:\n")?;
    whole_processes(&program, &mut out)
}

/// Real files, if they are available. Their paths start at the workspace's root.
const REAL: [(&str, &str); 5] = [
    (
        "straight_500m.xodr",
        "../shared/cases/real/esmini/resources/xodr/straight_500m.xodr",
    ),
    (
        "multi_intersections.xodr",
        "../shared/cases/real/esmini/resources/xodr/multi_intersections.xodr",
    ),
    (
        "UC_Motorway-Exit-Entry.xodr",
        "../shared/cases/real/qc-framework/.github/workflows/linux-files/UC_Motorway-Exit-Entry.xodr",
    ),
    (
        "cut-in.xosc",
        "../shared/cases/real/esmini/resources/xosc/cut-in.xosc",
    ),
    (
        "parking_demo.xosc",
        "../shared/cases/real/esmini/resources/xosc/parking_demo.xosc",
    ),
];

/// A kind of file: name, bytes as a function of the round, number of rounds.
struct Case {
    name: String,
    ending: &'static str,
    make: Box<dyn Fn(u64) -> Vec<u8>>,
    rounds: u64,
}

impl Case {
    fn deliver(&self, farm: &mut Farm, number: u64) -> Result<Delivered> {
        let name = format!("f{number}.{}", self.ending);
        farm.deliver(&name, &(self.make)(number))
    }
}

fn cases() -> Vec<Case> {
    let generated = [
        (10_000, 200),
        (500_000, 200),
        (20_000_000, 8),
        (100_000_000, 3),
    ];
    let mut cases: Vec<Case> = generated
        .into_iter()
        .map(|(bytes, rounds)| Case {
            name: format!("generated, {}", size(bytes)),
            ending: "xodr",
            make: Box::new(move |number| map(bytes, number).into_bytes()),
            rounds,
        })
        .collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (name, path) in REAL {
        match std::fs::read(root.join(path)) {
            Ok(bytes) => cases.push(Case {
                name: format!("{name}, {}", size(bytes.len())),
                ending: if name.ends_with("xosc") {
                    "xosc"
                } else {
                    "xodr"
                },
                // A comment at the end makes every copy a different file.
                make: Box::new(move |number| {
                    let mut bytes = bytes.clone();
                    bytes.extend(format!("<!-- {number} -->\n").bytes());
                    bytes
                }),
                rounds: 100,
            }),
            Err(error) => {
                // The file may be missing on this machine.
                let _ = writeln!(std::io::stderr(), "skipped {name}: {error}");
            }
        }
    }
    cases
}

fn warm(program: &Path, out: &mut impl Write) -> Result<()> {
    let columns = [
        "file", "files", "p50 ms", "p90 ms", "p99 ms", "best ms", "verdict",
    ];
    writeln!(out, "{}", head(&columns))?;
    for case in cases() {
        let mut farm = Farm::start(program, false)?;
        let mut times = Vec::new();
        let mut verdict = String::new();
        for number in 0..case.rounds {
            let delivered = case.deliver(&mut farm, number)?;
            times.push(millis(delivered.answered - delivered.closed));
            verdict = delivered.verdict;
        }
        farm.stop()?;
        let mut cells = vec![case.name, case.rounds.to_string()];
        cells.extend([0.5, 0.9, 0.99, 0.0].map(|q| digits(quantile(&mut times, q))));
        cells.push(verdict);
        writeln!(out, "{}", row(&cells))?;
    }
    Ok(())
}

/// Stages in the order in which the broker logs them, with the work that ends at each.
const STAGES: [(&str, &str); 10] = [
    ("settled", "seen and settled"),
    ("taken", "waiting for a reader"),
    ("read", "read, hash, decode"),
    ("built", "image"),
    ("published", "publish"),
    ("gathered", "what it refers to"),
    ("checked", "job out, rules, answers in"),
    ("pooled", "pool"),
    ("written", "result and verdict file, with fsync"),
    ("judged", "journal, event"),
];

fn stages(program: &Path, out: &mut impl Write) -> Result<()> {
    let mut columns = vec!["file"];
    columns.extend(STAGES.map(|(_, what)| what));
    columns.extend(["answer to `wait`", "sum"]);
    writeln!(out, "{}", head(&columns))?;
    for case in cases() {
        let mut farm = Farm::start(program, true)?;
        let mut spans: Vec<Vec<f64>> = vec![Vec::new(); STAGES.len() + 2];
        for number in 0..case.rounds.min(40) {
            farm.said().clear();
            let delivered = case.deliver(&mut farm, number)?;
            let mut before = of_day(delivered.closed_at);
            let begin = before;
            for (index, (stage, _)) in STAGES.iter().enumerate() {
                let at = farm.when(stage, &delivered.path)?;
                spans[index].push((at - before) * 1e3);
                before = at;
            }
            let answered = begin + (delivered.answered - delivered.closed).as_secs_f64();
            spans[STAGES.len()].push((answered - before) * 1e3);
            spans[STAGES.len() + 1].push((answered - begin) * 1e3);
        }
        farm.stop()?;
        let mut cells = vec![case.name];
        cells.extend(
            spans
                .iter_mut()
                .map(|times| digits(quantile(times, 0.5).max(0.0))),
        );
        writeln!(out, "{}", row(&cells))?;
    }
    Ok(())
}

fn burst(program: &Path, out: &mut impl Write) -> Result<()> {
    writeln!(out, "{}", head(&["files", "each", "files/s", "MB/s"]))?;
    for (files, bytes) in [(500, 10_000), (100, 500_000)] {
        let mut best = f64::MAX;
        for _ in 0..3 {
            let mut farm = Farm::start(program, false)?;
            let paths: Vec<PathBuf> = (0..files)
                .map(|number| farm.watched.join(format!("b{number}.xodr")))
                .collect();
            let texts: Vec<String> = (0..files).map(|number| map(bytes, number)).collect();
            let start = Instant::now();
            for (path, text) in paths.iter().zip(&texts) {
                std::fs::write(path, text)?;
            }
            for path in &paths {
                farm.wait(path)?;
            }
            best = best.min(start.elapsed().as_secs_f64());
            farm.stop()?;
        }
        let cells = [
            files.to_string(),
            size(bytes),
            format!("{:.0}", files as f64 / best),
            format!("{:.0}", files as f64 * bytes as f64 / 1e6 / best),
        ];
        writeln!(out, "{}", row(&cells))?;
    }
    Ok(())
}

fn of_day(time: SystemTime) -> f64 {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    (since.as_secs() % 86_400) as f64 + f64::from(since.subsec_nanos()) / 1e9
}

/// Measures a process with all its children. It also waits for bundles that outlive the process for
/// a moment, because this bench is their subreaper.
fn whole_processes(program: &Path, out: &mut impl Write) -> Result<()> {
    rustix::process::set_child_subreaper(Some(rustix::process::getpid()))?;
    let columns = ["file", "runs", "wall p50 ms", "wall best ms", "CPU mean ms"];
    writeln!(out, "{}", head(&columns))?;
    let dir = tempfile::TempDir::new()?;
    for case in cases() {
        let runs = (case.rounds / 5).max(3);
        let path = dir.path().join(format!("f.{}", case.ending));
        std::fs::write(&path, (case.make)(0))?;
        let before = cpu_of_children()?;
        let mut times = Vec::new();
        for _ in 0..runs {
            let start = Instant::now();
            Command::new(program)
                .arg("check")
                .arg("--quiet")
                .arg(&path)
                .arg("--out")
                .arg(dir.path().join("out"))
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status()?;
            times.push(millis(start.elapsed()));
            while rustix::process::wait(rustix::process::WaitOptions::empty()).is_ok() {}
        }
        let cpu = millis(cpu_of_children()? - before) / runs as f64;
        let cells = [
            case.name,
            runs.to_string(),
            digits(quantile(&mut times, 0.5)),
            digits(quantile(&mut times, 0.0)),
            digits(cpu),
        ];
        writeln!(out, "{}", row(&cells))?;
    }
    Ok(())
}

/// Returns the user and system time of all ended and reaped children. The unit is a hundredth of a
/// second, which is exact enough over many runs.
fn cpu_of_children() -> Result<Duration> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    let (_, rest) = stat.rsplit_once(')').ok_or("no process status")?;
    let ticks = rest.split_whitespace().skip(13).take(2);
    let ticks: u64 = ticks
        .map(str::parse::<u64>)
        .sum::<std::result::Result<_, _>>()?;
    Ok(Duration::from_millis(ticks * 10))
}
