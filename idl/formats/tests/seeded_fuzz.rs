//! The fuzz targets' bodies on stable, from good files bent by a fixed pseudo-random sequence.

#![expect(
    clippy::unwrap_used,
    reason = "a test fails by panicking, in its helpers too"
)]

mod common;

use qcbus_formats::fuzzing;
use qcbus_formats::xqar::{Dialect, write};

const CONFIG: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Config><Param name="InputFile" value="a.xodr"/>
<CheckerBundle application="xodr"><Param name="resultFile" value="r.xqar"/>
<Checker checkerId="c" minLevel="3" maxLevel="1"><Param name="qcbus.level" value="error"/></Checker>
<!-- two --><Checker checkerId="d" minLevel="1" maxLevel="3"/></CheckerBundle>
<ReportModule application="TextReport"><Param name="LineWidth" value="100&#10;"/></ReportModule>
</Config>"#;

/// splitmix64: the same sequence everywhere.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        usize::try_from((z ^ (z >> 31)) % end.max(1) as u64).unwrap()
    }
}

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

/// Bytes removed, doubled, replaced and inserted.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let end = (at + random.below(40)).min(bytes.len());
        match random.below(4) {
            0 => drop(bytes.drain(at..end)),
            1 => {
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            2 if at < bytes.len() => bytes[at] = u8::try_from(random.below(256)).unwrap(),
            _ => drop(bytes.splice(at..at, MARKUP[random.below(MARKUP.len())].iter().copied())),
        }
    }
}

fn run(seeds: &[String], body: fn(&[u8]), rounds: u64) {
    for seed in seeds {
        body(seed.as_bytes());
        for round in 0..rounds {
            let mut bytes = seed.clone().into_bytes();
            damage(&mut bytes, &mut Random(round));
            body(&bytes);
        }
    }
}

#[test]
fn configurations() {
    run(&[CONFIG.to_owned()], fuzzing::config, 4000);
}

#[test]
fn results() {
    let full = common::full();
    let seeds = [
        write(&full, Dialect::Current),
        write(&full, Dialect::Qc4Openx),
    ];
    run(&seeds, fuzzing::xqar, 2000);
}
