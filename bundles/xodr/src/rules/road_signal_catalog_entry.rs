use crate::families::countries;
use crate::families::object_parts::{Stands, below, named, owner};
use crate::families::signal_catalog::{is_listed_there, is_outside};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let signs = below(map, "sign", "staticBoard");
    for node in below(map, "signal", "signals").chain(signs) {
        let country = node.attr("country").map_or("", str::trim);
        if countries::is_unassigned(country) {
            let text = countries::unassigned_text(country);
            say(map, node, "country", text, found);
        }
        for name in ["type", "subtype"] {
            let value = node.attr(name).map_or("", str::trim);
            if let Some(whole) = written_as_float(value) {
                let text = format!(
                    "`{name}` of {} is `{value}`; types are texts, so readers compare it with `{whole}` and find no \
                     such signal; write `{whole}`",
                    named(node)
                );
                say(map, node, name, text, found);
            }
        }
        let kind = node.attr("type").map_or("", str::trim);
        if is_listed_there(node) && is_outside(kind) {
            let text = format!(
                "the catalog of OpenDRIVE has no type `{kind}`; the own types of the catalog begin at `1000001`, \
                 and signs have the number of the sign, such as `274`"
            );
            say(map, node, "type", text, found);
        }
    }
}

fn say<'a>(map: &RoadMap<'a>, node: Node<'a>, name: &str, text: String, found: &mut Sink<'_>) {
    found
        .issue(Place::attribute_or_node(node, name), text)
        .stands(map, owner(node));
}

/// Returns the whole number that a text gives with a decimal point or an exponent. `274.1` is the
/// number of a sign, and `1e6` may be a name.
fn written_as_float(text: &str) -> Option<i64> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (text, None),
    };
    let (_, places) = mantissa.split_once('.')?;
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|it| it.is_ascii_digit());
    let no_sign = |text: &'_ str| text.trim_start_matches(['+', '-']).to_owned();
    let is_number = is_digits(places)
        && is_digits(&no_sign(mantissa).replacen('.', "", 1))
        && exponent.is_none_or(|exponent| is_digits(&no_sign(exponent)));
    // `1.0` may be a name. Programs write longer numbers.
    let is_long = exponent.is_some() || places.len() > 1 || text.len() > 3;
    let value = text.parse::<f64>().ok().filter(|_| is_number && is_long)?;
    (value.fract() == 0.0 && value.abs() < 1e15).then_some(value as i64)
}
