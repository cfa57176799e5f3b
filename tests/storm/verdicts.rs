//! Conditions that every observation of a storm must meet.

use std::collections::BTreeMap;
use std::time::Duration;

use qcbus_messages::Verdict;

use super::history::{Seen, Told, What};
use super::ledger::{Ledger, Offered};
use crate::support::content::{Content, STRICT};

/// Name of the custom bundle. It is always required, whatever happens to it.
pub const JUDGE: &str = "judges_strictly";

/// Grace period for a writer thread that started before the custom bundle was required again.
const WRITES: Duration = Duration::from_secs(2);

/// Periods in which the custom bundle is not required.
#[derive(Debug, Default)]
pub struct Removals(Vec<(Duration, Duration)>);

impl Removals {
    /// Collects the periods. Each lasts from the removal of the manifest until a broker was seen to
    /// require the bundle again.
    pub fn new(manifests: &[(Duration, Duration)], history: &[Seen]) -> Removals {
        let demanded = |back: Duration| {
            let after = |seen: &&Seen| seen.from >= back && matches!(seen.what, What::Demanded);
            let seen = history.iter().find(after);
            seen.map_or(Duration::MAX, |seen| seen.at + WRITES)
        };
        let times = manifests
            .iter()
            .map(|(gone, back)| (*gone, demanded(*back)));
        Removals(times.collect())
    }

    fn excuse(&self, seen: &Seen) -> bool {
        let times = &mut self.0.iter();
        times.any(|(from, to)| *from <= seen.at && seen.from <= *to)
    }
}

/// Returns the observations that violate a condition.
pub fn complaints(history: &[Seen], ledger: &Ledger, removals: &Removals) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut epochs: BTreeMap<&str, u64> = BTreeMap::new();
    for seen in history {
        if let What::Told(told) = &seen.what
            && let Some(epoch) = told.epoch
            && let Some(before) = epochs.insert(&told.name, epoch)
            && before > epoch
        {
            let name = &told.name;
            complaints.push(format!("{name}: of epoch {epoch}, after one of {before}"));
        }
        let judge = Judge {
            ledger,
            seen,
            strict: !removals.excuse(seen),
        };
        let wrong = match &seen.what {
            What::Told(told) => judge.wrong_verdict(told),
            What::Published { name, digest } => judge.wrong_acceptance(name, digest),
            What::Answer {
                name,
                verdict,
                digest,
            } => judge.wrong_answer(name, *verdict, digest),
            What::TornReport(what) => Some(what.as_str()),
            What::Demanded | What::Killed { .. } | What::Worked { .. } => None,
        };
        let at = seen.at.as_secs_f64();
        complaints.extend(wrong.map(|wrong| format!("{at:9.3} {wrong}: {:?}", seen.what)));
    }
    complaints
}

/// Judges one observation.
struct Judge<'a> {
    ledger: &'a Ledger,
    seen: &'a Seen,
    /// Whether the custom bundle was required.
    strict: bool,
}

