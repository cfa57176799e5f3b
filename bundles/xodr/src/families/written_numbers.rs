//! Numbers in attributes as written. Some of them cannot be used in computations.

/// Attributes that are numbers, with the quantity that they measure. Attributes that are whole
/// numbers in every version, and attributes with words, are not included.
const MEASURES: &[(Measure, &[&str])] = &[
    (
        Measure::Extent,
        &[
            "a",
            "aU",
            "aV",
            "back",
            "displayHeight",
            "displayWidth",
            "distance",
            "ds",
            "dz",
            "elementS",
            "forward",
            "gridSpacing",
            "height",
            "heightEnd",
            "heightStart",
            "inner",
            "left",
            "length",
            "lengthEnd",
            "lengthStart",
            "lineLength",
            "outer",
            "overlapZone",
            "radius",
            "radiusEnd",
            "radiusStart",
            "right",
            "s",
            "sEnd",
            "sOffset",
            "sStart",
            "space",
            "spaceLength",
            "startOffset",
            "stopOffset",
            "t",
            "tEnd",
            "tOffset",
            "tStart",
            "transitionLength",
            "u",
            "v",
            "validLength",
            "width",
            "widthEnd",
            "widthStart",
            "x",
            "xOffset",
            "y",
            "yOffset",
            "z",
            "zOffset",
            "zOffsetEnd",
            "zOffsetStart",
        ],
    ),
    (
        Measure::Turn,
        &[
            "curvEnd",
            "curvStart",
            "curvature",
            "hOffset",
            "hdg",
            "pitch",
            "roll",
        ],
    ),
    (
        Measure::Coefficient,
        &["b", "bU", "bV", "c", "cU", "cV", "d", "dU", "dV"],
    ),
    (Measure::Speed, &["max"]),
    (
        Measure::Other,
        &[
            "contactPoint",
            "daylight",
            "friction",
            "lighting",
            "roughness",
            "value",
            "xyAbsolute",
            "xyRelative",
            "zAbsolute",
            "zRelative",
            "zScale",
        ],
    ),
];

/// Quantity that a number measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measure {
    /// A position or a size, limited to the dimensions of the Earth.
    Extent,
    /// An angle or a curvature.
    Turn,
    /// A coefficient of higher degree, possibly large if its polynomial applies for millimetres.
    Coefficient,
    /// A speed. Separate words exist for "without limit".
    Speed,
    /// A quantity without a limit of size.
    Other,
}

impl Measure {
    /// Checks whether an attribute with this name is a number on any element.
    pub(crate) fn is_of_some(attribute: &str) -> bool {
        let mut measures = MEASURES.iter();
        measures.any(|(_, names)| names.contains(&attribute))
    }

    /// Returns the quantity of an attribute, or `None` if it is not a number to check here.
    pub(crate) fn of(element: &str, attribute: &str) -> Option<Measure> {
        // Numbers of the header are checked together with its other attributes.
        let is_other =
            element == "header" || (attribute == "value" && matches!(element, "userData" | "rule"));
        let mut measures = MEASURES.iter().filter(|_| !is_other);
        measures
            .find(|(_, names)| names.contains(&attribute))
            .map(|(measure, _)| *measure)
    }
}

/// Meaning of a text that is written as a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Written {
    /// Not a number.
    Nan,
    /// Infinite, written as a word.
    Infinite,
    /// Digits whose value does not fit into a double.
    Overflow,
    /// A finite number.
    Finite(f64),
}

impl Written {
    /// Reads a number in any spelling that parsers of XML Schema, C and Python know.
    pub(crate) fn read(text: &str) -> Option<Written> {
        let text = text.trim();
        if let Ok(value) = text.parse::<f64>() {
            let is_word = !text.bytes().any(|byte| byte.is_ascii_digit());
            return Some(match value {
                _ if value.is_nan() => Written::Nan,
                _ if value.is_finite() => Written::Finite(value),
                _ if is_word => Written::Infinite,
                _ => Written::Overflow,
            });
        }
        let lower = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        if lower.starts_with("1.#inf") {
            return Some(Written::Infinite);
        }
        let is_nan = ["nan(", "1.#ind", "1.#qnan", "1.#snan", "1.#nan"]
            .iter()
            .any(|start| lower.starts_with(start));
        is_nan.then_some(Written::Nan)
    }
}

/// Checks whether a text may be an infinite, invalid or large number. The check runs for every
/// attribute of a map, so it reads only a few bytes. It never misses such a number.
pub(crate) fn is_suspicious(mut bytes: &[u8]) -> bool {
    while let [b' ' | b'\t' | b'\n' | b'\r' | b'+' | b'-', rest @ ..] = bytes {
        bytes = rest;
    }
    match bytes {
        [b'n' | b'N', b'a' | b'A', ..] | [b'i' | b'I', b'n' | b'N', ..] => true,
        [b'1', b'.', b'#', ..] => true,
        [b'0'..=b'9' | b'.', ..] => is_large(bytes),
        _ => false,
    }
}

/// Checks whether an unsigned number may be ten millions or more. It uses the digits before the
/// point and the power of ten, without parsing the number.
fn is_large(bytes: &[u8]) -> bool {
    const DIGITS: usize = 8;
    // A power of ten is within the last bytes. Most positive ones are `e+00`, as in C.
    let tail = bytes.get(bytes.len().saturating_sub(DIGITS)..);
    let has_power = |tail: &[u8]| {
        let mut ends = tail.iter();
        ends.any(|byte| matches!(byte, b'e' | b'E' | b' ' | b'\t' | b'\n' | b'\r'))
    };
    if bytes.len() < DIGITS && !has_power(bytes) {
        return false;
    }
    let powerless = bytes.ends_with(b"e+00") || !tail.is_some_and(has_power);
    let digits = bytes.iter().take(DIGITS);
    let before = digits.take_while(|byte| byte.is_ascii_digit()).count();
    let power = if powerless { 0 } else { power_of_ten(bytes) };
    before + power >= DIGITS
}

/// Returns the positive power of ten at the end of a number. Most end in `e+00`, `e-03` or none.
fn power_of_ten(bytes: &[u8]) -> usize {
    const MOST: usize = 6;
    let white = |byte: &u8| byte.is_ascii_whitespace();
    let digits = bytes.iter().rev().skip_while(|byte| white(byte));
    // Longer runs of digits are decimals, which most numbers have.
    let end = digits.clone().take(MOST + 1);
    let count = end.take_while(|byte| byte.is_ascii_digit()).count();
    if count > MOST {
        return 0;
    }
    let power = digits.clone().take(count).enumerate();
    let mut before = digits.skip(count);
    let is_power = match before.next() {
        Some(b'e' | b'E') => true,
        Some(b'+') => matches!(before.next(), Some(b'e' | b'E')),
        _ => false,
    };
    if !is_power {
        return 0;
    }
    power.fold(0, |sum, (place, digit)| {
        let scale = 10_usize.saturating_pow(u32::try_from(place).unwrap_or(u32::MAX));
        sum + scale * usize::from(digit - b'0')
    })
}

/// Returns a number as written, truncated if it is long.
pub(crate) fn shown(text: &str) -> String {
    const MOST: usize = 24;
    let text = text.trim();
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}

/// Formats with this number of decimals, or with a power of ten if that would be unreadable.
pub(crate) fn brief(value: f64, decimals: usize) -> String {
    if value.abs() < 1e7 {
        format!("{value:.decimals$}")
    } else {
        format!("{value:.1e}")
    }
}
