use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    backport: Backport::Alike { since: "" },
    params: &[LEAST, SHORT],
    each: Some(each),
    ..Rule::after(READABLE)
};

const LEAST: Param = Param::number("least", 0.0, "m", "a length up to this counts as zero");
const SHORT: Param = Param::number("short", 0.01, "m", "a length up to this is a warning");

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let least = found.number(&LEAST);
    let short = found.number(&SHORT);
    for section in map.part(part).sections() {
        // Each section gets one finding, although both sides may have the same fault.
        let mut sides = Side::BOTH.into_iter().filter(|side| section.covers(*side));
        let bad = sides.find_map(|side| {
            let length = section.length(side).filter(|length| *length <= short)?;
            Some((side, length))
        });
        if let Some((side, length)) = bad {
            report(section, side, (length, length <= least), found);
        }
    }
}

fn report(
    section: SectionRef<'_, '_>,
    side: Side,
    (length, is_empty): (f64, bool),
    found: &mut Sink<'_>,
) {
    let (Some(s), Some(end)) = (section.s(), section.end(side)) else {
        return;
    };
    // A temporary section may end before the next one starts.
    let next = section.next(side).filter(|next| next.s() == Some(end));
    let what = match next {
        Some(_) => "the next one starts",
        None if section.node().attribute("length").is_some() => "it ends",
        None => "the road ends",
    };
    let (level, allowed) = if is_empty {
        (Level::Error, "it must be longer than 0 m")
    } else {
        (
            Level::Warning,
            "a section this short may count as empty if lengths are rounded",
        )
    };
    let text = format!(
        "the lane section starts at s = {} and {what} at s = {}, so the section is {} m long; {allowed}",
        number(s),
        number(end),
        number(length)
    );
    let finding = found
        .issue(Place::attribute_or_node(section.node(), "s"), text)
        .level(level)
        .road(section.road.id(), s, 0.0)
        .fault(format!("short sections of road {}", section.road.index()));
    match next {
        Some(next) => finding.at(next.node(), "the next one"),
        None => {
            let own = section.node().attribute("length").map(|_| section.node());
            let node = own.unwrap_or(section.road.node());
            finding.at(
                Place::attribute_or_node(node, "length"),
                "the length that defines its end",
            )
        }
    };
}
