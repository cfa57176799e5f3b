//! The catalog of signals that belongs to the standard: `country="OpenDRIVE"`.

use crate::prelude::*;

/// Types of traffic lights in the catalog.
const LIGHTS: [&str; 13] = [
    "1000001", "1000002", "1000007", "1000008", "1000009", "1000010", "1000011", "1000012",
    "1000013", "1000014", "1000015", "1000016", "1000020",
];

/// Range of numbers in which the catalog has its own types. Lower numbers are those of signs.
const OWN: std::ops::RangeInclusive<u32> = 1_000_001..=1_000_099;

/// Checks whether a signal names the catalog.
pub(crate) fn is_listed_there(node: Node<'_>) -> bool {
    node.attr("country")
        .is_some_and(|country| country.trim().eq_ignore_ascii_case("OpenDRIVE"))
}

/// Checks whether a signal is a traffic light of the catalog.
pub(crate) fn is_light(node: Node<'_>) -> bool {
    let kind = node.attr("type").map_or("", str::trim);
    is_listed_there(node) && LIGHTS.contains(&kind)
}

/// Checks whether the type is one of the catalog's own numbers, but not in use.
pub(crate) fn is_outside(kind: &str) -> bool {
    let is_own = kind.len() >= 7 && kind.bytes().all(|byte| byte.is_ascii_digit());
    is_own
        && kind
            .parse::<u32>()
            .is_ok_and(|number| !OWN.contains(&number))
}
