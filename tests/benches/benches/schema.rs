//! Validation against the shipped schemas: MB/s from the image, and whether the time grows only
//! with the size. With the feature `xsd-schema` it also shows how many times slower that crate is.
//!
//! `cargo bench -p qcbus-benches --bench schema`
//!
//! `QCBUS_XSDS=DIR cargo bench -p qcbus-benches --bench schema --features xsd-schema`, where
//! `tests/schema/tables_agree.py --keep DIR` creates DIR: the other crate needs the XSDs, which the
//! project does not contain.
//!
//! Times are CPU times, so that other work on the machine counts little. Sizes are those of the
//! source, not of the image.

use std::io::Write;
use std::path::Path;

use qcbus_benches::Result;
use qcbus_benches::figures::{digits, head, row};
use qcbus_benches::{maps, scenarios};
use qcbus_document::{Document, FileKind};
use qcbus_schema::{Limits, SHIPPED, Schema, Version};

const SIZE: usize = 20_000_000;
const RUNS: usize = 9;

fn main() -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}\n", qcbus_benches::machine::describe())?;
    let columns = [
        "",
        "10 MB",
        "20 MB",
        "time 20 ÷ 10 MB",
        "xsd-schema",
        "ratio",
    ];
    writeln!(out, "{}", head(&columns))?;
    for case in &CASES {
        writeln!(out, "{}", row(&case.measure()?))?;
    }
    writeln!(out, "\n{}", other::note())?;
    Ok(())
}

struct Case {
    name: &'static str,
    table: &'static str,
    kind: FileKind,
    minor: u32,
}

const CASES: [Case; 4] = [
    Case::map("map, OpenDRIVE 1.4", "xodr-1.4", 4),
    Case::map("map, OpenDRIVE 1.7", "xodr-1.7", 7),
    Case::map("map, OpenDRIVE 1.8", "xodr-1.8", 8),
    Case {
        name: "scenario, OpenSCENARIO 1.3",
        table: "xosc-1.3",
        kind: FileKind::Xosc,
        minor: 3,
    },
];

impl Case {
    const fn map(name: &'static str, table: &'static str, minor: u32) -> Case {
        Case {
            name,
            table,
            kind: FileKind::Xodr,
            minor,
        }
    }

    fn text(&self, bytes: usize) -> String {
        if self.kind == FileKind::Xosc {
            return scenarios::scenario(bytes);
        }
        let minor = format!("revMinor=\"{}\"", self.minor);
        maps::map(bytes, 1).replacen("revMinor=\"7\"", &minor, 1)
    }

    fn schema(&self) -> Result<&'static Schema> {
        let version = Version {
            major: 1,
            minor: self.minor,
        };
        let found = SHIPPED
            .iter()
            .find(|one| one.kind == self.kind && one.version == version);
        let found = found.ok_or("a version without tables")?;
        Ok(found.schema().map_err(Clone::clone)?)
    }

    fn measure(&self) -> Result<Vec<String>> {
        let schema = self.schema()?;
        let (small, large) = (self.text(SIZE / 2), self.text(SIZE));
        let (small_image, large_image) = (image(self.kind, &small), image(self.kind, &large));
        let (small_document, large_document) =
            (Document::open(&small_image)?, Document::open(&large_image)?);
        let mut other = other::Validator::new(self.table)?;
        let [mut half, mut whole, mut theirs] = [f64::INFINITY; 3];
        // The measurements alternate, so that disturbances of the machine affect all of them.
        for turn in 0..RUNS {
            half = half.min(validate(schema, &small_document)?);
            whole = whole.min(validate(schema, &large_document)?);
            if turn < 3 {
                theirs = theirs.min(other.validate(large.as_bytes())?);
            }
        }
        let rate = |bytes: usize, seconds: f64| format!("{:.0} MB/s", bytes as f64 / 1e6 / seconds);
        let (their_rate, ratio) = if theirs.is_finite() {
            (rate(large.len(), theirs), digits(theirs / whole))
        } else {
            ("–".to_owned(), "–".to_owned())
        };
        Ok(vec![
            self.name.to_owned(),
            rate(small.len(), half),
            rate(large.len(), whole),
            digits(whole / half),
            their_rate,
            ratio,
        ])
    }
}

