//! Instructions of the hot paths: these figures are the same on a busy machine.
//!
//! `cargo bench -p qcbus-benches --bench instructions` runs every path under callgrind with n and
//! with 2n repetitions. The difference is the cost of n repetitions, without the start, the input
//! and one-time work. It prints the figures beside those of `docs/evidence/instructions.tsv`, and
//! reports a rise in words. `QCBUS_BLESS=1` writes that file anew. It fails only if a path cannot
//! be run, never because of a figure. Without valgrind it reports this and ends.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use qcbus_benches::Result;
use qcbus_benches::answers::{answer, findings};
use qcbus_benches::figures::{head, row};
use qcbus_benches::maps::map;
use qcbus_benches::scenarios::scenario;
use qcbus_document::{Document, FileKind};
use qcbus_formats::pool::{BundleOutcome, Ending, PoolInput, Scope, XPathPlace, pool};
use qcbus_formats::xqar::{self, Dialect};
use qcbus_ingest::{Limits, prepare, prepare_bytes};
use qcbus_messages::{BUILD_DATE, FromPeer, JobId, codec};
use qcbus_schema::{SHIPPED, Version};
use qcbus_sdk::{Bundle, Issue, Listener, Loaded, Outcome, Plan, check};

/// A path through the project's code that every file or every finding takes.
struct HotPath {
    name: &'static str,
    /// Runs the path this many times on the same input.
    repeat: fn(u32) -> Result<()>,
}

const PATHS: [HotPath; 10] = [
    HotPath {
        name: "map: read, decode",
        repeat: read,
    },
    HotPath {
        name: "map: image",
        repeat: image,
    },
    HotPath {
        name: "map: schema",
        repeat: schema,
    },
    HotPath {
        name: "map: all rules",
        repeat: map_rules,
    },
    HotPath {
        name: "scenario: all rules",
        repeat: scenario_rules,
    },
    HotPath {
        name: "64 findings: encode",
        repeat: encode,
    },
    HotPath {
        name: "64 findings: decode",
        repeat: decode,
    },
    HotPath {
        name: "1,000 findings: pool",
        repeat: pooling,
    },
    HotPath {
        name: "1,000 findings: write .xqar",
        repeat: write_result,
    },
    HotPath {
        name: "1,000 findings: read .xqar",
        repeat: read_result,
    },
];

/// Size in bytes of the map and of the scenario.
const BYTES: usize = 300_000;
/// Repetitions of the shorter run.
const TIMES: u32 = 2;
/// Percentage from which a rise is reported in words.
const WORTH_A_WORD: f64 = 3.0;
/// Function that is not counted: valgrind's processor has no instructions for SHA-256, real ones
/// do. Its replacement takes most of the instructions of reading a file there, and would hide the
/// rest.
const HASH: &str = "sha2::sha256::compress256";
/// Variable that tells this program to run one path: its index in [`PATHS`] and the number of
/// repetitions.
const RUN_ONE: &str = "QCBUS_INSTRUCTIONS_OF";

fn main() -> Result<()> {
    if let Ok(one) = std::env::var(RUN_ONE) {
        let (place, times) = one.split_once(' ').ok_or("a place and a number")?;
        let path = PATHS.get(place.parse::<usize>()?).ok_or("no such path")?;
        return (path.repeat)(times.parse()?);
    }
    let mut out = std::io::stdout().lock();
    let Some(valgrind) = said_by(Command::new("valgrind").arg("--version")) else {
        writeln!(
            out,
            "\nSKIPPED: no instructions were counted, valgrind is not installed\n"
        )?;
        return Ok(());
    };
    let made_with = made_with(&valgrind);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/evidence/instructions.tsv");
    let last = Last::read(&file)?;
    let mut now = Vec::new();
    writeln!(out, "{made_with}\n")?;
    writeln!(
        out,
        "{}",
        head(&["path", "instructions", "last", "change, %"])
    )?;
    for (place, path) in PATHS.iter().enumerate() {
        let counted = count(place).map_err(|error| format!("{}: {error}", path.name))?;
        writeln!(out, "{}", row(&last.beside(path.name, counted)))?;
        out.flush()?;
        now.push((path.name, counted));
    }
    writeln!(out)?;
    for line in last.in_words(&now, &made_with) {
        writeln!(out, "{line}")?;
    }
    if std::env::var_os("QCBUS_BLESS").is_some() {
        bless(&file, &made_with, &now)?;
        writeln!(out, "written: docs/evidence/instructions.tsv")?;
    }
    Ok(())
}

