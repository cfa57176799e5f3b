use crate::families::object_parts::{below, is_by_schema};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // From 1.5 on the schema requires the attribute but allows an empty value.
    let by_schema = is_by_schema(found, (1, 5), (1, 8));
    for record in below(map, "CRG", "surface") {
        check(record, by_schema, found);
    }
}

fn check(record: Node<'_>, by_schema: bool, found: &mut Sink<'_>) {
    let place = Place::attribute_or_node(record, "file");
    match record.attr("file") {
        None if !by_schema => {
            found.issue(
                place,
                "the CRG record has no `file`; it must name the file with the surface",
            );
        }
        Some(file) if file.trim().is_empty() => {
            found.issue(
                place,
                "`file` of the CRG record is empty; it must name the file with the surface",
            );
        }
        Some(file) if is_drive_path(file.trim()) => {
            let text = format!(
                "`file` of the CRG record is `{file}`, a path on one Windows computer; it must be relative to the \
                 map, with `/` between folders, otherwise readers find no surface"
            );
            found.issue(place, text);
        }
        Some(file) if file.contains('\\') => {
            let text = format!(
                "`file` of the CRG record is `{file}`, with `\\` between folders; only readers on Windows find the \
                 file, so use `/`"
            );
            found.issue(place, text).level(Level::Warning);
        }
        Some(file) if !file.trim().to_ascii_lowercase().ends_with(".crg") => {
            let text = format!(
                "`file` of the CRG record is `{file}`, but OpenCRG files are named `….crg`"
            );
            found.issue(place, text).level(Level::Information);
        }
        _ => {}
    }
}

/// Checks whether a path begins with a drive letter or the name of a Windows computer.
fn is_drive_path(path: &str) -> bool {
    let mut letters = path.chars();
    let drive = letters
        .next()
        .is_some_and(|letter| letter.is_ascii_alphabetic())
        && letters.next() == Some(':')
        && letters
            .next()
            .is_some_and(|letter| matches!(letter, '\\' | '/'));
    drive || path.starts_with("\\\\")
}
