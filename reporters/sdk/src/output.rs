//! Targets of reports, and replacement of files without visible partial content.

use std::path::{Path, PathBuf};

use qcbus_formats::xqar::Param;
use qcbus_messages::path_text::from_text;

use crate::{ReportError, Subject};

/// Target of reports: the parameter `OutputFile`, or `strReportFile` of ASAM's C++ reports.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Output {
    /// No parameter: one report per result, beside it. `a.xodr.xqar` gets `a.xodr.txt`.
    BesideResult,
    /// The name of an existing directory, or any name that ends in `/`: one report per result,
    /// under its display path.
    Directory(PathBuf),
    /// Any other name: one file with the newest report of every checked file.
    File(PathBuf),
    /// `__stdout__`, the name that ASAM uses for it.
    Stdout,
    /// `__stderr__`, the name that ASAM uses for it.
    Stderr,
}

impl Output {
    /// Returns the output of `OutputFile`. Relative names start at the current directory.
    pub fn of(params: &[Param]) -> Output {
        match asked(params) {
            None | Some("") => Output::BesideResult,
            Some("__stdout__") => Output::Stdout,
            Some("__stderr__") => Output::Stderr,
            Some(name) if name.ends_with('/') || Path::new(name).is_dir() => {
                Output::Directory(PathBuf::from(name))
            }
            Some(name) => Output::File(PathBuf::from(name)),
        }
    }

    /// Returns the path of a separate report; `None` for streams and for the shared file. `suffix`
    /// has no dot.
    pub fn own_file(&self, subject: Subject<'_>, suffix: &str) -> Option<PathBuf> {
        match self {
            Output::BesideResult => {
                let stem = subject.xqar.strip_suffix(".xqar").unwrap_or(subject.xqar);
                Some(from_text(&format!("{stem}.{suffix}")))
            }
            Output::Directory(directory) => {
                let path = format!("{}.{suffix}", subject.display_path);
                Some(directory.join(inside(&from_text(&path))))
            }
            Output::File(_) | Output::Stdout | Output::Stderr => None,
        }
    }
}

/// Returns the output given by the parameters, or `None` if they give none.
pub(crate) fn asked(params: &[Param]) -> Option<&str> {
    param(params, "OutputFile").or_else(|| param(params, "strReportFile"))
}

/// Returns the value of a parameter. The last one applies: more specific ones come later.
pub fn param<'p>(params: &'p [Param], name: &str) -> Option<&'p str> {
    let mut named = params.iter().rev().filter(|param| param.name == name);
    named.next().map(|param| param.value.as_str())
}

/// Replaces a file atomically and creates missing directories.
///
/// # Errors
/// [`ReportError::Write`] with the name of the file.
pub fn replace_file(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    qcbus_disk::write_whole(path, bytes, true).map_err(|source| ReportError::Write {
        path: path.to_owned(),
        source,
    })
}

/// Writes a report to a place that a user named. It follows links, and it writes to a device
/// instead of replacing it.
///
/// # Errors
/// [`ReportError::Write`] with the name of the file.
pub fn write_named(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    qcbus_disk::write_named(path, bytes, true).map_err(|source| ReportError::Write {
        path: path.to_owned(),
        source,
    })
}

/// Checks whether a report can be written at a place, and removes the report of an earlier run. A
/// missing report is better than an outdated one, which could be taken for the result after a kill.
///
/// # Errors
/// [`ReportError::Write`] with the name of the file.
pub fn clear_place(path: &Path) -> Result<(), ReportError> {
    if std::fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir()) {
        return Ok(());
    }
    write_named(path, b"")?;
    remove_file(&path.canonicalize().unwrap_or_else(|_| path.to_owned()))
}

