//! What must be so of everything that was seen in a storm, at every moment.

use std::collections::BTreeMap;
use std::time::Duration;

use qcbus_messages::Verdict;

use super::history::{Seen, Told, What};
use super::ledger::Ledger;
use crate::support::content::Content;

/// The bundle of one's own that must judge everything, whatever happens to it.
pub const JUDGE: &str = "judges_strictly";

/// What was seen and may not be.
pub fn complaints(history: &[Seen], ledger: &Ledger) -> Vec<String> {
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
        let wrong = match &seen.what {
            What::Told(told) => wrong_verdict(told, seen, ledger),
            What::Published { name, digest } => wrong_acceptance(name, digest, ledger, seen.at),
            What::Answer {
                name,
                verdict,
                digest,
            } => wrong_answer(name, *verdict, digest, seen, ledger),
            What::Killed { .. } => None,
        };
        let at = seen.at.as_secs_f64();
        complaints.extend(wrong.map(|wrong| format!("{at:9.3} {wrong}: {:?}", seen.what)));
    }
    complaints
}

/// What is wrong with these bytes of a file being accepted at some time before `to`.
fn wrong_acceptance(
    name: &str,
    digest: &str,
    ledger: &Ledger,
    to: Duration,
) -> Option<&'static str> {
    match ledger.content(digest) {
        None => Some("nobody has written these bytes, and they are accepted"),
        Some(content) if content.verdict() != Verdict::Accepted => Some("it is accepted"),
        Some(_) if !ledger.has_held(name, digest, to) => {
            Some("accepted, and these bytes never lay there")
        }
        Some(_) => None,
    }
}

fn wrong_verdict(told: &Told, seen: &Seen, ledger: &Ledger) -> Option<&'static str> {
    if told.verdict != Verdict::Accepted.as_str() {
        return None;
    }
    if let wrong @ Some(_) = wrong_acceptance(&told.name, &told.digest, ledger, seen.at) {
        return wrong;
    }
    let took_part = |bundle: &str| {
        told.bundles.iter().any(|it| it == bundle) && told.failed.iter().all(|it| it != bundle)
    };
    if !took_part(Content::bundle(&told.name)) || !took_part(JUDGE) {
        return Some("accepted without a bundle that had to judge");
    }
    let demanded = told.demanded.iter().flatten();
    if !demanded.clone().all(|it| took_part(it)) {
        return Some("accepted without a bundle that it says had to judge");
    }
    if told.demanded.is_some() && !demanded.clone().any(|it| it == JUDGE) {
        return Some("a bundle that nobody removed was not demanded");
    }
    let content = ledger.content(&told.digest)?;
    let parts = content.parts();
    parts
        .iter()
        .find_map(|part| wrong_part(told, part, seen, ledger))
}

/// What is wrong with an acceptance that depends on this part.
fn wrong_part(told: &Told, part: &str, seen: &Seen, ledger: &Ledger) -> Option<&'static str> {
    let below = format!("/{part}");
    let mut of_part = told
        .depends_on
        .iter()
        .filter(|(path, _)| path.ends_with(&below));
    let Some((_, Some(digest))) = of_part.next() else {
        return Some("accepted without something that it refers to");
    };
    match ledger.content(digest) {
        // Half-written.
        None => None,
        Some(content) if !content.is_clean() => Some("accepted, and a part of it is marked"),
        Some(_) if !ledger.has_held(part, digest, seen.at) => {
            Some("accepted, and these bytes of a part never lay there")
        }
        Some(_) => None,
    }
}

/// An answer is about what lay there between the question and the answer.
fn wrong_answer(
    name: &str,
    verdict: Verdict,
    digest: &str,
    seen: &Seen,
    ledger: &Ledger,
) -> Option<&'static str> {
    let there = ledger.seen(name, seen.from, seen.at);
    if !there.contains(&Some(digest)) && !there.contains(&None) {
        return Some("the answer is about bytes that did not lie there when it was asked for");
    }
    if verdict != Verdict::Accepted {
        return None;
    }
    if let wrong @ Some(_) = wrong_acceptance(name, digest, ledger, seen.at) {
        return wrong;
    }
    let clean = |part: &String| {
        let mut there = ledger.seen(part, seen.from, seen.at).into_iter();
        there.any(|it| {
            it.and_then(|it| ledger.content(it))
                .is_none_or(Content::is_clean)
        })
    };
    let parts = ledger.content(digest)?.parts();
    (!parts.iter().all(clean)).then_some("accepted, and all the time a part of it was marked")
}

/// Standard bundles that the broker killed and the driver had not stopped: name, when, why.
pub fn innocent_dead<'h>(
    history: &'h [Seen],
    guilty: impl Fn(&str, Duration) -> bool + 'h,
) -> impl Iterator<Item = String> + 'h {
    history.iter().filter_map(move |seen| match &seen.what {
        What::Killed { name, why } if name.ends_with("Bundle") && !guilty(name, seen.at) => {
            Some(format!("{:9.3} {name}: {why}", seen.at.as_secs_f64()))
        }
        _ => None,
    })
}

/// The judge is judged: what it must not let pass.
mod tests {
    use super::super::ledger::digest;
    use super::*;
    use crate::support::content::Mark;

    /// A map was written, then what it includes got the word, and all that is told to the judge.
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
        !complaints(&[Seen { from, at, what }], &case.ledger).is_empty()
    }

    #[test]
    fn a_wrong_acceptance_is_seen() {
        let clean = accepted(&Content::Part(2, Mark::Clean));
        assert!(!is_wrong(&clean));
        assert!(is_wrong(&accepted(&Content::Part(2, Mark::Marked))));
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
            assert!(is_wrong(&case), "change {number} is let pass");
        }
    }

    #[test]
    fn an_answer_about_bytes_that_had_gone_is_seen() {
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
            complaints(&[seen], &ledger).len()
        };
        assert_eq!((answer(&old), answer(&new)), (1, 0));
    }
}
