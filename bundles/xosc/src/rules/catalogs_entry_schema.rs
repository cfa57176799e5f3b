use crate::families::catalogs;
use crate::prelude::*;
use foldhash::{HashMap, HashSet};
use qcbus_schema_rule::{Breach, Weight, breaches};

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
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
    let mut older: HashSet<&str> = HashSet::default();
    for (entry, reference, count) in uses {
        // The schema checker itself checks entries of the document.
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
        let of = |weight| within.iter().copied().filter(move |it| it.weight == weight);
        let (mut unreadable, mut superfluous) = (of(Weight::Unreadable), of(Weight::Superfluous));
        let first = unreadable.next().or_else(|| superfluous.next());
        if let Some(first) = first {
            let more = unreadable.count() + superfluous.count();
            say(reference, first, (more, count), found);
        } else if let Some(first) = of(Weight::Later).next()
            && older.insert(document.path())
        {
            // The version in the header is one fault, however many parts need a newer version.
            say(reference, first, (0, 1), found);
        }
    }
}

/// Reports the fault of the entry that a reference leads to, with the numbers of further faults and
/// references.
fn say(
    reference: Element<'_, '_>,
    first: &Breach<'_>,
    (more, count): (usize, u32),
    found: &mut Sink<'_>,
) {
    let more = match more {
        0 => String::new(),
        1 => "; the entry has one more fault".to_owned(),
        more => format!("; the entry has {more} more faults"),
    };
    let what = match first.weight {
        Weight::Unreadable => "does not match its schema and cannot be read",
        Weight::Superfluous => "does not match its schema, which many simulators ignore",
        Weight::Later => "needs a newer version than its file declares",
    };
    let level = match first.weight {
        Weight::Unreadable => Level::Error,
        Weight::Superfluous | Weight::Later => Level::Information,
    };
    let text = format!(
        "the catalog entry `{}` {what}: {}{more}{}",
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
