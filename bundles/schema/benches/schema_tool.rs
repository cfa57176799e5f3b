//! A tool for the scripts under `tests/`: compiles XSDs, validates files against tables, and
//! measures the time of both. `cargo bench -p qcbus-schema --bench schema_tool --no-run` builds it and
//! prints its path.
//!
//! ```text
//! schema_tool compile TITLE OUT XSD...   write tables
//! schema_tool validate TABLES            read file names from stdin, print one verdict per line:
//!                                        file, valid|invalid|ill-formed, row, end row of the tag, byte
//!                                        offset of the element or attribute value, code, text
//! schema_tool load                       time of reading all shipped tables
//! schema_tool time TABLES FILE           megabytes per second of validation alone
//! ```
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a tool for scripts"
)]

use std::io::BufRead;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use qcbus_document::{Attribute, Document, Node};
use qcbus_ingest::prepare_bytes;
use qcbus_schema::{Limits, SHIPPED, Schema, compile};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench") // cargo adds it
        .collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match words.as_slice() {
        ["compile", title, out, files @ ..] => compile_files(title, out, files),
        ["validate", tables] => validate_files(tables),
        ["load"] => load_all(),
        ["time", tables, file] => time(tables, file),
        _ => Err(
            "usage: schema_tool compile TITLE OUT XSD... | validate TABLES | time TABLES FILE"
                .into(),
        ),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("{text}");
            ExitCode::FAILURE
        }
    }
}

fn image(path: &str) -> Result<Vec<u8>, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("failed to read {path}: {error}"))?;
    Ok(prepare_bytes(Path::new(path), bytes, &qcbus_ingest::Limits::default()).build())
}

fn compile_files(title: &str, out: &str, files: &[&str]) -> Result<(), String> {
    let images = files
        .iter()
        .map(|path| image(path))
        .collect::<Result<Vec<_>, _>>()?;
    let documents: Result<Vec<Document<'_>>, _> =
        images.iter().map(|image| Document::open(image)).collect();
    let documents = documents.map_err(|error| error.to_string())?;
    let schema = compile(title, &documents).map_err(|error| format!("failed to {error}"))?;
    std::fs::write(out, schema.to_notation())
        .map_err(|error| format!("failed to write {out}: {error}"))
}

fn tables(path: &str) -> Result<Schema, String> {
    let text =
        std::fs::read_to_string(path).map_err(|error| format!("failed to read {path}: {error}"))?;
    Schema::from_notation(&text).map_err(|error| format!("failed to {error}"))
}

fn validate_files(path: &str) -> Result<(), String> {
    let schema = tables(path)?;
    for line in std::io::stdin().lock().lines() {
        let file = line.map_err(|error| error.to_string())?;
        println!("{file}\t{}", verdict(&schema, &file)?);
    }
    Ok(())
}

fn verdict(schema: &Schema, file: &str) -> Result<String, String> {
    let image = image(file)?;
    let document = Document::open(&image).map_err(|error| error.to_string())?;
    if !document.is_well_formed() {
        return Ok("ill-formed\t0\t0\t0\t\t".to_owned());
    }
    let report = schema.validate(&document, Limits::default());
    let Some(first) = report.violations.first() else {
        return Ok("valid\t0\t0\t0\t\t".to_owned());
    };
    let row = document.position(first.node.offset()).row;
    let text = first.text.replace(['\n', '\t'], " ");
    let at = first.node.offset();
    let at = first.attribute.map_or(at, |it| it.value_offset());
    Ok(format!(
        "invalid\t{row}\t{}\t{at}\t{}\t{text}",
        tag_end(&document, first.node),
        first.code.as_str()
    ))
}

/// Returns the row on which the start tag ends. libxml2 reports an element there.
fn tag_end(document: &Document<'_>, node: Node<'_>) -> u32 {
    let last = node
        .attributes()
        .last()
        .map_or(node.offset() + 1, |one| one.value_offset() + raw_len(&one));
    document.position(last).row
}

fn raw_len(attribute: &Attribute<'_>) -> u32 {
    u32::try_from(attribute.value().len()).unwrap_or(0)
}

fn time(path: &str, file: &str) -> Result<(), String> {
    let started = Instant::now();
    let schema = tables(path)?;
    println!("tables loaded in {:?}", started.elapsed());
    let image = image(file)?;
    let document = Document::open(&image).map_err(|error| error.to_string())?;
    let megabytes = f64::from(document.text_len()) / 1e6;
    // The clock is coarse, so small files are validated often enough to be measurable.
    let turns = (20.0 / megabytes).ceil().clamp(1.0, 10_000.0) as u32;
    let mut best = f64::INFINITY;
    let mut total = 0;
    for _ in 0..15 {
        let started = on_cpu();
        for _ in 0..turns {
            total = schema.validate(&document, Limits::default()).total();
        }
        best = best.min((on_cpu() - started) / f64::from(turns));
    }
    println!(
        "{megabytes:.1} MB, {total} violations, {:.1} ms on the CPU, {:.0} MB/s",
        best * 1e3,
        megabytes / best
    );
    Ok(())
}

/// Returns the seconds that this process spent on a CPU (Linux). Other processes on the machine do
/// not count.
fn on_cpu() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let nanoseconds: Option<f64> = stat.split(' ').next().and_then(|field| field.parse().ok());
    nanoseconds.unwrap_or(0.0) / 1e9
}

fn load_all() -> Result<(), String> {
    let mut best = f64::INFINITY;
    for _ in 0..10 {
        let started = on_cpu();
        let read = SHIPPED
            .iter()
            .map(|one| Schema::from_notation(one.notation));
        read.collect::<Result<Vec<_>, _>>()
            .map_err(|error| error.to_string())?;
        best = best.min(on_cpu() - started);
    }
    println!(
        "{} tables in {:.2} ms on the CPU",
        SHIPPED.len(),
        best * 1e3
    );
    Ok(())
}
