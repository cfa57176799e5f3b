use crate::families::object_parts::{Stands, below, is_blank, named, owner};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    each: Some(each),
    run,
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let signals: Vec<Node<'_>> = road.signals().map(|signal| signal.node()).collect();
        let lacking: Vec<Node<'_>> = signals
            .iter()
            .copied()
            .filter(|node| lacks(*node))
            .collect();
        if let (Some(list), true) = (road.signals_node(), lacking.len() > 1)
            && lacking.len() == signals.len()
        {
            let text = format!(
                "none of the {} signals of road `{}` has a `country`; each signal must define the country whose \
                 rules its type follows",
                signals.len(),
                road.id()
            );
            found
                .issue(list, text)
                .at(lacking[0], "the first of these signals");
            continue;
        }
        for node in lacking {
            report(map, node, found);
        }
    }
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for sign in below(map, "sign", "staticBoard").filter(|sign| lacks(*sign)) {
        report(map, sign, found);
    }
}

fn report<'a>(map: &RoadMap<'a>, node: Node<'a>, found: &mut Sink<'_>) {
    let text = format!(
        "{} of type `{}` has no `country`; it must define the country whose rules the type follows (`OpenDRIVE` \
         for the types of the standard's own catalog)",
        named(node),
        node.attr("type").unwrap_or_default()
    );
    found
        .issue(Place::attribute_or_node(node, "country"), text)
        .stands(map, owner(node));
}

/// Checks whether the country is missing. Without a type there is no reference to rules.
fn lacks(node: Node<'_>) -> bool {
    let has_type = !is_blank(node, "type") && !matches!(node.attr("type"), Some("-1" | "none"));
    has_type && is_blank(node, "country")
}
