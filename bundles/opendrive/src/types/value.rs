//! Attribute values of the model: present, well-formed, finite and within limits, or `None`.

use std::fmt;

use qcbus_document::Node;

/// Checks whether an element lies within a `<userData>`. Elements in there have no defined meaning,
/// regardless of their names (7.2).
pub fn is_user_data(node: Node<'_>) -> bool {
    node.ancestors().any(|above| above.is("userData"))
}

/// Returns the text without the white space around it, as XML defines white space.
#[inline]
fn trim(text: &str) -> &str {
    let is_space = |byte: Option<&u8>| matches!(byte, Some(b' ' | b'\t' | b'\r' | b'\n'));
    let bytes = text.as_bytes();
    // White space is rare here, and searching for it costs as much as reading a short number.
    if !is_space(bytes.first()) && !is_space(bytes.last()) {
        return text;
    }
    text.trim_matches([' ', '\t', '\r', '\n'])
}

/// Largest accepted absolute value. Squares and cubes of larger numbers overflow. Results from them
/// have rounding errors larger than the Earth.
const LARGEST: f64 = 1e30;

/// Parses a finite number within the limit, or returns `None`.
pub(crate) fn parse_number(text: &str) -> Option<f64> {
    // More than half of the coefficients of real maps are zero. They have the usual spellings or
    // the one of `%.16e` in C.
    if matches!(text, "0" | "0.0" | "0.0000000000000000e+00") {
        return Some(0.0);
    }
    let value: f64 = trim(text).parse().ok()?;
    (value.abs() <= LARGEST).then_some(value)
}

/// Parses an integer of at most 64 bits, or returns `None`.
pub(crate) fn parse_integer(text: &str) -> Option<i64> {
    trim(text).parse().ok()
}

/// Parses a boolean in all spellings of OpenDRIVE: `true`/`false`, `1`/`0`, `yes`/`no`.
pub(crate) fn parse_flag(text: &str) -> Option<bool> {
    match trim(text) {
        "true" | "1" | "yes" => Some(true),
        "false" | "0" | "no" => Some(false),
        _ => None,
    }
}

/// Reads an attribute as it is written.
pub(crate) fn text<'a>(node: Node<'a>, name: &str) -> Option<&'a str> {
    node.attr(name)
}

/// Reads a finite number.
pub(crate) fn number(node: Node<'_>, name: &str) -> Option<f64> {
    parse_number(node.attr(name)?)
}

/// Reads an integer.
pub(crate) fn integer(node: Node<'_>, name: &str) -> Option<i64> {
    parse_integer(node.attr(name)?)
}

/// Reads a boolean.
pub(crate) fn flag(node: Node<'_>, name: &str) -> Option<bool> {
    parse_flag(node.attr(name)?)
}

/// Reads the end of a road that a link touches.
pub(crate) fn contact(node: Node<'_>, name: &str) -> Option<ContactPoint> {
    ContactPoint::parse(node.attr(name)?)
}

/// Reads the lane layer of an element, or [`LayerKind::Permanent`] if the attribute is missing.
pub(crate) fn layer(node: Node<'_>, name: &str) -> LayerKind {
    LayerKind::of_text(node.attr(name))
}

/// Reads several numbers in one pass over the attributes. Absent and malformed ones are NaN.
pub(crate) fn numbers<const N: usize>(node: Node<'_>, names: [&str; N]) -> [f64; N] {
    let mut found = [f64::NAN; N];
    // Most files list attributes in the order of the standard, so the next name is tried first.
    let mut next = 0;
    for attribute in node.attributes() {
        let is = |slot: &usize| names.get(*slot).is_some_and(|name| attribute.is(name));
        let slot = Some(next).filter(is).or_else(|| (0..N).find(is));
        if let Some(slot) = slot {
            found[slot] = parse_number(attribute.value()).unwrap_or(f64::NAN);
            next = slot + 1;
        }
    }
    found
}

/// Returns the number, unless it stands for "absent".
pub(crate) fn known(value: f64) -> Option<f64> {
    (!value.is_nan()).then_some(value)
}

/// One of the two ends of a road (`e_contactPoint`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ContactPoint {
    /// The end at s = 0.
    Start,
    /// The end at s = `@length`.
    End,
}

impl ContactPoint {
    /// Both ends, in the direction of s.
    pub const BOTH: [ContactPoint; 2] = [ContactPoint::Start, ContactPoint::End];

    /// Parses `start` or `end`.
    pub fn parse(text: &str) -> Option<ContactPoint> {
        match text {
            "start" => Some(ContactPoint::Start),
            "end" => Some(ContactPoint::End),
            _ => None,
        }
    }

    /// Returns the word of the standard: `start` or `end`.
    pub fn as_str(self) -> &'static str {
        match self {
            ContactPoint::Start => "start",
            ContactPoint::End => "end",
        }
    }

    /// Returns the name of the link element for this end: `predecessor` or `successor`.
    pub fn link_name(self) -> &'static str {
        match self {
            ContactPoint::Start => "predecessor",
            ContactPoint::End => "successor",
        }
    }

    /// Returns the other end.
    pub fn other(self) -> ContactPoint {
        match self {
            ContactPoint::Start => ContactPoint::End,
            ContactPoint::End => ContactPoint::Start,
        }
    }
}

impl fmt::Display for ContactPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A side of the center lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Positive t, positive lane ids.
    Left,
    /// Negative t, negative lane ids.
    Right,
}

impl Side {
    /// Both sides.
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// Returns the sign of t on this side.
    pub fn sign(self) -> f64 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }

    /// Returns the side for a lane with this id, or `None` for the center lane.
    pub fn of_lane_id(id: i64) -> Option<Side> {
        match id {
            0 => None,
            1.. => Some(Side::Left),
            _ => Some(Side::Right),
        }
    }
}

/// The layer of lanes (OpenDRIVE 1.9, 11.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LayerKind {
    /// The lanes under normal conditions, also the meaning of a missing `@layer`.
    Permanent,
    /// Lanes laid over the permanent ones, for example in roadworks.
    Temporary,
    /// A word that the standard does not define.
    Unknown,
}

impl LayerKind {
    pub(crate) fn of_text(text: Option<&str>) -> LayerKind {
        match text {
            None | Some("permanent") => LayerKind::Permanent,
            Some("temporary") => LayerKind::Temporary,
            Some(_) => LayerKind::Unknown,
        }
    }

    /// Returns the word of the standard.
    pub fn as_str(self) -> &'static str {
        match self {
            LayerKind::Permanent => "permanent",
            LayerKind::Temporary => "temporary",
            LayerKind::Unknown => "unknown",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_numbers_are_parsed() {
        assert_eq!(parse_number(" 1.5e2\n"), Some(150.0));
        for text in [
            "", "INF", "inf", "NaN", "nan", "1e999", "1e31", "1,5", "infinity",
        ] {
            assert_eq!(parse_number(text), None, "{text}");
        }
        assert_eq!(parse_integer(" -7 "), Some(-7));
        assert_eq!(parse_integer("1.0"), None);
    }
}
