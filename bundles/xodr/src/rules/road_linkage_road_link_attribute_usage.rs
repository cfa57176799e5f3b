use std::cell::OnceCell;

use crate::families::virtual_links;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    // Only few maps need this set.
    let named = OnceCell::new();
    let is_virtual = |road: &Road<'_>| {
        let named = named.get_or_init(|| virtual_links::connecting_roads(map));
        virtual_links::may_be_within(map, road) || named.contains(road.id())
    };
    for road in map.part(part).roads() {
        for end in ContactPoint::BOTH {
            let Some(link) = road.link(end) else { continue };
            let missing = missing(road, link, is_virtual);
            if missing.is_empty() || virtual_links::leads_to_main_road(map, road, link) {
                continue;
            }
            let text = format!(
                "the {} of road `{}` has no {}; a link to a road must have `elementType`, `elementId` and \
                 `contactPoint`",
                end.link_name(),
                road.id(),
                missing.join(" and no ")
            );
            found.issue(link.node(), text);
        }
    }
}

/// Returns the missing attributes of a link to a road. Without a type it may lead to a junction.
fn missing(
    road: &Road<'_>,
    link: RoadLink<'_>,
    is_virtual: impl Fn(&Road<'_>) -> bool,
) -> Vec<&'static str> {
    let has = |name: &str| link.node().attribute(name).is_some();
    let is_within = has("elementS") || has("elementDir");
    let wanted: &[(&str, &'static str)] = match link.element_type() {
        // The contact is inside the main road.
        Some("road") if is_within && is_virtual(road) => &[("elementId", "`elementId`")],
        Some("road") => &[
            ("elementId", "`elementId`"),
            ("contactPoint", "`contactPoint`"),
        ],
        None => &[("elementType", "`elementType`")],
        Some(_) => &[],
    };
    let lacking = wanted.iter().filter(|(name, _)| !has(name));
    lacking.map(|(_, quoted)| *quoted).collect()
}
