//! Reports of the standard reporters, and the check whether a report is complete.

/// Standard reporters and the suffix that each appends to a file name. Longer suffixes come first.
pub const REPORTS: [(&str, &str); 8] = [
    ("gitlab", ".codequality.json"),
    ("concise", ".concise.txt"),
    ("github", ".github.txt"),
    ("junit", ".junit.xml"),
    ("sarif", ".sarif"),
    ("html", ".html"),
    ("json", ".json"),
    ("text", ".txt"),
];

/// Returns the file name to which a report belongs, or `None` if the name is not a report.
pub fn reported(name: &str) -> Option<&str> {
    if name.ends_with(".verdict.json") {
        return None;
    }
    let mut ends = REPORTS.iter().map(|(_, suffix)| suffix);
    ends.find_map(|suffix| name.strip_suffix(suffix))
}

/// Returns the fault of a report with that name, or `None` if the report is complete.
pub fn torn(name: &str, bytes: &[u8]) -> Option<String> {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => return Some(error.to_string()),
    };
    let ends_with =
        |end: &str| (!text.ends_with(end)).then(|| format!("it does not end with {end}"));
    match name {
        it if it.ends_with(".json") || it.ends_with(".sarif") => {
            let parsed = serde_json::from_str::<serde_json::Value>(text);
            parsed.err().map(|error| error.to_string())
        }
        it if it.ends_with(".xml") => ends_with("</testsuites>\n"),
        it if it.ends_with(".html") => ends_with("</html>\n"),
        // A report without findings has no lines.
        it if it.ends_with(".concise.txt") && text.is_empty() => None,
        _ => ends_with("\n"),
    }
}