/// Returns the content of an earlier report, or `None` if the file does not exist.
///
/// # Errors
/// [`ReportError::Write`] with the name of the file.
pub fn earlier(path: &Path) -> Result<Option<String>, ReportError> {
    // Devices and pipes have no earlier content, and reading them may never end.
    if !std::fs::metadata(path).is_ok_and(|data| data.is_file()) {
        return Ok(None);
    }
    let text = std::fs::read_to_string(path).map(Some);
    text.map_err(|source| ReportError::Write {
        path: path.to_owned(),
        source,
    })
}

/// Removes a file if it exists.
///
/// # Errors
/// [`ReportError::Write`].
pub fn remove_file(path: &Path) -> Result<(), ReportError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(ReportError::Write {
            path: path.to_owned(),
            source,
        }),
        _ => Ok(()),
    }
}

/// Removes the parts of a path that would lead out of its base directory.
pub fn inside(path: &Path) -> PathBuf {
    use std::path::Component;
    path.components()
        .filter(|part| matches!(part, Component::Normal(_)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::responder::samples::result;

    fn params(value: &str) -> Vec<Param> {
        vec![Param {
            name: "OutputFile".into(),
            value: value.into(),
        }]
    }

    #[test]
    fn output_parameter_of_older_reports_is_accepted() {
        let named = |name: &str, value: &str| Param {
            name: name.into(),
            value: value.into(),
        };
        let old = named("strReportFile", "rep.txt");
        assert_eq!(
            Output::of(std::slice::from_ref(&old)),
            Output::File(PathBuf::from("rep.txt"))
        );
        let both = [named("OutputFile", "own.txt"), old];
        assert_eq!(Output::of(&both), Output::File(PathBuf::from("own.txt")));
    }

    #[test]
    fn output_parameter_decides_where_reports_go() {
        let result = result(1, "maps/a.xodr");
        assert_eq!(Output::of(&[]), Output::BesideResult);
        assert_eq!(
            Output::of(&[]).own_file(Subject::from(&result), "txt"),
            Some(PathBuf::from("/out/maps/a.xodr.txt"))
        );
        assert_eq!(
            Output::of(&params("r/")).own_file(Subject::from(&result), "json"),
            Some(PathBuf::from("r/maps/a.xodr.json"))
        );
        assert_eq!(
            Output::of(&params("all.txt")),
            Output::File("all.txt".into())
        );
        assert_eq!(Output::of(&params("__stdout__")), Output::Stdout);
    }

    #[test]
    fn non_utf8_paths_have_separate_reports() {
        use std::os::unix::ffi::OsStrExt as _;
        let mut result = result(1, "bytes:maps/a%FE.xodr");
        result.xqar = "bytes:/out/maps/a%FE.xodr.xqar".into();
        let name = std::ffi::OsStr::from_bytes(b"maps/a\xFE.xodr.txt");
        for (output, directory) in [(&params("r/")[..], "r"), (&[], "/out")] {
            let own = Output::of(output).own_file(Subject::from(&result), "txt");
            assert_eq!(own, Some(Path::new(directory).join(name)));
        }
    }

    #[test]
    fn display_path_cannot_leave_output_directory() {
        let result = result(1, "../../etc/a.xodr");
        assert_eq!(
            Output::of(&params("r/")).own_file(Subject::from(&result), "txt"),
            Some(PathBuf::from("r/etc/a.xodr.txt"))
        );
    }

    #[test]
    fn more_specific_parameter_wins() {
        let mut both = params("global.txt");
        both.extend(params("own.txt"));
        assert_eq!(param(&both, "OutputFile"), Some("own.txt"));
        assert_eq!(param(&both, "Indent"), None);
    }

    #[test]
    fn file_is_replaced_without_leftovers() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new/report.txt");
        replace_file(&path, b"one").unwrap();
        replace_file(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        let entries = std::fs::read_dir(path.parent().unwrap()).unwrap().count();
        assert_eq!(entries, 1);
    }

    #[test]
    fn write_error_names_the_file() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("file"), "").unwrap();
        let error = replace_file(&dir.path().join("file/report.txt"), b"x").unwrap_err();
        assert!(error.to_string().contains("file/report.txt"), "{error}");
    }
}
