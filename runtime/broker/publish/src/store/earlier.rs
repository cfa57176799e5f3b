//! Removal of results that earlier runs of `check` have left.

use std::io;
use std::path::Path;

use qcbus_disk::{foreign, remove};
use qcbus_messages::Verdict;
use qcbus_messages::path_text::{from_text, to_text};
use serde::Deserialize;

use super::leftovers::{input_of, named_by_result, walk};
use crate::result_paths::ResultPaths;

/// Removes the results of earlier runs for the files and directories of this run, with the reports
/// next to them. This includes results of removed files and of files to be checked now: a killed
/// run must not leave a result for other bytes.
///
/// Returns messages for the user about results that could not be removed.
pub fn remove_earlier_results(paths: &ResultPaths) -> Vec<String> {
    let mut failed = Vec::new();
    let mut clear = |xqar: &Path| {
        if let Err(error) = remove(xqar).and_then(|()| remove_reports(xqar)) {
            let xqar = to_text(xqar);
            failed.push(format!("cannot remove the earlier result {xqar}: {error}"));
        }
    };
    if let Some(single) = &paths.single {
        if input_of(single).is_some() {
            clear(single);
        }
        return failed;
    }
    walk(&paths.out, &mut |xqar| {
        if may_be_ours(paths, &xqar) && named_by_result(&xqar).is_some_and(|it| paths.contains(&it))
        {
            clear(&xqar);
        }
    });
    failed
}

/// Checks whether a result must be read. If only files are given, their names are known.
fn may_be_ours(paths: &ResultPaths, xqar: &Path) -> bool {
    if xqar.extension().is_none_or(|it| it != "xqar") {
        return false;
    }
    let mut given = paths.files.iter();
    !paths.roots.is_empty() || given.any(|file| file.file_name() == xqar.file_stem())
}

/// Maximum size of a report in bytes. A report has the same content as its result and is shorter.
const MOST_OF_A_REPORT: u64 = 1 << 30;

/// Removes the standard reports next to a result, if they belong to it.
fn remove_reports(xqar: &Path) -> io::Result<()> {
    let (json, text) = (xqar.with_extension("json"), xqar.with_extension("txt"));
    if foreign::read(&json, MOST_OF_A_REPORT).is_ok_and(|report| is_json_of(&report, xqar)) {
        remove(&json)?;
    }
    if foreign::read(&text, MOST_OF_A_REPORT).is_ok_and(|report| is_text_of(&report, xqar)) {
        remove(&text)?;
    }
    Ok(())
}

/// The part of a report that names its result.
#[derive(Deserialize)]
struct Report {
    qcbus: About,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct About {
    result_file: String,
}

fn is_json_of(report: &[u8], xqar: &Path) -> bool {
    let report: Option<Report> = serde_json::from_slice(report).ok();
    report.is_some_and(|it| from_text(&it.qcbus.result_file) == xqar)
}

/// Checks whether a text report belongs to a result. The report has the verdict in a line of its own.
fn is_text_of(report: &[u8], xqar: &Path) -> bool {
    let Ok(report) = std::str::from_utf8(report) else {
        return false;
    };
    let name = xqar.file_stem().unwrap_or_default().to_string_lossy();
    let verdicts = [Verdict::Accepted, Verdict::Rejected, Verdict::Undetermined];
    report.lines().any(|line| {
        let said = verdicts
            .iter()
            .find_map(|it| line.strip_prefix(it.as_str()));
        let about = said.and_then(|rest| rest.strip_prefix(": "));
        about.is_some_and(|rest| rest.contains(&*name))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_own_reports_are_removed() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let ours = format!(
            "{{\"qcbus\": {{\"schema\": 1, \"resultFile\": \"{}\"}}}}",
            at("a.xodr.xqar").display()
        );
        std::fs::write(at("a.xodr.json"), &ours).unwrap();
        std::fs::write(at("a.xodr.txt"), "\nrejected: in/a.xodr: 1 error\n").unwrap();
        std::fs::write(at("b.xodr.json"), &ours).unwrap();
        std::fs::write(at("b.xodr.txt"), "to be rejected: b.xodr\n").unwrap();
        for name in ["a.xodr.xqar", "b.xodr.xqar"] {
            remove_reports(&at(name)).unwrap();
        }
        assert!(!at("a.xodr.json").exists() && !at("a.xodr.txt").exists());
        assert!(at("b.xodr.json").exists() && at("b.xodr.txt").exists());
    }
}
