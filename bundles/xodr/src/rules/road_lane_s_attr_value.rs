use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        let node = section.node();
        let text = match (section.s(), node.attr("s")) {
            (Some(s), _) if s < 0.0 => format!(
                "the lane section starts at s = {s}; `s` must not be negative, because roads start at s = 0"
            ),
            (Some(_), _) => continue,
            (None, Some(text)) => {
                format!("`s` of the lane section is `{text}`; it must be a finite number [m]")
            }
            (None, None) => {
                "the lane section has no `s`; it must define where the section starts".to_owned()
            }
        };
        found.issue(Place::attribute_or_node(node, "s"), text);
    }
}
