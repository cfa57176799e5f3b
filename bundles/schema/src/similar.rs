//! Suggestions for misspelt names.

/// Maximum length of compared names. A longer name is unlikely to be a typing error.
const LONGEST: usize = 64;

/// Other spellings of units. Letters alone would suggest another unit.
const SPELLINGS: [(&str, &str); 5] = [
    ("kph", "km/h"),
    ("kmh", "km/h"),
    ("kmph", "km/h"),
    ("mps", "m/s"),
    ("miles", "mile"),
];

/// Returns the candidate closest to `name`, if `name` is probably a typing error. Allowed are a
/// different case, or one change in every three characters and at most three changes (insertions,
/// deletions, replacements, swaps).
pub fn closest<'c>(name: &str, candidates: impl Iterator<Item = &'c str>) -> Option<&'c str> {
    let unit = SPELLINGS
        .iter()
        .find(|(other, _)| other.eq_ignore_ascii_case(name));
    if let Some((_, unit)) = unit {
        let mut candidates = candidates;
        return candidates.find(|candidate| candidate == unit);
    }
    let allowed = (name.chars().count() / 3).clamp(1, 3);
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates.filter(|candidate| !candidate.is_empty()) {
        if candidate.eq_ignore_ascii_case(name) {
            return Some(candidate);
        }
        if candidate.len().abs_diff(name.len()) > allowed
            || candidate.len().max(name.len()) > LONGEST
        {
            continue;
        }
        let distance = strsim::osa_distance(name, candidate);
        if distance <= allowed && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.filter(|(distance, candidate)| *distance < candidate.len())
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::closest;

    #[test]
    fn misspelled_names_are_recognised() {
        let names = ["laneSection", "laneOffset", "planView", "link", "type"];
        let meant = |name| closest(name, names.iter().copied());
        assert_eq!(meant("lanSection"), Some("laneSection"));
        assert_eq!(meant("LaneSection"), Some("laneSection"));
        assert_eq!(meant("lnik"), Some("link"));
        assert_eq!(meant("planViews"), Some("planView"));
        assert_eq!(meant("geometry"), None);
        assert_eq!(meant("x"), None);
        let units = ["mph", "km/h", "m/s"];
        let meant = |name| closest(name, units.iter().copied());
        assert_eq!(meant("kph"), Some("km/h"));
        assert_eq!(meant("mps"), Some("m/s"));
        assert_eq!(meant("mhp"), Some("mph"));
    }
}
