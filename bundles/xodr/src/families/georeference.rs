//! Checks the form of a `geoReference`. The standard requires a PROJ string. Other forms, such as
//! well-known text and EPSG codes, are harmless where PROJ itself reads the map.

use super::proj_string;
use super::reference_code::{Flaw, code, no_plane, other_form, short, warning};

/// Names at the start of well-known text. The last ones give degrees, not a plane.
const WKT: &[&str] = &[
    "PROJCS",
    "PROJCRS",
    "PROJECTEDCRS",
    "DERIVEDPROJCRS",
    "COMPD_CS",
    "COMPOUNDCRS",
    "BOUNDCRS",
    "LOCAL_CS",
    "ENGCRS",
    "ENGINEERINGCRS",
];
const WKT_IN_DEGREES: &[&str] = &[
    "GEOGCS",
    "GEOGCRS",
    "GEOGRAPHICCRS",
    "GEODCRS",
    "GEODETICCRS",
    "GEOCCS",
];

/// Returns the faults in the text of a `geoReference` that is not empty.
pub(crate) fn flaws(text: &str) -> Vec<Flaw> {
    if text.starts_with("<![CDATA[") {
        return vec![warning(format!(
            "the text begins with `{}`: the CDATA marks are escaped and therefore part of the text, which is \
             then not a PROJ string; write them unescaped or remove them",
            short(text)
        ))];
    }
    if let Some(found) = wkt(text).or_else(|| code(text)) {
        return vec![found];
    }
    if text.starts_with('{') && text.ends_with('}') && text.contains("\"type\"") {
        return vec![other_form("PROJ's JSON")];
    }
    if proj_string::is_one(text) {
        return proj_string::flaws(text);
    }
    vec![warning(format!(
        "`{}` is not a PROJ string; it must name a projection, such as `+proj=utm +zone=32`",
        short(text)
    ))]
}

fn wkt(text: &str) -> Option<Flaw> {
    let head = text.split(['[', '(']).next()?.trim().to_ascii_uppercase();
    let in_degrees = WKT_IN_DEGREES.contains(&head.as_str());
    if head.len() == text.len() || !(in_degrees || WKT.contains(&head.as_str())) {
        return None;
    }
    let depth = text.split('"').step_by(2).flat_map(str::chars);
    let depth = depth.fold(0_i64, |depth, letter| match letter {
        '[' | '(' => depth + 1,
        ']' | ')' => depth - 1,
        _ => depth,
    });
    Some(if depth != 0 || text.matches('"').count() % 2 == 1 {
        warning(format!(
            "the well-known text that begins with `{}` is cut off or broken: its brackets or quotes are not closed",
            short(text)
        ))
    } else if in_degrees {
        no_plane(&head)
    } else {
        other_form("well-known text")
    })
}
