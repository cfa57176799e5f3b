//! Small valid files, one of each kind. They are used to learn the checkers of a module.

use qcbus_document::FileKind;

/// A valid file without any issue.
pub(crate) struct Sample {
    pub kind: FileKind,
    /// Name of the file.
    pub name: &'static str,
    pub text: &'static str,
}

/// All samples. Modules are not tested with kinds of files that have no sample.
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
