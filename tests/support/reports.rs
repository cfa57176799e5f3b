//! What the standard reporters write, and whether it is whole.

/// The standard reporters, and what each puts behind a file's name; longer ends first.
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

/// The file that a report is about, by its name; `None` for what is no report.
pub fn reported(name: &str) -> Option<&str> {
    if name.ends_with(".verdict.json") {
        return None;
    }
    let mut ends = REPORTS.iter().map(|(_, suffix)| suffix);
    ends.find_map(|suffix| name.strip_suffix(suffix))
}

/// What is wrong with a report of that name; `None` when it is whole.
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
        // A file without findings has no lines.
        it if it.ends_with(".concise.txt") && text.is_empty() => None,
        _ => ends_with("\n"),
    }
}
