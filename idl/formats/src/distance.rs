//! "Did you mean" hints: the known word nearest to an unknown one.

/// Returns how many letters to insert, remove, replace or swap with their neighbour between two
/// words (optimal string alignment). Upper and lower case are equal.
pub fn distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(&a.to_lowercase(), &b.to_lowercase())
}

/// Only this many characters of a longer word are compared. A very long text is no typing error,
/// and the cost grows with the square of the length.
const LONGEST: usize = 128;

/// Returns the candidate nearest to `word`, if one is near enough: at most a third of its letters
/// (at least one) differ. The first of several equally near ones is returned.
pub fn closest<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    let word: String = word.chars().take(LONGEST).collect();
    let allowed = (word.chars().count() / 3).max(1);
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        if candidate.chars().count().abs_diff(word.chars().count()) > allowed {
            continue;
        }
        let found = distance(&word, candidate);
        if found <= allowed && best.is_none_or(|(least, _)| found < least) {
            best = Some((found, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Beginning of a hint of [`did_you_mean`].
pub const DID_YOU_MEAN: &str = "; did you mean ";

/// Lists some of the known names for a person to choose from:
/// `` `a`, `b` ``, with `…` when there are more. Returns `None` when there are none.
pub fn some_of<'n>(names: impl IntoIterator<Item = &'n str>) -> Option<String> {
    const MOST: usize = 5;
    let mut names = names.into_iter();
    let mut listed: Vec<String> = names
        .by_ref()
        .take(MOST)
        .map(|name| format!("`{name}`"))
        .collect();
    listed.extend(names.next().map(|_| "…".to_owned()));
    (!listed.is_empty()).then(|| listed.join(", "))
}

/// Returns ``; did you mean `x`?`` to append to a message, or an empty text without a match.
pub fn did_you_mean<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> String {
    match closest(word, candidates) {
        Some(candidate) => format!("{DID_YOU_MEAN}`{candidate}`?"),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_counts_edits_without_case() {
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("checkreId", "checkerId"), 1, "a swap is one edit");
        assert_eq!(distance("MINLEVEL", "minLevel"), 0, "case is ignored");
        assert_eq!(distance("straße", "strasse"), 2);
    }

    #[test]
    fn closest_name_is_offered_and_distant_one_is_not() {
        let names = ["CheckerBundle", "ReportModule", "Param"];
        assert_eq!(closest("CheckerBundel", names), Some("CheckerBundle"));
        assert_eq!(closest("param", names), Some("Param"));
        assert_eq!(closest("Road", names), None);
        assert_eq!(closest("", names), None);
        assert_eq!(did_you_mean("Parm", names), "; did you mean `Param`?");
        assert_eq!(did_you_mean("Widget", names), "");
        assert_eq!(closest(&"x".repeat(1_000_000), names), None);
    }
}
