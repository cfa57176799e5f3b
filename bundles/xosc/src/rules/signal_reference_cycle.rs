use crate::families::signals::Controllers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let controllers = Controllers::of(scenario);
    let next: Vec<Option<usize>> = controllers
        .all
        .iter()
        .map(|one| controllers.find(&one.text("reference")?))
        .collect();
    // Every controller has at most one reference. Each walk therefore ends where an earlier one
    // passed.
    let mut walked_by: Vec<Option<usize>> = vec![None; next.len()];
    for start in 0..next.len() {
        let mut at = start;
        while let Some(mark) = walked_by.get_mut(at).filter(|mark| mark.is_none()) {
            *mark = Some(start);
            match next.get(at).copied().flatten() {
                Some(to) => at = to,
                None => break,
            }
        }
        let is_back = walked_by.get(at).copied().flatten() == Some(start);
        let leads_on = next.get(at).copied().flatten();
        if is_back && leads_on.is_some() {
            report(&controllers, &next, at, found);
        }
    }
}

/// Reports the cycle that a controller is part of.
fn report(
    controllers: &Controllers<'_, '_>,
    next: &[Option<usize>],
    first: usize,
    found: &mut Sink<'_>,
) {
    const MAX_PLACES: usize = 10;
    let along = |at: &usize| next.get(*at).copied().flatten();
    let mut cycle = vec![first];
    cycle.extend(std::iter::successors(along(&first), along).take_while(|at| *at != first));
    // The report begins with the first controller of the cycle in the file.
    let least = cycle.iter().enumerate().min_by_key(|(_, at)| **at);
    let turn = least.map_or(0, |(turn, _)| turn);
    cycle.rotate_left(turn);
    let elements: Vec<_> = cycle
        .iter()
        .filter_map(|at| controllers.all.get(*at))
        .collect();
    let Some((first, rest)) = elements.split_first() else {
        return;
    };
    let name = first.text("name").unwrap_or_default();
    let text = if rest.is_empty() {
        format!("the controller `{name}` refers to itself, so its phases never start")
    } else {
        format!(
            "the references of {} controllers lead from `{name}` back to it, so none of them starts first",
            elements.len()
        )
    };
    let mut finding = found.issue(Place::attribute_or_node(first.node(), "reference"), text);
    for one in rest.iter().take(MAX_PLACES) {
        let place = Place::attribute_or_node(one.node(), "reference");
        finding = finding.at(place, "the next reference");
    }
}
