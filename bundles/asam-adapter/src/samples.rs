//! Small valid files, one of each kind, over which a module tells which checkers it has.

use qcbus_document::FileKind;

/// A file in which there is nothing to find.
pub(crate) struct Sample {
    pub kind: FileKind,
    /// What it is called.
    pub name: &'static str,
    pub text: &'static str,
}

/// The samples. What no sample is there for, no module is asked about.
pub(crate) static SAMPLES: [Sample; 2] = [
    Sample {
        kind: FileKind::Xodr,
        name: "sample.xodr",
        text: include_str!("samples/sample.xodr"),
    },
    Sample {
        kind: FileKind::Xosc,
        name: "sample.xosc",
        text: include_str!("samples/sample.xosc"),
    },
];