impl Judge<'_> {
    /// Checks whether no required bundle would find a fault in a file because it refers to this
    /// part.
    fn leaves_whole(&self, part: &Content) -> bool {
        let checker = part.spoils();
        checker.is_none_or(|it| it == STRICT && !self.strict)
    }

    /// Checks whether no required bundle would find a fault in this content itself.
    fn passes(&self, content: &Content) -> bool {
        let checker = content.checker();
        checker.is_none_or(|it| it == STRICT && !self.strict)
    }

    /// Returns the error in accepting these bytes of a file, or `None`.
    fn wrong_acceptance(&self, name: &str, digest: &str) -> Option<&'static str> {
        match self.ledger.content(digest) {
            None => Some("nobody has written these bytes, and they are accepted"),
            Some(content) if !self.passes(content) => Some("it is accepted"),
            Some(_) if !self.ledger.had_bytes(name, digest, self.seen.at) => {
                Some("accepted, and these bytes never lay there")
            }
            Some(_) => None,
        }
    }

    fn wrong_verdict(&self, told: &Told) -> Option<&'static str> {
        if told.verdict != Verdict::Accepted.as_str() {
            return None;
        }
        if let wrong @ Some(_) = self.wrong_acceptance(&told.name, &told.digest) {
            return wrong;
        }
        let took_part = |bundle: &str| {
            told.bundles.iter().any(|it| it == bundle) && told.failed.iter().all(|it| it != bundle)
        };
        if !took_part(Content::bundle(&told.name)) || (self.strict && !took_part(JUDGE)) {
            return Some("accepted without a bundle that had to judge");
        }
        let demanded = told.demanded.iter().flatten();
        if !demanded.clone().all(|it| took_part(it)) {
            return Some("accepted without a bundle that it says had to judge");
        }
        if self.strict && told.demanded.is_some() && !demanded.clone().any(|it| it == JUDGE) {
            return Some("a bundle that nobody removed was not demanded");
        }
        let content = self.ledger.content(&told.digest)?;
        let parts = content.parts();
        let wrong = parts.iter().find_map(|part| self.wrong_part(told, part));
        let under = content.rests_on();
        wrong.or_else(|| under.iter().find_map(|it| self.wrong_under(told, it)))
    }

    /// Returns the error in an acceptance that rests on this file, or `None`.
    fn wrong_under(&self, told: &Told, name: &str) -> Option<&'static str> {
        let below = format!("/{name}");
        let mut read = told.depends_on.iter();
        let (_, digest) = read.find(|(path, _)| path.ends_with(&below))?;
        // Half-written bytes are not in the ledger.
        let content = self.ledger.content(digest.as_ref()?)?;
        (!self.passes(content)).then_some("accepted, and a file that it rests on is rejected")
    }

    /// Returns the error in an acceptance that depends on this part, or `None`.
    fn wrong_part(&self, told: &Told, part: &str) -> Option<&'static str> {
        let below = format!("/{part}");
        let mut of_part = told
            .depends_on
            .iter()
            .filter(|(path, _)| path.ends_with(&below));
        let Some((_, Some(digest))) = of_part.next() else {
            return Some("accepted without something that it refers to");
        };
        match self.ledger.content(digest) {
            // Half-written bytes are not in the ledger.
            None => None,
            Some(content) if !self.leaves_whole(content) => {
                Some("accepted, and a part of it spoils it")
            }
            Some(_) if !self.ledger.had_bytes(part, digest, self.seen.at) => {
                Some("accepted, and these bytes of a part never lay there")
            }
            Some(content) => {
                let further = content.parts();
                further.iter().find_map(|part| self.wrong_part(told, part))
            }
        }
    }

    /// Returns the error in an answer, or `None`. The answer must match the content between the
    /// question and the answer.
    fn wrong_answer(&self, name: &str, verdict: Verdict, digest: &str) -> Option<&'static str> {
        let there = self.ledger.seen(name, self.seen.from, self.seen.at);
        if there
            .iter()
            .all(|it| matches!(it, Offered::Bytes(other) if *other != digest))
        {
            return Some("the answer is about bytes that did not lie there when it was asked for");
        }
        if verdict != Verdict::Accepted {
            return None;
        }
        if let wrong @ Some(_) = self.wrong_acceptance(name, digest) {
            return wrong;
        }
        let content = self.ledger.content(digest)?;
        let wrong = "accepted, and all the time a part of it spoilt it or was not there";
        if !content.parts().iter().all(|part| self.may_pass(part)) {
            return Some(wrong);
        }
        let sound = |name: &String| self.may_be_accepted(name);
        let wrong = "accepted, and all the time a file that it rests on was rejected";
        (!content.rests_on().iter().all(sound)).then_some(wrong)
    }

    /// Checks whether a file was without own faults at some moment.
    fn may_be_accepted(&self, name: &str) -> bool {
        let there = self.ledger.seen(name, self.seen.from, self.seen.at);
        there.into_iter().any(|it| match it {
            Offered::Bytes(digest) => {
                let content = self.ledger.content(digest);
                content.is_none_or(|content| self.passes(content))
            }
            Offered::Unfinished => true,
            Offered::Nothing => false,
        })
    }

    /// Checks whether a part, with everything that it depends on, was harmless at some moment.
    fn may_pass(&self, part: &str) -> bool {
        let there = self.ledger.seen(part, self.seen.from, self.seen.at);
        there.into_iter().any(|it| match it {
            Offered::Bytes(digest) => self.ledger.content(digest).is_none_or(|content| {
                self.leaves_whole(content) && content.parts().iter().all(|part| self.may_pass(part))
            }),
            Offered::Unfinished => true,
            Offered::Nothing => false,
        })
    }
}

/// Returns the standard bundles that the broker killed and the driver had not stopped: time, name,
/// reason.
pub fn innocent_dead<'h>(
    history: &'h [Seen],
    guilty: impl Fn(&str, Duration) -> bool + 'h,
) -> impl Iterator<Item = (Duration, &'h str, &'h str)> + 'h {
    history.iter().filter_map(move |seen| match &seen.what {
        What::Killed { name, why } if name.ends_with("Bundle") && !guilty(name, seen.at) => {
            Some((seen.at, name.as_str(), why.as_str()))
        }
        _ => None,
    })
}

/// Tests of the judge: errors that it must detect.
mod tests {
    use super::super::ledger::digest;
    use super::*;
    use crate::support::content::{CATALOG, Mark};

    /// A map, then its include with or without the word, and the verdict file given to the judge.
    struct Case {
        ledger: Ledger,
        told: Told,
        at: Duration,
    }

    fn accepted(part: &Content) -> Case {
        let mut ledger = Ledger::new();
        let map = Content::Including(1, "part.xml".to_owned());
        ledger.note("part.xml", Duration::ZERO, Some(part));
        ledger.note("a.xodr", Duration::ZERO, Some(&map));
        let told = Told {
            name: "a.xodr".to_owned(),
            verdict: "accepted".to_owned(),
            digest: digest(&map.bytes()),
            depends_on: vec![("/farm/part.xml".to_owned(), Some(digest(&part.bytes())))],
            bundles: vec!["xodrBundle".to_owned(), JUDGE.to_owned()],
            failed: Vec::new(),
            demanded: None,
            epoch: None,
        };
        let at = ledger.now();
        Case { ledger, told, at }
    }

