//! Limits of GitHub
//! (<https://docs.github.com/en/code-security/reference/code-scanning/sarif-files/sarif-support-for-code-scanning>,
//! November 2026). GitHub rejects a larger log as a whole, so a reported cut is better.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use qcbus_reporter_sdk::ReportError;

use crate::finding::plain;
use crate::log::{Found, Notification, SarifResult, Severity};

/// Maximum number of results of a run that GitHub accepts.
pub const MOST_RESULTS: usize = 25_000;

/// Maximum number of results of a run that GitHub shows, the most severe ones.
pub const SHOWN_RESULTS: usize = 5_000;

/// Maximum size of a log in bytes, packed with gzip: 10 MB less a tenth. The uploader packs with
/// another library, and rules and files need space too.
pub const MOST_PACKED_BYTES: u64 = 9_000_000;

/// Maximum number of places of a result that GitHub shows; it accepts ten times as many.
pub const MOST_PLACES: usize = 100;

/// Returns how many of these findings fit into a log that also contains `around`. The findings are
/// sorted by importance.
pub(crate) fn fitting(findings: &[SarifResult], around: &[u8]) -> Result<usize, ReportError> {
    let findings = findings.get(..MOST_RESULTS).unwrap_or(findings);
    if fits_unpacked(findings, around)? {
        return Ok(findings.len());
    }
    let mut packed = GzEncoder::new(Counted(0), Compression::default());
    packed.write_all(around).map_err(refused)?;
    for (number, finding) in findings.iter().enumerate() {
        serde_json::to_writer(&mut packed, finding).map_err(refused)?;
        if packed.get_ref().0 > MOST_PACKED_BYTES {
            return Ok(number);
        }
    }
    Ok(findings.len())
}

/// Checks whether the findings fit even without packing.
fn fits_unpacked(findings: &[SarifResult], around: &[u8]) -> Result<bool, ReportError> {
    let mut size = Counted(around.len() as u64);
    for finding in findings {
        serde_json::to_writer(&mut size, finding).map_err(refused)?;
        size.0 += 1;
    }
    Ok(size.0 <= MOST_PACKED_BYTES)
}

fn refused(error: impl std::fmt::Display) -> ReportError {
    ReportError::Form(error.to_string())
}

/// Writer that only counts the bytes.
struct Counted(u64);

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Returns the notifications about limits.
pub(crate) fn notifications(found: Found, left_out: Found) -> Vec<Notification> {
    let total = found.total();
    let written = total.saturating_sub(left_out.total());
    let mut said = Vec::new();
    if left_out.total() > 0 {
        let Found {
            error,
            warning,
            note,
        } = left_out;
        said.push((
            Severity::Warning,
            format!(
                "{written} of {total} findings are in this report, the most severe ones: code scanning accepts \
                 no more. Left out: {error} errors, {warning} warnings, {note} notes."
            ),
        ));
    }
    if written > SHOWN_RESULTS as u64 {
        let text = format!(
            "Code scanning shows the {SHOWN_RESULTS} most severe of the {written} findings of this report."
        );
        said.push((Severity::Note, text));
    }
    let notification = |(level, text): (Severity, String)| Notification {
        level,
        message: plain(&text),
        locations: Vec::new(),
    };
    said.into_iter().map(notification).collect()
}