/// Counts the instructions of one repetition. The parallel runs do not disturb the count.
fn count(place: usize) -> Result<u64> {
    let dir = tempfile::TempDir::new()?;
    let files = ["once", "twice"].map(|name| dir.path().join(name));
    let children = [
        under_callgrind(place, TIMES, &files[0])?,
        under_callgrind(place, 2 * TIMES, &files[1])?,
    ];
    let mut totals = [0; 2];
    // Both runs are waited for before a failure of one is reported.
    let outputs = children.map(Child::wait_with_output);
    for ((output, file), total) in outputs.into_iter().zip(&files).zip(&mut totals) {
        let output = output?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            return Err(format!("it could not be run ({}):\n{said}", output.status).into());
        }
        *total = total_of(&std::fs::read_to_string(file)?).ok_or("callgrind counted nothing")?;
    }
    Ok(totals[1].saturating_sub(totals[0]) / u64::from(TIMES))
}

fn under_callgrind(place: usize, times: u32, file: &Path) -> Result<Child> {
    let child = Command::new("valgrind")
        .args(["--tool=callgrind", "--quiet"])
        // Counting starts at once, stops at the begin of that function, and continues at its end.
        .arg(format!("--toggle-collect={HASH}"))
        .arg("--collect-atstart=yes")
        .arg(format!("--callgrind-out-file={}", file.display()))
        .arg(std::env::current_exe()?)
        .env(RUN_ONE, format!("{place} {times}"))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    Ok(child)
}

/// Returns the total in a file of callgrind.
fn total_of(text: &str) -> Option<u64> {
    let mut lines = text.lines().rev();
    let total = lines.find_map(|line| line.strip_prefix("totals:"))?;
    total.trim().parse().ok()
}

/// Returns a text about everything besides the code that affects the figures.
fn made_with(valgrind: &str) -> String {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let mut ask = Command::new(rustc);
    ask.arg("-vV").current_dir(env!("CARGO_MANIFEST_DIR"));
    let rustc = said_by(&mut ask).unwrap_or_default();
    let version = rustc.lines().next().unwrap_or("an unknown rustc");
    let target = rustc.lines().find_map(|line| line.strip_prefix("host: "));
    let target = target.unwrap_or(std::env::consts::ARCH);
    format!("{version}, {target}, {valgrind}")
}

/// Returns the output of a command, if it can be run.
fn said_by(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

/// Figures in the repository.
#[derive(Default)]
struct Last {
    made_with: String,
    counted: BTreeMap<String, u64>,
}

impl Last {
    /// Reads the figures. A missing file is no error: then these figures are the first.
    fn read(file: &PathBuf) -> Result<Last> {
        let mut last = Last::default();
        let Ok(text) = std::fs::read_to_string(file) else {
            return Ok(last);
        };
        for line in text.lines() {
            if let Some(comment) = line.strip_prefix("# ") {
                comment.clone_into(&mut last.made_with);
            } else if let Some((name, counted)) = line.split_once('\t') {
                last.counted.insert(name.to_owned(), counted.parse()?);
            }
        }
        Ok(last)
    }

    fn change(&self, name: &str, now: u64) -> Option<f64> {
        let last = *self.counted.get(name)?;
        Some((now as f64 / last as f64 - 1.0) * 100.0)
    }

    fn beside(&self, name: &str, now: u64) -> [String; 4] {
        let nothing = || "–".to_owned();
        let last = self.counted.get(name).copied();
        [
            name.to_owned(),
            grouped(now),
            last.map_or_else(nothing, grouped),
            self.change(name, now)
                .map_or_else(nothing, |change| format!("{change:+.1}")),
        ]
    }

    /// Returns the lines that a reader should not overlook.
    fn in_words(&self, now: &[(&str, u64)], made_with: &str) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.made_with.is_empty() && self.made_with != made_with {
            lines.push(format!(
                "The last ones were counted with {}: some of the change may be theirs.",
                self.made_with
            ));
        }
        for (name, counted) in now {
            match self.change(name, *counted) {
                Some(change) if change > WORTH_A_WORD => {
                    lines.push(format!("RISEN: `{name}` takes {change:.1} % more."));
                }
                Some(_) => {}
                None => lines.push(format!("`{name}` was never counted before.")),
            }
        }
        if lines.is_empty() {
            lines.push(format!("Nothing rose by more than {WORTH_A_WORD} %."));
        }
        lines
    }
}

fn bless(file: &Path, made_with: &str, now: &[(&str, u64)]) -> Result<()> {
    let mut text = format!("# {made_with}\n");
    for (name, counted) in now {
        text.push_str(&format!("{name}\t{counted}\n"));
    }
    Ok(std::fs::write(file, text)?)
}

/// Returns the number with a comma for every thousand.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (place, digit) in digits.char_indices() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

fn read(times: u32) -> Result<()> {
    let dir = tempfile::TempDir::new()?;
    let path = dir.path().join("map.xodr");
    std::fs::write(&path, map(BYTES, 1))?;
    for _ in 0..times {
        black_box(prepare(&path, dir.path(), &Limits::default())?);
    }
    Ok(())
}

fn image(times: u32) -> Result<()> {
    let text = map(BYTES, 1).into_bytes();
    let prepared = prepare_bytes(Path::new("map.xodr"), text, &Limits::default());
    let mut image = vec![1; prepared.upper_bound()];
    for _ in 0..times {
        black_box(prepared.build_into(&mut image)?);
    }
    Ok(())
}