    fn is_wrong(case: &Case) -> bool {
        let (from, at) = (Duration::ZERO, case.at);
        let what = What::Told(Box::new(case.told.clone()));
        let removals = Removals::default();
        !complaints(&[Seen { from, at, what }], &case.ledger, &removals).is_empty()
    }

    #[test]
    fn wrong_acceptance_is_detected() {
        let clean = accepted(&Content::Part(2, Mark::Clean));
        assert!(!is_wrong(&clean));
        assert!(is_wrong(&accepted(&Content::Part(2, Mark::Marked))));
        assert!(is_wrong(&accepted(&Content::Elsewhere(2))));
        let changes: [fn(&mut Told); 6] = [
            |told| told.bundles.truncate(1),
            |told| told.failed.push(JUDGE.to_owned()),
            |told| told.demanded = Some(vec![JUDGE.to_owned(), "absent".to_owned()]),
            |told| told.demanded = Some(vec!["xodrBundle".to_owned()]),
            |told| told.depends_on.clear(),
            |told| told.digest = digest(b"never written"),
        ];
        for (number, change) in changes.into_iter().enumerate() {
            let mut case = accepted(&Content::Part(2, Mark::Clean));
            change(&mut case.told);
            assert!(is_wrong(&case), "change {number} must be detected");
        }
    }

    /// Returns a case with a scenario on a map that includes a part, and a catalog.
    fn accepted_scenario(part: &Content, catalog: &Content) -> Case {
        let mut case = accepted(part);
        let scenario = Content::Scenario(3, "a.xodr".to_owned());
        case.ledger.note("s.xosc", Duration::ZERO, Some(&scenario));
        case.ledger.note(CATALOG, Duration::ZERO, Some(catalog));
        case.told.name = "s.xosc".to_owned();
        case.told.bundles = vec!["xoscBundle".to_owned(), JUDGE.to_owned()];
        let map = Content::Including(1, "part.xml".to_owned());
        let further = [
            ("/farm/a.xodr", &map),
            ("/farm/catalogs/vehicles.xosc", catalog),
        ];
        let further =
            further.map(|(path, content)| (path.to_owned(), Some(digest(&content.bytes()))));
        case.told.depends_on.extend(further);
        case.told.digest = digest(&scenario.bytes());
        case.at = case.ledger.now();
        case
    }

    #[test]
    fn faulty_part_or_catalog_makes_an_acceptance_wrong() {
        let (part, catalog) = (
            Content::Part(2, Mark::Clean),
            Content::Catalog(4, Mark::Clean),
        );
        assert!(!is_wrong(&accepted_scenario(&part, &catalog)));
        assert!(is_wrong(&accepted_scenario(
            &Content::Part(2, Mark::Marked),
            &catalog
        )));
        assert!(is_wrong(&accepted_scenario(
            &part,
            &Content::OtherCatalog(4)
        )));
        let marked = Content::Catalog(4, Mark::Marked);
        assert!(is_wrong(&accepted_scenario(&part, &marked)));
        let mut hidden = accepted_scenario(&part, &catalog);
        hidden
            .told
            .depends_on
            .retain(|(path, _)| !path.ends_with("part.xml"));
        assert!(is_wrong(&hidden));
    }

    #[test]
    fn removed_bundle_is_not_required_until_demanded_again() {
        let mut case = accepted(&Content::Part(2, Mark::Marked));
        case.told.bundles.truncate(1);
        let second = Duration::from_secs(1);
        let seen = |at: u32, what| Seen {
            from: second * at,
            at: second * at,
            what,
        };
        let complaints_at = |at: u32| {
            let told = What::Told(Box::new(case.told.clone()));
            let history = [seen(20, What::Demanded), seen(at, told)];
            let removals = Removals::new(&[(second * 10, second * 15)], &history);
            complaints(&history, &case.ledger, &removals).len()
        };
        let counts = [9, 10, 16, 20, 30].map(complaints_at);
        assert_eq!(counts, [1, 0, 0, 0, 1]);
    }

    #[test]
    fn answer_about_outdated_bytes_is_detected() {
        let mut ledger = Ledger::new();
        let (old, new) = (Content::Good(1), Content::Good(2));
        ledger.note("a.xodr", Duration::ZERO, Some(&old));
        let begun = ledger.now();
        ledger.note("a.xodr", begun, Some(&new));
        let from = ledger.now() + Duration::from_millis(1);
        let answer = |content: &Content| {
            let what = What::Answer {
                name: "a.xodr".to_owned(),
                verdict: Verdict::Accepted,
                digest: digest(&content.bytes()),
            };
            let seen = Seen {
                from,
                at: from,
                what,
            };
            complaints(&[seen], &ledger, &Removals::default()).len()
        };
        assert_eq!((answer(&old), answer(&new)), (1, 0));
    }
}
