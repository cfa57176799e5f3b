//! Checks of a PROJ string. PROJ itself does not report many faults: it ignores unknown names and
//! uses defaults for missing values.

use super::proj_names::{ANGLES, CHOICES, CONES, MERIDIANS, NO_PROJECTIONS, NUMBERS, keys, names};
use super::proj_values::{degrees, number};
use super::reference_code::{Flaw, code};
use crate::prelude::*;
use qcbus_schema::closest;

/// Maximum numbers of checked words, where a dozen is usual, and of bytes per word.
const MOST_WORDS: usize = 200;
const LONGEST_WORD: usize = 100;

/// A word of the string: `+key=value` or `+key`.
struct Word<'t> {
    key: &'t str,
    value: Option<&'t str>,
}

/// Checks whether a text is intended as a PROJ string.
pub(crate) fn is_one(text: &str) -> bool {
    joined(text).split_whitespace().any(|word| {
        let name = word.trim_start_matches('+');
        word.len() > name.len() || name.starts_with("proj=") || name.starts_with("init=")
    })
}

/// Returns all faults of the string.
pub(crate) fn flaws(text: &str) -> Vec<Flaw> {
    let text = joined(text);
    let words = text.split_whitespace().take(MOST_WORDS);
    let words: Vec<Word<'_>> = words.map(word).collect();
    let value = |key: &str| words.iter().find(|word| word.key == key)?.value;
    let projection = value("proj");
    let is_pipeline = words.iter().any(|word| word.value == Some("pipeline"));
    let mut flaws = Vec::new();
    let mut warn = |text: String| {
        flaws.push(Flaw {
            level: Level::Warning,
            text,
        });
    };
    if !words.iter().any(|word| matches!(word.key, "proj" | "init")) {
        warn(
            "`geoReference` names no projection; a PROJ string needs one, such as `+proj=utm +zone=32` or \
             `+proj=tmerc +lat_0=48 +lon_0=11`"
                .to_owned(),
        );
    }
    for word in &words {
        // The steps of a pipeline have their own parameters.
        if (!is_pipeline || word.key == "proj")
            && let Some(text) = flaw(word)
        {
            warn(text);
        }
    }
    if is_pipeline {
        return flaws;
    }
    if let Some(name) = projection.filter(|name| names(NO_PROJECTIONS).any(|one| one == *name)) {
        warn(format!(
            "`+proj={name}` is not a projection onto a plane, but x and y of the map are metres on a plane; use \
             a projection such as `+proj=utm` or `+proj=tmerc`"
        ));
    }
    if projection == Some("utm") {
        warn_of_zone(value("zone"), value("lon_0"), &mut warn);
        warn_of_fixed(&words, value("zone"), &mut warn);
    }
    let latitude = |key| value(key).and_then(degrees).unwrap_or(0.0);
    if let Some(cone) = projection.filter(|name| CONES.contains(name))
        && latitude("lat_1") + latitude("lat_2") == 0.0
    {
        warn(format!(
            "`+proj={cone}` needs the latitudes of its cone, `+lat_1` and usually `+lat_2`; they must not cancel \
             each other"
        ));
    }
    twice(&words, &mut warn);
    flaws
}

/// Returns the string without blanks around `=`, as PROJ allows. Missing values stay missing.
fn joined(text: &str) -> String {
    let mut all = String::with_capacity(text.len());
    for (index, part) in text.split('=').map(str::trim).enumerate() {
        if index > 0 {
            all.push('=');
            let next = part.strip_prefix('+').and_then(|part| part.chars().next());
            if next.is_some_and(char::is_alphabetic) {
                all.push(' ');
            }
        }
        all.push_str(part);
    }
    all
}

fn word(text: &str) -> Word<'_> {
    let text = text.trim_start_matches('+');
    let text = &text[..text.floor_char_boundary(LONGEST_WORD)];
    match text.split_once('=') {
        Some((key, value)) => Word {
            key,
            value: Some(value.trim_matches('"')),
        },
        None => Word {
            key: text,
            value: None,
        },
    }
}

fn flaw(word: &Word<'_>) -> Option<String> {
    let key = word.key;
    let Some(value) = word.value.filter(|value| !value.is_empty()) else {
        return without_value(word);
    };
    if let Some((_, most)) = ANGLES.iter().find(|(name, _)| *name == key) {
        let what = match key {
            _ if key.starts_with("lat") => "latitude",
            _ if key.starts_with("lon") => "longitude",
            _ => "angle",
        };
        return match degrees(value) {
            Some(angle) if angle.abs() <= *most => None,
            Some(_) => Some(format!(
                "`+{key}={value}` is not a valid {what}; it must be between -{most}° and {most}°"
            )),
            None => Some(format!(
                "`+{key}={value}` is not a valid {what}; it must be a number of degrees, with a point as decimal \
                 separator"
            )),
        };
    }
    if let Some((_, positive)) = NUMBERS.iter().find(|(name, _)| *name == key) {
        return match number(value) {
            Some(number) if !positive || number > 0.0 => scale(key, value, number),
            Some(_) => Some(format!("`+{key}={value}` must be greater than zero")),
            None => Some(format!(
                "`+{key}={value}` is not a number; PROJ reads digits with a point as decimal separator"
            )),
        };
    }
    if let Some((_, what, list)) = CHOICES.iter().find(|(name, ..)| *name == key) {
        return unknown(key, value, what, list);
    }
    if key == "init" {
        let flaw = code(value).filter(|flaw| flaw.level == Level::Warning)?;
        return Some(flaw.text);
    }
    if key == "pm" && degrees(value).is_none() {
        return unknown(key, value, "prime meridian", MERIDIANS);
    }
    misspelt(key)
}

