use crate::families::references::{hint, quoted};
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};
use qcbus_openscenario::StoryElement;
use qcbus_openscenario::StoryKind;

pub const RULE: Rule<Scene> = Rule {
    uids: &[
        "asam.net:xosc:1.2.0:reference_control.resolvable_storyboard_element_reference",
        "asam.net:xosc:1.0.0:reference_control.resolvable_storyboard_element_ref",
        "qcbus.dev:xosc:1.0.0:naming.storyboard_ambiguous",
    ],
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario {
        return;
    }
    let mut known = Known::new();
    for condition in scenario.elements_everywhere("StoryboardElementStateCondition") {
        let Some(name) = condition.text("storyboardElementRef") else {
            continue;
        };
        look_up(scenario, condition, &name, &mut known, found);
    }
}

/// Ancestors of the elements that a name and a kind may mean.
type Known = HashMap<(String, StoryKind), Around>;

fn look_up<'d>(
    scenario: &Scenario<'d>,
    condition: Element<'_, 'd>,
    name: &str,
    known: &mut Known,
    found: &mut Sink<'_>,
) {
    let storyboard = scenario.storyboard();
    let matches = storyboard.find(name);
    if matches.is_empty() {
        // A name that contains `::` is a fault of the name itself.
        let named_so = name.contains("::") && storyboard.names().any(|other| other == name);
        if storyboard.is_complete() && !named_so {
            nowhere(scenario, condition, name, found);
        }
        return;
    }
    let word = condition.word("storyboardElementType");
    let Some(kind) = word.and_then(|word| StoryKind::of_word(&word)) else {
        return;
    };
    let of_kind: Vec<&StoryElement<'_>> = matches
        .iter()
        .copied()
        .filter(|one| one.kind() == kind)
        .collect();
    match (of_kind.first(), of_kind.get(1)) {
        (None, _) if storyboard.is_complete() => {
            let is = matches.first().map_or("", |one| one.kind().word());
            let text = format!(
                "{} is of type `{is}`, but `storyboardElementType` is `{}`",
                quoted(condition, "storyboardElementRef", name),
                kind.word()
            );
            let finding = found.about(condition, "storyboardElementType", text);
            if let Some(one) = matches.first() {
                finding.at(one.element(scenario).node(), "the element with this name");
            }
        }
        (Some(first), Some(second)) => {
            let text = format!(
                "{} may refer to any of {} elements of type `{}`, but must refer to exactly one{}",
                quoted(condition, "storyboardElementRef", name),
                of_kind.len(),
                kind.word(),
                paths(scenario, first, second)
            );
            let around = known
                .entry((name.to_owned(), kind))
                .or_insert_with(|| around(scenario, &of_kind));
            let level = match nearest(condition, around) {
                // A maneuver of a catalog that is used twice has no other way to name its own
                // elements.
                1 if condition.reference().is_some() => Level::Information,
                1 => Level::Warning,
                _ => Level::Error,
            };
            found
                .about(condition, "storyboardElementRef", text)
                .level(level)
                .at(first.element(scenario).node(), "the first of them")
                .at(second.element(scenario).node(), "the second of them");
        }
        _ => {}
    }
}

/// Suggests paths that distinguish two elements of one name, if their names and those of their
/// ancestors do so.
fn paths(scenario: &Scenario<'_>, first: &StoryElement<'_>, second: &StoryElement<'_>) -> String {
    let paths = path(scenario, first).zip(path(scenario, second));
    paths.map_or_else(String::new, |(first, second)| {
        format!("; put the names of the enclosing elements in front: `{first}` or `{second}`")
    })
}

/// Returns the shortest path that leads to this element only.
fn path(scenario: &Scenario<'_>, one: &StoryElement<'_>) -> Option<String> {
    let storyboard = scenario.storyboard();
    let mut path = one.name()?.to_owned();
    let mut around = one.parent();
    while let Some(outer) = around.and_then(|at| storyboard.elements().get(at)) {
        path = format!("{}::{path}", outer.name()?);
        let found = storyboard.find(&path);
        if found
            .iter()
            .filter(|other| other.kind() == one.kind())
            .count()
            == 1
        {
            return Some(path);
        }
        around = outer.parent();
    }
    None
}

fn nowhere<'d>(
    scenario: &Scenario<'d>,
    condition: Element<'_, 'd>,
    name: &str,
    found: &mut Sink<'_>,
) {
    let storyboard = scenario.storyboard();
    let reference = quoted(condition, "storyboardElementRef", name);
    let leaf = name.rsplit("::").next().unwrap_or(name);
    if leaf != name && !storyboard.find(leaf).is_empty() {
        let text = format!(
            "{reference} refers to no element; `{leaf}` exists, but the names in front of it must be those of \
             the directly enclosing elements, without gaps"
        );
        found.about(condition, "storyboardElementRef", text);
        return;
    }
    let text = format!(
        "{reference} refers to no story, act, maneuver group, maneuver, event or action{}",
        hint(leaf, storyboard.names())
    );
    found.about(condition, "storyboardElementRef", text);
}

/// Position of an element: its offset, and the offset of the reference to its catalog.
type Spot = (u64, Option<u64>);

/// Number of elements of one name and kind within each ancestor.
type Around = HashMap<Spot, usize>;

fn spot(element: Element<'_, '_>) -> Spot {
    let reference = element.reference().map(|node| node.offset().into());
    (element.node().offset().into(), reference)
}

fn around<'d>(scenario: &Scenario<'d>, elements: &[&StoryElement<'d>]) -> Around {
    let mut around = Around::new();
    for one in elements {
        let element = one.element(scenario);
        for outer in std::iter::once(element).chain(element.ancestors()) {
            *around.entry(spot(outer)).or_insert(0) += 1;
        }
    }
    around
}

/// Returns the number of elements that are nearest to the condition. These are in its innermost
/// ancestor that contains any. Simulators that search there first find the element if it is the
/// only one.
fn nearest(condition: Element<'_, '_>, around: &Around) -> usize {
    condition
        .ancestors()
        .find_map(|outer| around.get(&spot(outer)).copied())
        .unwrap_or(0)
}
