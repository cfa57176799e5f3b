use crate::assembly::{Assembly, Modular, place};
use crate::families::copies::{is_offered, short_name};
use crate::families::offers::{Offers, may_be_meant, named_by, offers_any, path, unoffered};
use crate::prelude::*;
use qcbus_formats::distance::did_you_mean;
use qcbus_sdk::modular::Problem;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let uses = assembly.expansion.references.iter();
    let uses: Vec<&Use<'_>> = uses.flat_map(|reference| &reference.uses).collect();
    let mut last: Option<(&Use<'_>, Offers<'_>)> = None;
    for (number, problem) in assembly.problems(&[What::KeyUnmatched]).enumerate() {
        let within = problem.at.node().parent();
        if last
            .as_ref()
            .is_none_or(|(one, _)| Some(one.node) != within)
        {
            let one = uses.iter().find(|one| Some(one.node) == within);
            last = one.map(|one| (*one, Offers::of(one)));
        }
        let hint = last
            .as_ref()
            .filter(|_| number < MOST_HINTED)
            .map(|(one, offers)| hint(problem, one, offers));
        let hint = hint.unwrap_or_default();
        let text = format!("{}{}", problem.text, hint.text);
        let mut finding = found.issue(place(problem.at), text);
        if let Some(group) = problem.target {
            finding = finding.at(place(group), "the group that is referred to");
        }
        for attribute in hint.attributes {
            finding = finding.at(attribute, "the attribute that is not offered");
        }
    }
}

/// Text and places that are added to the finding of a key.
#[derive(Default)]
struct Hint<'d> {
    text: String,
    /// The attributes in the hint that are not offered.
    attributes: Vec<Attribute<'d>>,
}

/// Maximum number of keys that get a hint, because each hint takes a walk through the group.
const MOST_HINTED: usize = 32;

/// Maximum number of shown attributes.
const MOST_SHOWN: usize = 5;

/// Maximum number of paths that a key is compared with, then of listed paths.
const MOST_COMPARED: usize = 64;
const MOST_LISTED: usize = 5;

fn hint<'d>(problem: &Problem<'d>, one: &Use<'d>, offers: &Offers<'d>) -> Hint<'d> {
    let key = problem.at.node().attr("key").unwrap_or("");
    let groups: Vec<Node<'d>> = one.copies.iter().map(|copy| copy.group).collect();
    let mut hint = Hint::default();
    if key.trim().is_empty() {
        return hint;
    }
    let of_group = groups.iter().find_map(|&group| named_by(key, group));
    let is_listed = of_group.is_some_and(|attribute| is_offered(attribute));
    if !is_listed && offers_any(&groups) {
        hint.attributes = unoffered(key, &groups).take(MOST_SHOWN).collect();
    }
    hint.text = match (hint.attributes.first(), of_group) {
        (Some(&first), _) => say_unoffered(first),
        (None, Some(_)) if is_listed => format!(
            "; attributes of the `ManeuverGroup` itself are never replaced, although it lists them in `{OFFERS}`"
        ),
        (None, Some(_)) => {
            "; attributes of the `ManeuverGroup` itself are never replaced".to_owned()
        }
        (None, None) => meant(key, offers),
    };
    hint
}

fn say_unoffered(attribute: Attribute<'_>) -> String {
    let (name, element) = (attribute.name(), attribute.node());
    let listed = element.attr(OFFERS).map(str::trim);
    let mut words = listed.into_iter().flat_map(|listed| {
        let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
        listed.split(move |c| !is_of_name(c))
    });
    let lists = match listed {
        // Another rule reports the fault in the list.
        Some(listed) if words.any(|word| word == name) => {
            return format!(
                "; `{}` lists `{name}` in `{OFFERS}`, but not as a single name between commas: `{listed}`",
                element.name()
            );
        }
        Some(listed) => format!("does not list it in `{OFFERS}`, only `{listed}`"),
        None => format!("does not list it in `{OFFERS}`"),
    };
    format!(
        "; `{}` has the attribute `{name}` but {lists}: add it there in `{}`, or remove the key",
        element.name(),
        short_name(element.document())
    )
}

/// Suggests what a key without a match may mean.
fn meant<'d>(key: &'d str, offers: &Offers<'d>) -> String {
    if let Some(taken) = offers.taken_loosely(key).next() {
        let count = key.split('.').count();
        return format!(
            "; the exact path is `{}`, and the reference tool accepts the key for it, because it does not \
             compare the elements in the middle",
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
    let alike = offers.all.iter().filter(|offer| offer.is(name));
    let mut listed = distinct(alike.map(|&offer| path(offer, 2)));
    if listed.is_empty() {
        listed = distinct(offers.all.iter().map(|&offer| path(offer, 2)));
    }
    match listed.len() {
        0 => "; it offers no attributes".to_owned(),
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