fn image(kind: FileKind, text: &str) -> Vec<u8> {
    let name = if kind == FileKind::Xodr {
        "a.xodr"
    } else {
        "a.xosc"
    };
    let limits = qcbus_ingest::Limits::default();
    qcbus_ingest::prepare_bytes(Path::new(name), text.as_bytes().to_vec(), &limits).build()
}

/// Validates a document and returns the seconds on the CPU.
fn validate(schema: &Schema, document: &Document<'_>) -> Result<f64> {
    let start = on_cpu()?;
    let report = schema.validate(document, Limits::default());
    let took = on_cpu()? - start;
    match report.violations.first() {
        Some(first) => Err(format!("the document is not valid: {}", first.text).into()),
        None => Ok(took),
    }
}

/// Returns the seconds that this process has spent on a CPU.
fn on_cpu() -> Result<f64> {
    let stat = std::fs::read_to_string("/proc/self/schedstat")?;
    let nanoseconds: f64 = stat.split(' ').next().unwrap_or_default().parse()?;
    Ok(nanoseconds / 1e9)
}

#[cfg(feature = "xsd-schema")]
mod other {
    //! Validation with the crate xsd-schema, including its own parsing.

    use std::path::PathBuf;

    use qcbus_benches::Result;
    use xsd_schema::SchemaSetBuilder;
    use xsd_schema::validation::{
        CollectingValidationSink, SchemaValidator, ValidationFlags, drive_quick_xml,
    };

    /// Main file of each table, which includes the others. The crate's default build knows XSD 1.0
    /// only.
    const MAIN: [(&str, &str); 3] = [
        ("xodr-1.4", "OpenDRIVE_1.4H.xsd"),
        ("xodr-1.7", "opendrive_17_core.xsd"),
        ("xosc-1.3", "OpenSCENARIO.xsd"),
    ];

    pub(super) struct Validator(Option<PathBuf>);

    impl Validator {
        pub(super) fn new(table: &str) -> Result<Validator> {
            let directory = std::env::var_os("QCBUS_XSDS").ok_or("QCBUS_XSDS is not set")?;
            let main = MAIN.iter().find(|(name, _)| *name == table);
            Ok(Validator(main.map(|(_, file)| {
                PathBuf::from(directory).join(table).join(file)
            })))
        }

        /// Validates a text and returns the seconds on the CPU, or infinity if the table has no
        /// schema here. Compiling the schema does not count.
        pub(super) fn validate(&mut self, text: &[u8]) -> Result<f64> {
            let Some(main) = &self.0 else {
                return Ok(f64::INFINITY);
            };
            let main = main.canonicalize()?;
            let source = std::fs::read_to_string(&main)?;
            let set = SchemaSetBuilder::new()
                .add_source(&source, &main.to_string_lossy())?
                .compile()?
                .into_schema_set();
            let validator = SchemaValidator::new(&set, ValidationFlags::default());
            let (mut errors, mut warnings) = (Vec::new(), Vec::new());
            let start = super::on_cpu()?;
            let mut run = validator.start_run(CollectingValidationSink {
                errors: &mut errors,
                warnings: &mut warnings,
            });
            drive_quick_xml(text, &mut run, &set)?;
            drop(run);
            let took = super::on_cpu()? - start;
            if let Some(first) = errors.first() {
                return Err(format!("xsd-schema takes the document for invalid: {first:?}").into());
            }
            Ok(took)
        }
    }

    pub(super) fn note() -> &'static str {
        "xsd-schema: streaming over its own parse, XSD 1.0 only, its schema compiled beforehand."
    }
}

#[cfg(not(feature = "xsd-schema"))]
mod other {
    //! Replacement if there is no other validator to compare with.

    use qcbus_benches::Result;

    pub(super) struct Validator;

    impl Validator {
        #[expect(
            clippy::unnecessary_wraps,
            reason = "same signature as with the feature"
        )]
        pub(super) fn new(_: &str) -> Result<Validator> {
            Ok(Validator)
        }

        #[expect(
            clippy::unnecessary_wraps,
            reason = "same signature as with the feature"
        )]
        pub(super) fn validate(&mut self, _: &[u8]) -> Result<f64> {
            Ok(f64::INFINITY)
        }
    }

    pub(super) fn note() -> &'static str {
        "xsd-schema was not measured: the feature `xsd-schema` is off."
    }
}
