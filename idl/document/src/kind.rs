//! Detection of a file's kind from its name alone.

use std::path::Path;

use serde::{Deserialize, Serialize};

/// The kinds of file that qcbus checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FileKind {
    /// ASAM OpenDRIVE: `.xodr`, and gzipped `.xodrz` and `.xodr.gz`.
    Xodr,
    /// ASAM OpenSCENARIO XML: `.xosc`.
    Xosc,
    /// A modular scenario, a zip archive around `main.xosc`: `.mosc`.
    Mosc,
}

/// The suffix of file names that belongs to a file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Suffix {
    /// The suffix with its dot, in lower case.
    pub text: &'static str,
    /// The kind of file.
    pub kind: FileKind,
    /// Whether the file is compressed with gzip.
    pub packed: bool,
}

const fn plain(text: &'static str, kind: FileKind) -> Suffix {
    let packed = false;
    Suffix { text, kind, packed }
}

const fn packed(text: &'static str, kind: FileKind) -> Suffix {
    let packed = true;
    Suffix { text, kind, packed }
}

/// The only table of the suffixes of all files that qcbus checks.
pub const SUFFIXES: [Suffix; 5] = [
    plain(".xodr", FileKind::Xodr),
    packed(".xodrz", FileKind::Xodr),
    packed(".xodr.gz", FileKind::Xodr),
    plain(".xosc", FileKind::Xosc),
    plain(".mosc", FileKind::Mosc),
];

impl Suffix {
    /// Returns the suffix of a file's name; upper and lower case are equal. Returns `None` when the
    /// suffix is not in [`SUFFIXES`] or is the whole name.
    pub fn of_path(path: &Path) -> Option<Suffix> {
        // Only the end of a name matters, so the rest may be invalid UTF-8.
        let name = path.file_name()?.as_encoded_bytes().to_ascii_lowercase();
        let ends = |it: &Suffix| name.len() > it.text.len() && name.ends_with(it.text.as_bytes());
        SUFFIXES.into_iter().find(ends)
    }

    /// Returns all suffixes as text for a message: `.xodr .xodrz ...`.
    pub fn list() -> String {
        SUFFIXES.map(|it| it.text).join(" ")
    }
}

impl FileKind {
    /// All kinds, in a fixed order.
    pub const ALL: [FileKind; 3] = [FileKind::Xodr, FileKind::Xosc, FileKind::Mosc];

    /// Returns the kind that belongs to the suffix of a file's name; upper and lower case are
    /// equal. Returns `None` when qcbus does not check such files.
    pub fn of_path(path: &Path) -> Option<FileKind> {
        Suffix::of_path(path).map(|suffix| suffix.kind)
    }

    /// Returns the kind's short name: `xodr`, `xosc` or `mosc`.
    pub fn as_str(self) -> &'static str {
        match self {
            FileKind::Xodr => "xodr",
            FileKind::Xosc => "xosc",
            FileKind::Mosc => "mosc",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_kind_follows_suffix() {
        let of = |name: &str| FileKind::of_path(Path::new(name));
        assert_eq!(of("a/b.xodr"), Some(FileKind::Xodr));
        assert_eq!(of("b.XODR.GZ"), Some(FileKind::Xodr));
        assert_eq!(of("b.xodrz"), Some(FileKind::Xodr));
        assert_eq!(of("b.xosc"), Some(FileKind::Xosc));
        assert_eq!(of("b.mosc"), Some(FileKind::Mosc));
        assert_eq!(of("b.xml"), None);
        assert_eq!(of(".xodr"), None);
        let packed = |name: &str| Suffix::of_path(Path::new(name)).map(|it| it.packed);
        assert_eq!(
            (packed("b.XODRZ"), packed("b.xodr")),
            (Some(true), Some(false))
        );
        assert_eq!(Suffix::list(), ".xodr .xodrz .xodr.gz .xosc .mosc");
    }

    #[cfg(unix)]
    #[test]
    fn file_kind_ignores_invalid_utf8_before_suffix() {
        use std::os::unix::ffi::OsStrExt as _;
        let name = std::ffi::OsStr::from_bytes(b"a/stra\xDFe.XODR");
        assert_eq!(FileKind::of_path(Path::new(name)), Some(FileKind::Xodr));
    }
}
