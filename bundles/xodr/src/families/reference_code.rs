//! Codes of coordinate reference systems, and the faults of a `geoReference`.

use crate::prelude::*;

/// One fault with its level and text.
pub(crate) struct Flaw {
    pub(crate) level: Level,
    pub(crate) text: String,
}

/// Authorities for codes of reference systems that PROJ knows.
const AUTHORITIES: &[&str] = &["EPSG", "ESRI", "IGNF", "IAU_2015", "NKG", "OGC"];

/// EPSG codes for coordinates in degrees: WGS 84, with height, ETRS89, NAD83.
const DEGREES: &[u32] = &[4326, 4979, 4258, 4269];

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

pub(crate) fn other_form(form: &str) -> Flaw {
    Flaw {
        level: Level::Information,
        text: format!(
            "`geoReference` is {form}, which some map readers do not understand; the standard requires a PROJ \
             string, such as `+proj=utm +zone=32`"
        ),
    }
}

pub(crate) fn no_plane(what: &str) -> Flaw {
    warning(format!(
        "`{what}` gives degrees and no projection onto a plane, but x and y of the map are metres on a plane"
    ))
}

pub(crate) fn warning(text: String) -> Flaw {
    Flaw {
        level: Level::Warning,
        text,
    }
}

/// Returns the beginning of a long text.
pub(crate) fn short(text: &str) -> String {
    let mut letters = text.chars();
    let start: String = letters.by_ref().take(40).collect();
    let start = start.split_whitespace().collect::<Vec<_>>().join(" ");
    if letters.next().is_some() {
        format!("{start}…")
    } else {
        start
    }
}