/// Reports scales far from 1 and units other than metres, the unit of map coordinates.
fn scale(key: &str, value: &str, number: f64) -> Option<String> {
    match key {
        "k" | "k_0" if !(0.5..=2.0).contains(&number) => Some(format!(
            "`+{key}={value}` scales all lengths by this factor, which must be 1 or slightly less, such as \
             0.9996"
        )),
        "to_meter" if (number - 1.0).abs() > 1e-9 => Some(format!(
            "`+{key}={value}` uses units of {value} m, but x and y of the map are metres"
        )),
        _ => None,
    }
}

fn unknown(key: &str, value: &str, what: &str, list: &'static str) -> Option<String> {
    if names(list).any(|name| name == value) {
        return (key == "units" && value != "m").then(|| {
            format!(
                "`+units={value}` uses `{value}`, but x and y of the map are metres, `+units=m`"
            )
        });
    }
    let meant = match closest(value, names(list)) {
        Some(meant) => format!("; did you mean `{meant}`?"),
        None if names(list).count() < 15 => {
            format!(
                "; the valid names are `{}`",
                names(list).collect::<Vec<_>>().join("`, `")
            )
        }
        None => String::new(),
    };
    Some(format!(
        "`+{key}={value}`: PROJ has no {what} of this name{meant}"
    ))
}

/// Reports a missing value or `=`: `+lat_0`, `+lat_0=` and `+lat_048`.
fn without_value(word: &Word<'_>) -> Option<String> {
    let key = word.key;
    let run_together = |name: &&str| {
        let rest = key.strip_prefix(*name);
        word.value.is_none() && rest.is_some_and(|rest| !rest.is_empty() && number(rest).is_some())
    };
    if let Some(name) = keys().find(|name| *name == key) {
        return Some(format!("`+{name}` has no value; write `+{name}=…`"));
    }
    // This finds words such as `lat_048`. Words that begin with `k` or `a` are ambiguous.
    let name = keys().filter(|name| name.len() > 2).find(run_together)?;
    let rest = key.strip_prefix(name)?;
    Some(format!("`+{key}` lacks the `=`; write `+{name}={rest}`"))
}

/// Reports misspelt names such as `+lat0` and `+Lon_0`, which PROJ ignores silently.
fn misspelt(key: &str) -> Option<String> {
    let plain = |name: &str| name.replace(['_', '-'], "").to_ascii_lowercase();
    let meant = keys().find(|name| name.len() > 1 && plain(name) == plain(key) && *name != key)?;
    Some(format!(
        "PROJ has no parameter `+{key}` and ignores it; did you mean `+{meant}`?"
    ))
}

fn warn_of_zone(zone: Option<&str>, longitude: Option<&str>, warn: &mut impl FnMut(String)) {
    match zone {
        Some("") => {}
        Some(zone)
            if zone
                .parse::<u8>()
                .is_ok_and(|zone| (1..=60).contains(&zone)) => {}
        Some(zone) => warn(format!(
            "`+zone={zone}` is not a UTM zone; the zones are 1 to 60, and `+south` selects the south"
        )),
        None if longitude.is_none() => {
            warn("`+proj=utm` has no `+zone`; it must have a zone from 1 to 60".to_owned());
        }
        None => {}
    }
}

/// Warns of parameters that UTM itself fixes and that have other values. PROJ ignores them.
fn warn_of_fixed(words: &[Word<'_>], zone: Option<&str>, warn: &mut impl FnMut(String)) {
    let is_south = words.iter().any(|word| word.key == "south");
    let zone = zone.and_then(|zone| zone.parse::<u8>().ok());
    let meridian = zone.map(|zone| f64::from(zone) * 6.0 - 183.0);
    let false_northing = if is_south { 10_000_000.0 } else { 0.0 };
    let mut ignored = Vec::new();
    let mut is_southern = false;
    for word in words {
        let angle = || word.value.and_then(degrees);
        let length = || word.value.and_then(number);
        let (given, fixed) = match word.key {
            "lat_0" => (angle(), Some(0.0)),
            "lon_0" => (angle(), meridian),
            "x_0" => (length(), Some(500_000.0)),
            "y_0" => (length(), Some(false_northing)),
            "k" | "k_0" => (length(), Some(0.9996)),
            _ => continue,
        };
        if let Some((given, fixed)) = given.zip(fixed).filter(|(one, other)| one != other) {
            is_southern |= word.key == "lat_0" && given < 0.0 && !is_south;
            ignored.push(format!("`+{}={given}` (fixed: {fixed})", word.key));
        }
    }
    if !ignored.is_empty() {
        let south = if is_southern {
            "; for a place in the south, add `+south`"
        } else {
            ""
        };
        warn(format!(
            "`+proj=utm` has its own origin and scale, so PROJ ignores {} and the map may lie elsewhere; remove what is \
             ignored, use `offset` in the header, or use `+proj=tmerc`{south}",
            ignored.join(", ")
        ));
    }
}

/// Warns of a parameter with two different values. PROJ takes the first one.
fn twice(words: &[Word<'_>], warn: &mut impl FnMut(String)) {
    for (index, word) in words.iter().enumerate() {
        let mut before = words.iter().take(index);
        // Two projections have a separate finding.
        if let Some(value) = word.value
            && word.key != "proj"
            && keys().any(|key| key == word.key)
            && let Some(first) = before.find(|first| first.key == word.key)
            && first.value.is_some_and(|first| first != value)
        {
            warn(format!(
                "`+{}` is given twice, as `{}` and as `{value}`; PROJ takes the first",
                word.key,
                first.value.unwrap_or_default()
            ));
        }
    }
}