/// Returns the image of the map.
fn map_image() -> Vec<u8> {
    let text = map(BYTES, 1).into_bytes();
    prepare_bytes(Path::new("map.xodr"), text, &Limits::default()).build()
}

fn schema(times: u32) -> Result<()> {
    let image = map_image();
    let document = Document::open(&image)?;
    let version = Version { major: 1, minor: 7 };
    let found = SHIPPED
        .iter()
        .find(|one| one.kind == FileKind::Xodr && one.version == version);
    let schema = found.ok_or("no tables for 1.7")?.schema();
    let schema = schema.map_err(Clone::clone)?;
    for _ in 0..times {
        let report = black_box(schema.validate(&document, qcbus_schema::Limits::default()));
        if let Some(first) = report.violations.first() {
            return Err(format!("the map is not valid: {}", first.text).into());
        }
    }
    Ok(())
}

fn map_rules(times: u32) -> Result<()> {
    rules(&qcbus_xodr::BUNDLE, "map.xodr", map(BYTES, 1), times)
}

fn scenario_rules(times: u32) -> Result<()> {
    rules(&qcbus_xosc::BUNDLE, "scenario.xosc", scenario(BYTES), times)
}

/// Runs all rules that are on by default, from the image, in this thread.
fn rules(bundle: &'static Bundle, name: &str, text: String, times: u32) -> Result<()> {
    let loaded = Loaded::from_bytes(Path::new(name), text.into_bytes())?;
    let plan = Plan::by_default(bundle);
    for _ in 0..times {
        let subject = loaded.subject(bundle)?;
        let mut looked = Looked::default();
        check(&plan, &subject, &mut looked);
        if looked.ended == 0 || !looked.open.is_empty() {
            return Err(format!("nothing was checked: {:?}", looked.open).into());
        }
    }
    Ok(())
}

/// Checks that every checker has completed. Otherwise the figure would measure something else.
#[derive(Default)]
struct Looked {
    ended: usize,
    open: Vec<Ending>,
}

impl Listener for Looked {
    fn ended(&mut self, _: usize, issues: Vec<Issue>, outcome: Outcome) {
        black_box(issues);
        self.ended += 1;
        if outcome.ending.is_open() {
            self.open.push(outcome.ending);
        }
    }
}

/// Returns the findings that a bundle sends at once.
fn batch() -> FromPeer {
    FromPeer::Issues {
        job: JobId(1),
        checker: 7,
        issues: findings(64),
    }
}

fn encode(times: u32) -> Result<()> {
    let batch = batch();
    for _ in 0..times {
        black_box(codec::encode(&batch)?);
    }
    Ok(())
}

fn decode(times: u32) -> Result<()> {
    let bytes = codec::encode(&batch())?;
    for _ in 0..times {
        black_box(codec::decode::<FromPeer>(&bytes)?);
    }
    Ok(())
}

/// Pools an answer as a broker does, with places looked up in the image.
fn pooled(document: Document<'_>, bundle: BundleOutcome) -> Result<xqar::Results> {
    let mut lost = 0;
    let input = PoolInput {
        input_file: "/farm/in/map.xodr",
        config: None,
        bundles: vec![bundle],
        remarks: Vec::new(),
        scope: Scope::Whole,
        separate: false,
        version: "1.0.0",
        build_date: BUILD_DATE,
    };
    let mut resolve = |xpath: &str| {
        let nodes = document.evaluate(xpath).unwrap_or_default();
        let Some(node) = nodes.first() else {
            lost += 1;
            return None;
        };
        let position = node.position();
        Some(XPathPlace {
            row: position.row.into(),
            column: position.column.into(),
            offset: Some(position.offset.into()),
        })
    };
    let results = pool(input, &mut resolve).results;
    match lost {
        0 => Ok(results),
        _ => Err(format!("{lost} findings point at what the map does not have").into()),
    }
}

fn pooling(times: u32) -> Result<()> {
    let image = map_image();
    let document = Document::open(&image)?;
    // All answers are created in advance, for every repetition, because copying must not count.
    let answers = vec![answer(); 2 * TIMES as usize];
    for answer in answers.into_iter().take(times as usize) {
        black_box(pooled(document, answer)?);
    }
    Ok(())
}

fn write_result(times: u32) -> Result<()> {
    let image = map_image();
    let results = pooled(Document::open(&image)?, answer())?;
    for _ in 0..times {
        black_box(xqar::write(&results, Dialect::Current));
    }
    Ok(())
}

fn read_result(times: u32) -> Result<()> {
    let image = map_image();
    let results = pooled(Document::open(&image)?, answer())?;
    let text = xqar::write(&results, Dialect::Current);
    for _ in 0..times {
        black_box(xqar::read(text.as_bytes())?);
    }
    Ok(())
}
