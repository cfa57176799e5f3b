use qcbus_formats::distance::did_you_mean;
use qcbus_sdk::modular::{Problem, Use, What};
use qcbus_sdk::{Rule, Sink};

use crate::assembly::{Assembly, Modular, place};
use crate::families::offers::{Offers, may_be_meant, path};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_key_matches",
    uids: &["qcbus.dev:mosc:1.0.0:key.matches"],
    page: include_str!("key_matches.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let uses = assembly.expansion.references.iter();
    let uses: Vec<&Use<'_>> = uses.flat_map(|reference| &reference.uses).collect();
    let mut last: Option<(&Use<'_>, Offers<'_>)> = None;
    for problem in assembly.problems(&[What::KeyUnmatched]) {
        let within = problem.at.node().parent();
        if last
            .as_ref()
            .is_none_or(|(one, _)| Some(one.node) != within)
        {
            let one = uses.iter().find(|one| Some(one.node) == within);
            last = one.map(|one| (*one, Offers::of(one)));
        }
        let hint = last.as_ref().map(|(_, offers)| hint(problem, offers));
        let text = format!("{}{}", problem.text, hint.unwrap_or_default());
        let finding = found.issue(place(problem.at), text);
        if let Some(group) = problem.target {
            finding.at(place(group), "the group that is referred to");
        }
    }
}

/// Most paths that a key is compared with, and most that are listed.
const MOST_COMPARED: usize = 64;
const MOST_LISTED: usize = 5;

/// What may have been meant by a key that fits nothing.
fn hint<'d>(problem: &Problem<'d>, offers: &Offers<'d>) -> String {
    let key = problem.at.node().attr("key").unwrap_or("");
    if let Some(taken) = offers.taken_loosely(key).next() {
        let count = key.split('.').count();
        return format!(
            "; the exact path is `{}`, for which the reference tool takes it, because it does not compare the elements \
             in the middle",
            path(taken, count)
        );
    }
    let parts = key.split('.').count();
    let name = key.rsplit('.').next().unwrap_or("");
    let paths = offers.all.iter();
    let paths = paths.filter(|offer| may_be_meant(name, offer.name()));
    let paths = paths.map(|&offer| path(offer, parts));
    let meant = did_you_mean(key, distinct(paths).iter().map(String::as_str));
    if !meant.is_empty() {
        return meant;
    }
    let is_of_group = problem
        .target
        .is_some_and(|group| group.node().attribute(key).is_some());
    if is_of_group {
        return "; attributes of the group itself are never replaced".to_owned();
    }
    let alike = offers.all.iter().filter(|offer| offer.is(name));
    let mut listed = distinct(alike.map(|&offer| path(offer, 2)));
    if listed.is_empty() {
        listed = distinct(offers.all.iter().map(|&offer| path(offer, 2)));
    }
    match listed.len() {
        0 => "; it offers none".to_owned(),
        1..=MOST_LISTED => format!("; it offers {}", quoted(&listed)),
        _ => format!("; it offers {}, …", quoted(&listed[..MOST_LISTED])),
    }
}

fn distinct(paths: impl Iterator<Item = String>) -> Vec<String> {
    let mut distinct: Vec<String> = Vec::new();
    for path in paths {
        if distinct.len() == MOST_COMPARED {
            break;
        }
        if !distinct.contains(&path) {
            distinct.push(path);
        }
    }
    distinct
}

fn quoted(paths: &[String]) -> String {
    let quoted: Vec<String> = paths.iter().map(|path| format!("`{path}`")).collect();
    quoted.join(", ")
}
