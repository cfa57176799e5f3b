use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    scenario.on_map(|map| look(scenario, map, found));
}

fn look(scenario: &Scenario<'_>, map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let reference = map.header().and_then(|header| header.child("geoReference"));
    let is_defined = reference.is_some_and(|reference| {
        !reference.text().trim().is_empty() || reference.children().next().is_some()
    });
    if is_defined {
        return;
    }
    let mut positions = scenario.elements_everywhere("GeoPosition");
    // The map has one fault, however many positions depend on it.
    let Some(first) = positions.next() else {
        return;
    };
    let others = match positions.count() {
        0 => String::new(),
        1 => " and so is one more".to_owned(),
        count => format!(" and so are {count} more"),
    };
    let text = format!(
        "a position is given by latitude and longitude{others}, but the road network has {}; without the map \
         projection its place in the map is undefined",
        match reference {
            Some(_) => "an empty `geoReference`",
            None => "no `geoReference`",
        }
    );
    let finding = found.about(first, "", text);
    let header = || Some((map.header()?, "the header of the map"));
    let root = || Some((map.root()?, "the map, which has no header"));
    let empty = reference.map(|it| (it, "the empty `geoReference` of the map"));
    match empty.or_else(header).or_else(root) {
        Some((place, label)) => finding.at(place, label),
        None => finding,
    };
}
