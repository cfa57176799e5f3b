use crate::families::simulators::further;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let roads = map.roads().iter().map(|road| road.node());
    report("road", "4294967295", is_natural, roads, found);
    let junctions = || map.junctions().iter().map(|junction| junction.node());
    report("junction", "2147483647", is_integer, junctions(), found);
    let connections = junctions().flat_map(|junction| junction.children_named("connection"));
    report("connection", "4294967295", is_natural, connections, found);
}

fn is_natural(id: &str) -> bool {
    id.trim().parse::<u32>().is_ok()
}

/// Checks whether an id is an integer. Junctions may have the number that means "none".
fn is_integer(id: &str) -> bool {
    id.trim().parse::<i32>().is_ok()
}

/// Reports the first element whose id is not such a number, and the number of further ones.
fn report<'d>(
    name: &str,
    most: &str,
    is_number: fn(&str) -> bool,
    elements: impl Iterator<Item = Node<'d>>,
    found: &mut Sink<'_>,
) {
    let mut others = elements.filter_map(|element| {
        let id = element.attr("id")?;
        (!is_number(id)).then_some((element, id))
    });
    let Some((first, id)) = others.next() else {
        return;
    };
    let text = format!(
        "the id of the {name} is `{id}`, but CARLA reads ids of {name}s as integers up to {most}; any other id \
         becomes another number, usually 0{}",
        further(others.count())
    );
    found.issue(Place::attribute_or_node(first, "id"), text);
}
