use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for nurbs in scenario.elements_everywhere("Nurbs") {
        let order = nurbs
            .integer("order")
            .and_then(|order| u64::try_from(order).ok());
        // Orders below two are out of range.
        if let Some(order) = order.filter(|order| *order >= 2) {
            count(nurbs, order, found);
        }
    }
}

fn count(nurbs: Element<'_, '_>, order: u64, found: &mut Sink<'_>) {
    let points = nurbs.children_named("ControlPoint").count() as u64;
    let knots = nurbs.children_named("Knot").count() as u64;
    if points < order {
        let text = format!(
            "a NURBS of order {order} has {points} control points; it needs at least as many as its order"
        );
        found.about(nurbs, "order", text);
    } else if points.checked_add(order) != Some(knots) {
        let text = format!(
            "a NURBS of order {order} with {points} control points has {knots} knots; it needs {}, the sum \
             of the two",
            points.saturating_add(order)
        );
        found.about(nurbs, "", text);
    }
}
