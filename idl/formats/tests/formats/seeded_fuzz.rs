//! Runs the fuzz targets' bodies on stable, with good files that a fixed pseudo-random sequence
//! damages.

use fastrand::Rng;
use qcbus_formats::xqar::{Dialect, write};

use crate::bodies;
use crate::common::full;

const CONFIG: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Config><Param name="InputFile" value="a.xodr"/>
<CheckerBundle application="xodr"><Param name="resultFile" value="r.xqar"/>
<Checker checkerId="c" minLevel="3" maxLevel="1"><Param name="qcbus.level" value="error"/></Checker>
<!-- two --><Checker checkerId="d" minLevel="1" maxLevel="3"/></CheckerBundle>
<ReportModule application="TextReport"><Param name="LineWidth" value="100&#10;"/></ReportModule>
</Config>"#;

const MARKUP: [&[u8]; 14] = [
    b"<",
    b">",
    b"\"",
    b"'",
    b"&",
    b"/>",
    b"</",
    b"<!--",
    b"]]>",
    b"<![CDATA[",
    b"&#0;",
    b"\xFF",
    b"<?xml ?>",
    b" a='b'",
];

/// Removes, duplicates, replaces and inserts bytes.
fn damage(bytes: &mut Vec<u8>, random: &mut Rng) {
    for _ in 0..=random.usize(..4) {
        let at = random.usize(..bytes.len().max(1));
        let end = (at + random.usize(..40)).min(bytes.len());
        match random.usize(..4) {
            0 => drop(bytes.drain(at..end)),
            1 => {
                let copy = bytes[at..end].to_vec();
                let to = random.usize(..bytes.len().max(1));
                bytes.splice(to..to, copy);
            }
            2 if at < bytes.len() => bytes[at] = random.u8(..),
            _ => drop(bytes.splice(at..at, MARKUP[random.usize(..MARKUP.len())].iter().copied())),
        }
    }
}

fn run(seeds: &[String], body: fn(&[u8]), rounds: u64) {
    for seed in seeds {
        body(seed.as_bytes());
        for round in 0..rounds {
            let mut bytes = seed.clone().into_bytes();
            damage(&mut bytes, &mut Rng::with_seed(round));
            body(&bytes);
        }
    }
}

#[test]
fn mutated_configurations_make_no_parser_panic() {
    run(&[CONFIG.to_owned()], bodies::config, 4000);
}

#[test]
fn mutated_results_make_no_parser_panic() {
    let full = full();
    let seeds = [
        write(&full, Dialect::Current),
        write(&full, Dialect::Qc4Openx),
    ];
    run(&seeds, bodies::xqar, 2000);
}
