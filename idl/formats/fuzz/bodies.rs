//! Bodies of fuzz targets, which take any bytes and panic if a guarantee is broken. Seeded tests
//! run them on stable, and the wrappers for cargo-fuzz call them.

use qcbus_formats::config::{Config, Known};
use qcbus_formats::xqar::{self, Dialect};

/// Reads a configuration. Reading never panics, and a configuration that was read answers every
/// query.
pub fn config(bytes: &[u8]) {
    let Ok(parsed) = Config::parse(bytes) else {
        return;
    };
    let config = parsed.config;
    assert!(
        parsed
            .oddities
            .iter()
            .all(|notice| notice.row > 0 && notice.column > 0)
    );
    let _ = config.check(&Known::default());
    let _ = config.input_file();
    for bundle in &config.bundles {
        assert!(config.bundle(&bundle.application, "").is_some());
        for checker in &bundle.checkers {
            assert!(bundle.selects(&checker.id).runs(false));
            let _ = config.effective_params(Some(bundle), &checker.id, &[]);
        }
    }
}

/// Reads a result file. Reading never panics. A result that was read can be written in both forms
/// and read again, and writing it again gives the same bytes.
pub fn xqar(bytes: &[u8]) {
    let Ok(results) = xqar::read(bytes) else {
        return;
    };
    for dialect in [Dialect::Current, Dialect::Qc4Openx] {
        let first = xqar::write(&results, dialect);
        let again = xqar::read(first.as_bytes());
        assert!(
            again.is_ok(),
            "cannot read what was written: {again:?}\n{first}"
        );
        if let Ok(again) = again {
            assert_eq!(xqar::write(&again, dialect), first);
        }
    }
}
