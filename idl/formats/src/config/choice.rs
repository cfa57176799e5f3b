//! Selection of checkers for one run, in addition to any configuration.

use std::fmt;

use super::same_bundle;
use crate::Text;

/// Selection of checkers by name: the selected ones without the ignored ones. Empty: everything.
///
/// A name is a checker's id or a rule's UID, complete, its beginning or its last part. It may also
/// be a family (`ids` or `ids.` for every rule `ids.…`), or a bundle's name or alias.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Choice {
    /// Only checkers that match one of these names run; empty selects all.
    pub select: Vec<String>,
    /// Checkers that match one of these names do not run.
    pub ignore: Vec<String>,
}

/// The names of a checker.
#[derive(Debug, Clone, Copy)]
pub struct Names<'n> {
    /// Name of its bundle.
    pub bundle: &'n str,
    /// Short name of its bundle.
    pub alias: &'n str,
    /// Its id.
    pub id: &'n str,
    /// The UIDs of its rules.
    pub uids: &'n [Text],
}

impl Choice {
    /// Checks whether the selection leaves nothing out.
    pub fn is_everything(&self) -> bool {
        self.select.is_empty() && self.ignore.is_empty()
    }

    /// Checks whether a checker runs. One that is off by default must be selected by its full name.
    pub fn asks(&self, names: Names<'_>, default_on: bool) -> bool {
        let named = |patterns: &[String]| patterns.iter().any(|it| names.match_pattern(it));
        let in_full = || self.select.iter().any(|it| names.are(it));
        let selected = (self.select.is_empty() || named(&self.select)) && default_on;
        (selected || in_full()) && !named(&self.ignore)
    }
}

impl Names<'_> {
    /// Checks whether the pattern matches this checker.
    pub fn match_pattern(self, pattern: &str) -> bool {
        if pattern.is_empty() {
            return false;
        }
        let own = self.id.strip_prefix("check_").unwrap_or(self.id);
        let (maker, own) = own.split_once('_').unwrap_or(("", own));
        let own = own
            .strip_prefix(self.alias)
            .unwrap_or(own)
            .trim_start_matches('_');
        same_bundle(pattern, self.bundle, self.alias)
            || belongs_to(self.id, pattern)
            || (!maker.is_empty() && belongs_to(own, pattern))
            || self.uids.iter().any(|uid| {
                let rule = uid.rsplit(':').next().unwrap_or(uid);
                belongs_to(uid, pattern) || belongs_to(rule, pattern)
            })
    }

    /// Checks whether the pattern is the checker's whole id or one of its UIDs.
    fn are(self, pattern: &str) -> bool {
        self.id == pattern || self.uids.iter().any(|uid| **uid == *pattern)
    }
}

/// Checks whether a name equals the pattern, continues it with a new word, or ends with it.
fn belongs_to(name: &str, pattern: &str) -> bool {
    let (name, pattern) = (&name.to_ascii_lowercase(), pattern.to_ascii_lowercase());
    let pattern = pattern.as_str();
    const BETWEEN: [char; 3] = ['.', '_', ':'];
    let goes_on =
        |rest: &str| rest.is_empty() || rest.starts_with(BETWEEN) || pattern.ends_with(BETWEEN);
    name.strip_prefix(pattern).is_some_and(goes_on)
        || name
            .strip_suffix(pattern)
            .is_some_and(|before| before.ends_with(['.', ':']))
}

impl fmt::Display for Choice {
    /// Writes the selection as command line arguments: `--select ids --ignore road.lane`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut said = Vec::new();
        for (flag, names) in [("--select", &self.select), ("--ignore", &self.ignore)] {
            if !names.is_empty() {
                said.push(format!("{flag} {}", names.join(",")));
            }
        }
        f.write_str(&said.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: &str = "check_asam_xodr_road_lane_link_order";
    const UID: &str = "asam.net:xodr:1.4.0:road.lane.link_order";

    fn asks(select: &[&str], ignore: &[&str], default_on: bool) -> bool {
        let list = |names: &[&str]| names.iter().map(|&it| it.to_owned()).collect();
        let choice = Choice {
            select: list(select),
            ignore: list(ignore),
        };
        let names = Names {
            bundle: "xodrBundle",
            alias: "xodr",
            id: ID,
            uids: &[UID.into()],
        };
        choice.asks(names, default_on)
    }

    #[test]
    fn checker_is_selected_by_each_of_its_names() {
        for name in [
            ID,
            UID,
            "xodr",
            "xodrBundle",
            "road",
            "road.",
            "road.lane",
            "road.lane.link_order",
            "link_order",
            "check_asam_xodr_road",
            "road_lane_link",
            "ROAD.Lane",
            "road_lane_link_order",
            "asam.net:xodr:1.4.0",
        ] {
            assert!(asks(&[name], &[], true), "{name}");
            assert!(!asks(&[], &[name], true), "{name}");
        }
        for other in [
            "", "roa", "lane", "road.la", "xosc", "order.", "1.4.0", "k_order", "order",
        ] {
            assert!(!asks(&[other], &[], true), "{other}");
            assert!(asks(&[], &[other], true), "{other}");
        }
    }

    #[test]
    fn ignore_wins_and_default_off_checker_needs_full_name() {
        assert!(!asks(&["road"], &["road.lane"], true));
        assert!(!asks(&[], &[], false));
        assert!(!asks(&["road"], &[], false));
        assert!(asks(&[ID], &[], false));
        assert!(asks(&[UID], &[], false));
        assert!(!asks(&[UID], &["xodr"], false));
    }
}
