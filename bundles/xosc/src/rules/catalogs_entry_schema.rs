use foldhash::HashMap;
use qcbus_document::Node;
use qcbus_openscenario::{Element, Resolution, Scenario};
use qcbus_schema_rule::{Breach, breaches};
use qcbus_sdk::{Level, Place, Rule, Sink};

use crate::families::catalogs;
use crate::model::{About, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_catalogs_entry_schema",
    uids: &["qcbus.dev:xosc:1.0.0:catalogs.entry_schema"],
    after: super::READABLE,
    page: include_str!("catalogs_entry_schema.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut entries: HashMap<Node<'_>, usize> = HashMap::default();
    let mut uses: Vec<(Node<'_>, Element<'_, '_>, u32)> = Vec::new();
    for (reference, to) in catalogs::references(scenario) {
        let (Resolution::Entry(entry) | Resolution::OtherLocation(entry)) = to else {
            continue;
        };
        let at = *entries.entry(entry.node).or_insert(uses.len());
        match uses.get_mut(at) {
            Some((_, _, count)) => *count += 1,
            None => uses.push((entry.node, reference, 1)),
        }
    }
    let subject = found.subject();
    let mut known: HashMap<&str, Vec<Breach<'_>>> = HashMap::default();
    for (entry, reference, count) in uses {
        // An entry of the document itself is the schema's own checker's.
        if entry.document().path() == subject.root().path() {
            continue;
        }
        let document = entry.document();
        let all = known
            .entry(document.path())
            .or_insert_with(|| breaches(subject, &document));
        let from = all.partition_point(|breach| breach.node.index() < entry.index());
        let within = all.get(from..).unwrap_or(&[]).iter();
        let within: Vec<_> = within
            .take_while(|breach| breach.node.index() < entry.subtree_end())
            .collect();
        let unreadable = within.iter().find(|breach| breach.unreadable);
        let Some(first) = unreadable.or(within.first()) else {
            continue;
        };
        let more = match within.len() {
            0 | 1 => String::new(),
            2 => "; there is one further fault in it".to_owned(),
            all => format!("; there are {} further faults in it", all - 1),
        };
        let (level, who) = if first.unreadable {
            (Level::Error, "so it cannot be read")
        } else {
            (Level::Information, "which many simulators pass over")
        };
        let text = format!(
            "the catalog's entry `{}` is not what its schema allows, {who}: {}{more}{}",
            reference.text("entryName").unwrap_or_default(),
            first.text,
            catalogs::further(count)
        );
        let place = match first.attribute {
            Some(attribute) => Place::from(attribute),
            None => Place::from(first.node),
        };
        found
            .about(reference, "entryName", text)
            .level(level)
            .at(place, "the place in the catalog");
    }
}
