//! Formats the `issues` block of a page: findings in readable form.

use std::fmt::Write as _;

use qcbus_formats::location::OtherPlace;
use qcbus_formats::xqar::{Issue, Location, Locations};

use super::example::Staged;

/// Formats one issue per paragraph: level, place and text on the first line, further places
/// indented. The UID is included only if it differs from `uid`.
pub(super) fn render(issues: &[Issue], uid: &str, staged: &Staged) -> String {
    let mut text = String::new();
    for issue in issues {
        let mut places = issue.locations.iter();
        let first = places
            .next()
            .map(|locations| place(locations, staged))
            .unwrap_or_default();
        let rule = if issue.rule_uid == uid {
            String::new()
        } else {
            format!(" [{}]", issue.rule_uid)
        };
        let level = issue.level.as_str();
        let _ = writeln!(text, "{level} {}:{rule} {}", first.0, issue.description);
        for extra in first.1 {
            let _ = writeln!(text, "  {extra}");
        }
        for locations in places {
            let (whereabouts, extras) = place(locations, staged);
            let _ = writeln!(text, "  {whereabouts}: {}", locations.written());
            for extra in extras {
                let _ = writeln!(text, "    {extra}");
            }
        }
        let elsewhere = issue
            .locations
            .iter()
            .filter_map(|it| it.elsewhere.as_ref());
        for OtherPlace {
            row, column, xpath, ..
        } in elsewhere
        {
            let xpath = xpath.as_ref().map(|xpath| format!(" xpath={xpath}"));
            let xpath = xpath.unwrap_or_default();
            let _ = writeln!(text, "  elsewhere: row={row} column={column}{xpath}");
        }
    }
    staged.without_folder(&text)
}

/// Returns row, column and XPath, then all other information about the place.
fn place(locations: &Locations, staged: &Staged) -> (String, Vec<String>) {
    let (mut words, mut extras) = (Vec::new(), Vec::new());
    for location in &locations.places {
        match location {
            Location::File { row, column, .. } => words.push(row_column(*row, *column, staged)),
            Location::Xml { xpath } => words.push(xpath.clone()),
            Location::Inertial { x, y, z } => {
                extras.push(format!("point x={x:.3} y={y:.3} z={z:.3}"));
            }
            Location::Road { road_id, s, t } => {
                extras.push(format!("road {road_id} s={s:.3} t={t:.3}"));
            }
            Location::Time { time } => extras.push(format!("time {time}")),
            Location::Message { index, .. } => extras.push(format!("message {index}")),
        }
    }
    (words.join(" "), extras)
}

fn row_column(row: u64, column: u64, staged: &Staged) -> String {
    let shown = staged.hidden_rows + 1..=staged.hidden_rows + staged.shown_rows + 1;
    if shown.contains(&row) {
        format!("{}:{column}", row - staged.hidden_rows)
    } else {
        "(around)".to_owned()
    }
}
