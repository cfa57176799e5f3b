use foldhash::{HashMap, HashMapExt as _};
use qcbus_openscenario::{Element, Member, Scenario, Version};
use qcbus_sdk::{Level, Place, Rule, Sink};

use crate::model::Scene;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_header_version_feature_mismatch",
    uids: &["qcbus.dev:xosc:1.0.0:header.version_feature_mismatch"],
    level: Level::Information,
    after: super::READABLE,
    page: include_str!("header_version_feature_mismatch.md"),
    run,
    ..Rule::DEFAULTS
};

/// Something that the version of the file does not have, where it is first, and how often it is there.
struct Novelty<'d> {
    place: Place<'d>,
    what: String,
    since: Version,
    more: usize,
}

/// What is found so far, by the type and what it does not have.
type Novelties<'d> = HashMap<(&'static str, Member<'d>), Option<Novelty<'d>>>;

/// The newest version whose schema is known: nothing is known to be newer.
const NEWEST: Version = (1, 3);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.version() >= NEWEST {
        return;
    }
    let mut novelties = Novelties::new();
    let root = scenario.root();
    for element in std::iter::once(root).chain(root.descendants()) {
        look(element, &mut novelties);
    }
    let (major, minor) = scenario.version();
    let mut novelties: Vec<Novelty<'_>> = novelties.into_values().flatten().collect();
    novelties.sort_by(|one, other| one.what.cmp(&other.what));
    for novelty in novelties {
        let text = format!(
            "{} came with version {}.{}, but the header says {major}.{minor}; let the header name the later \
             version, or do without{}",
            novelty.what,
            novelty.since.0,
            novelty.since.1,
            match novelty.more {
                0 => String::new(),
                1 => " (once more in this file)".to_owned(),
                more => format!(" ({more} times more in this file)"),
            }
        );
        found.issue(novelty.place, text);
    }
}

fn look<'d>(element: Element<'_, 'd>, novelties: &mut Novelties<'d>) {
    // What is within something unknown is not known to be new.
    let Some(parent) = element
        .class()
        .is_none()
        .then(|| element.parent())
        .flatten()
    else {
        attributes(element, novelties);
        return;
    };
    let member = Member::Child(element.node().name());
    note(parent, member, novelties, || {
        let what = format!("`{}` in `{}`", element.name(), parent.name());
        (Place::Node(element.node()), what)
    });
}

fn attributes<'d>(element: Element<'_, 'd>, novelties: &mut Novelties<'d>) {
    for attribute in element.node().attributes() {
        let name = attribute.name();
        let place = Place::Attribute(attribute);
        match element.value_type(name) {
            None => note(element, Member::Attribute(name), novelties, || {
                (place, format!("`{name}` of `{}`", element.name()))
            }),
            Some(value) => {
                let word = attribute.value().trim();
                let words = value.words().unwrap_or(&[]);
                if words.is_empty() || words.iter().any(|known| **known == *word) {
                    continue;
                }
                note(element, Member::Word(name, word), novelties, || {
                    let what = format!("`{word}` as `{name}` of `{}`", element.name());
                    (place, what)
                });
            }
        }
    }
}

fn note<'d>(
    owner: Element<'_, 'd>,
    member: Member<'d>,
    novelties: &mut Novelties<'d>,
    say: impl FnOnce() -> (Place<'d>, String),
) {
    let Some(class) = owner.class() else {
        return;
    };
    match novelties.get_mut(&(class, member)) {
        Some(Some(known)) => known.more += 1,
        Some(None) => {}
        None => {
            let novelty = owner.came_with(member).map(|since| {
                let (place, what) = say();
                Novelty {
                    place,
                    what,
                    since,
                    more: 0,
                }
            });
            novelties.insert((class, member), novelty);
        }
    }
}
