//! Results as JSON, for programs.
//!
//! The format is that of ASAM's `qc-report-json` with additional fields under `qcbus`. So a reader
//! of ASAM's report can read this one:
//!
//! ```json
//! {
//!   "version": "1.0.0",
//!   "qcbus": {
//!     "schema": 1,
//!     "verdict": "rejected",
//!     "inputFile": "/farm/maps/a.xodr", "displayPath": "maps/a.xodr",
//!     "resultFile": "/out/maps/a.xodr.xqar",
//!     "sha256": "…", "configSha256": "…",
//!     "issues": {"error": 1, "warning": 0, "information": 0},
//!     "checkers": {"completed": 5, "skipped": 1, "error": 0, "noStatus": 0},
//!     "rules": {"UID": "what the rule is about"}
//!   },
//!   "bundles": {
//!     "xodrBundle": {
//!       "name": "xodrBundle", "version": "…", "buildDate": "…", "summary": "…",
//!       "description": "…",
//!       "parameters": {"InputFile": {"name": "InputFile", "value": "…"}},
//!       "checkers": {
//!         "check_x": {
//!           "checkerId": "check_x", "description": "…", "summary": "…", "status": "completed",
//!           "parameters": {}, "metadata": {}, "addressedRule": ["UID"],
//!           "issues": [{
//!             "issueId": 0, "level": "error", "description": "…", "ruleUid": "UID",
//!             "locations": {
//!               "file": [{"description": "…", "column": 3, "row": 12, "offset": 210}],
//!               "xml": [{"description": "…", "xpath": "/OpenDRIVE/road[@id='5']"}],
//!               "inertial": [], "road": [], "time": [], "message": []
//!             },
//!             "domainSpecificInfo": ["<DomainSpecificInfo name=\"…\">…"],
//!             "places": [{"path": "/farm/maps/a.xodr", "row": 12, "column": 3, "xpath": "…"}]
//!           }]
//!         }
//!       }
//!     }
//!   },
//!   "rules": {
//!     "addressed": ["UID"],
//!     "violated": {"error": ["UID"], "warning": [], "information": []}
//!   }
//! }
//! ```
//!
//! * Keys are in this order. Bundles and checkers are in the order of the result, and rules are
//!   sorted. Equal results give equal bytes.
//! * `places` holds data that `locations` cannot express: which locations belong together, and
//!   places in other files. The first place is the main one. Absent fields are unknown.
//! * Bundles or checkers with the same name do not overwrite each other: the second one's key gets
//!   `#2`.
//! * An unknown digest is absent, for example in a report on a result file of another tool.
//!
//! Parameters: `OutputFile` (see [`Output`]; one file for several results is a sequence of JSON
//! documents, as `jq` and streaming readers take it) and `Indent` (0 to 16 spaces, default 2). With
//! 0, each document is one line: JSON Lines. 0 is the default on a stream and in one file for
//! several results.

mod document;
mod issue;
mod ordered;
mod report;
mod xml;

#[cfg(doc)]
use qcbus_reporter_sdk::Output;

use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{FormatReporter, Registration};
use serde::Serialize as _;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-json";

/// Registration of this reporter.
pub static REPORTER: Registration = Registration {
    alias: "json",
    name: NAME,
    about: "NAME.json beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(report::Documents, setting)),
};

/// Schema number under `qcbus.schema`. It changes when a field changes its meaning or is removed.
pub const SCHEMA: u32 = 1;

/// Number of spaces per level unless `Indent` sets another number.
pub const DEFAULT_INDENT: usize = 2;

/// Returns the report of one result; it ends with a line feed. With `indent` 0 it is one line.
///
/// # Errors
/// None that values of these types can cause; serde's interface has one.
pub fn render(result: &ResultMessage, indent: usize) -> Result<String, serde_json::Error> {
    let document = document::document(result);
    let mut bytes = Vec::new();
    if indent == 0 {
        serde_json::to_writer(&mut bytes, &document)?;
    } else {
        let blanks = vec![b' '; indent];
        let formatter = serde_json::ser::PrettyFormatter::with_indent(&blanks);
        document.serialize(&mut serde_json::Serializer::with_formatter(
            &mut bytes, formatter,
        ))?;
    }
    bytes.push(b'\n');
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
