//! Checks the form of a `geoReference`. The standard requires a PROJ string. Other forms, such as
//! well-known text and EPSG codes, are harmless where PROJ itself reads the map.

use super::proj_string::{self, Flaw};
use crate::prelude::*;

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

/// Authorities for codes of reference systems that PROJ knows.
const AUTHORITIES: &[&str] = &["EPSG", "ESRI", "IGNF", "IAU_2015", "NKG", "OGC"];

/// EPSG codes for coordinates in degrees: WGS 84, with height, ETRS89, NAD83.
const DEGREES: &[u32] = &[4326, 4979, 4258, 4269];

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

/// Checks a code of a reference system, such as `EPSG:25832`, which `+init=` accepts as well.
pub(crate) fn code(text: &str) -> Option<Flaw> {
    let lower = text.to_ascii_lowercase();
    if lower.starts_with("urn:ogc:def:crs:") || lower.contains("opengis.net/def/crs/") {
        return Some(other_form("a URN or URL"));
    }
    let (authority, code) = text.split_once(':')?;
    let (authority, code) = (authority.trim().to_ascii_uppercase(), code.trim());
    if !AUTHORITIES.contains(&authority.as_str()) {
        return None;
    }
    if authority != "EPSG" {
        return Some(other_form("a code"));
    }
    let horizontal = code.split('+').next()?.trim();
    Some(match horizontal.parse() {
        Ok(number) if DEGREES.contains(&number) => no_plane(text),
        Ok(1024..=32_767) => other_form("an EPSG code"),
        _ => warning(format!(
            "`{}` is not an EPSG code; EPSG codes are numbers from 1024 to 32767",
            short(text)
        )),
    })
}

fn other_form(form: &str) -> Flaw {
    Flaw {
        level: Level::Information,
        text: format!(
            "`geoReference` is {form}, which some map readers do not understand; the standard requires a PROJ \
             string, such as `+proj=utm +zone=32`"
        ),
    }
}

fn no_plane(what: &str) -> Flaw {
    warning(format!(
        "`{what}` gives degrees and no projection onto a plane, but x and y of the map are metres on a plane"
    ))
}

fn warning(text: String) -> Flaw {
    Flaw {
        level: Level::Warning,
        text,
    }
}

/// Returns the beginning of a long text.
fn short(text: &str) -> String {
    let mut letters = text.chars();
    let start: String = letters.by_ref().take(40).collect();
    let start = start.split_whitespace().collect::<Vec<_>>().join(" ");
    if letters.next().is_some() {
        format!("{start}…")
    } else {
        start
    }
}
