use crate::families::object_parts::{
    Stands, below, is_before, is_blank, named, number, stands_below,
};
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Roads> = Rule {
    uids: &[SPEED, UNIT],
    level: Level::Warning,
    params: &[HIGHEST],
    run,
    ..Rule::after(READABLE)
};

const SPEED: &str = "qcbus.dev:xodr:1.2.0:road.signal.speed_value";
const UNIT: &str = "qcbus.dev:xodr:1.5.0:road.signal.value_with_unit";
const HIGHEST: Param = Param::number("highest", 70.0, "m/s", "highest plausible speed limit");

/// Units of speed with their value in metres per second.
const UNITS: [(&str, f64); 3] = [("km/h", 1.0 / 3.6), ("mph", 0.44704), ("m/s", 1.0)];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let needs_unit = !is_before(found, (1, 5)) && found.version().is_some();
    let kinds = if needs_unit {
        HashSet::default()
    } else {
        kinds_with_unit(map)
    };
    let signals = map.root().map(|root| root.document().elements("signal"));
    let speaking = signals
        .into_iter()
        .flatten()
        .filter(|signal| speaks(*signal));
    for signal in speaking.filter(|signal| stands_below(*signal, "signals")) {
        if needs_unit {
            unit(map, signal, found);
        } else {
            unit_like_others(map, signal, &kinds, found);
        }
        value(map, signal, found);
        semantics(map, signal, found);
    }
}

/// Checks whether a signal is relevant for this rule. Only few signals are.
fn speaks(signal: Node<'_>) -> bool {
    given(signal).is_some() || is_limit(signal)
}

/// Returns the value of a signal. In most files -1 means "none".
fn given(signal: Node<'_>) -> Option<f64> {
    number(signal, "value").filter(|value| *value != -1.0)
}

/// Checks whether a signal is a speed limit whose value does not follow from something else.
fn is_limit(signal: Node<'_>) -> bool {
    let german = ["opendrive", "de", "deu", "germany"];
    let is_german = || {
        let country = signal.attr("country").unwrap_or_default();
        german.iter().any(|name| country.eq_ignore_ascii_case(name))
    };
    (signal.attr("type") == Some("274") && is_german()) || signal_speeds(signal).next().is_some()
}

fn signal_speeds(signal: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    signal
        .children_named("semantics")
        .flat_map(|semantics| semantics.children_named("speed"))
}

/// Returns a value with its unit as metres per second.
fn speed(node: Node<'_>) -> Option<f64> {
    let unit = node.attr("unit")?;
    let (_, factor) = UNITS.iter().find(|(name, _)| *name == unit)?;
    Some(given(node)? * factor)
}

fn unit<'a>(map: &RoadMap<'a>, signal: Node<'a>, found: &mut Sink<'_>) {
    // Zero means "no value" as well, even in the examples of the standard.
    let value = given(signal).filter(|value| *value != 0.0);
    let Some(value) = value.filter(|_| is_blank(signal, "unit")) else {
        return;
    };
    let text = format!(
        "{} has the value {value}, but no `unit`; a value must have a unit",
        named(signal)
    );
    let finding = found
        .issue(Place::attribute_or_node(signal, "unit"), text)
        .uid(UNIT)
        .fault("values without unit");
    let finding = finding.stands(map, signal);
    if is_limit(signal) {
        finding.level(Level::Error);
    }
}

/// The kind of a sign: country, type and subtype.
type SignKind<'a> = [&'a str; 3];

fn sign_kind(signal: Node<'_>) -> SignKind<'_> {
    ["country", "type", "subtype"].map(|name| signal.attr(name).unwrap_or_default())
}

/// Returns the kinds of signs with a value and a unit anywhere in the file.
fn kinds_with_unit<'a>(map: &RoadMap<'a>) -> HashSet<SignKind<'a>> {
    below(map, "signal", "signals")
        .filter(|signal| given(*signal).is_some() && !is_blank(*signal, "unit"))
        .map(sign_kind)
        .collect()
}

/// Reports a missing optional unit if other signs of the same kind in the file have one.
fn unit_like_others<'a>(
    map: &RoadMap<'a>,
    signal: Node<'a>,
    kinds: &HashSet<SignKind<'_>>,
    found: &mut Sink<'_>,
) {
    let value = given(signal).filter(|value| *value > 0.0);
    let is_odd = is_blank(signal, "unit") && kinds.contains(&sign_kind(signal));
    let Some(value) = value.filter(|_| is_odd) else {
        return;
    };
    let text = format!(
        "{} has the value {value}, but no `unit`; other signals of its kind in this file have one, and readers \
         guess a missing unit",
        named(signal)
    );
    found
        .issue(Place::attribute_or_node(signal, "unit"), text)
        .uid(UNIT)
        .fault("values without unit")
        .stands(map, signal);
}

fn value<'a>(map: &RoadMap<'a>, signal: Node<'a>, found: &mut Sink<'_>) {
    if given(signal).is_none()
        && signal
            .attr("value")
            .is_none_or(|text| matches!(text.trim(), "" | "-1"))
    {
        // Digits in the subtype give the speed. Names of models for one speed do the same.
        let subtype = signal.attr("subtype").unwrap_or_default();
        let named_there =
            subtype.bytes().any(|byte| byte.is_ascii_digit()) && subtype.trim() != "-1";
        if is_limit(signal) && !named_there && signal_speeds(signal).next().is_none() {
            let text = format!(
                "{} limits the speed, but neither `value` nor `subtype` defines the limit; it should have a \
                 `value` and a `unit`",
                named(signal)
            );
            found
                .issue(Place::attribute_or_node(signal, "value"), text)
                .stands(map, signal);
        }
        return;
    }
    plausible(map, signal, signal, found);
}

/// Reports a speed that no sign shows.
fn plausible<'a>(map: &RoadMap<'a>, signal: Node<'a>, node: Node<'a>, found: &mut Sink<'_>) {
    let Some(value) = given(node) else { return };
    let highest = found.number(&HIGHEST);
    // Without a unit, only values that are implausible in every unit are reported.
    let unit = node.attr("unit").unwrap_or_default();
    let guess = (unit.trim().is_empty() && is_limit(signal)).then_some(value / 3.6);
    let Some(speed) = speed(node).or(guess) else {
        return;
    };
    let shown = format!("{value} {unit}");
    let shown = shown.trim_end();
    let text = if speed < 0.0 || (speed == 0.0 && is_limit(signal) && guess.is_none()) {
        format!(
            "{} limits the speed to {shown}; a speed limit must be greater than 0",
            named(signal)
        )
    } else if speed > highest {
        format!(
            "{} limits the speed to {shown}, which is {speed:.0} m/s; at most {highest} m/s are plausible",
            named(signal)
        )
    } else if let Some(meant) = meant(value, unit) {
        format!(
            "{} limits the speed to {value:.3} {unit}, which would be {meant} if the value were in m/s; the \
             value or the unit is wrong",
            named(signal)
        )
    } else {
        return;
    };
    found
        .issue(Place::attribute_or_node(node, "value"), text)
        .stands(map, signal);
}

/// Returns the round speed in another unit if an odd value is that speed in metres per second.
fn meant(value: f64, unit: &str) -> Option<String> {
    let near = |value: f64, step: f64| (value / step - (value / step).round()).abs() * step < 1e-3;
    if matches!(unit, "m/s" | "") || near(value, 0.1) {
        return None;
    }
    let (kilometres, miles) = (value * 3.6, value / 0.44704);
    if near(kilometres, 5.0) {
        Some(format!("{kilometres:.0} km/h"))
    } else {
        near(miles, 5.0).then(|| format!("{miles:.0} mph"))
    }
}

/// Checks that the semantics agree with the signal.
fn semantics<'a>(map: &RoadMap<'a>, signal: Node<'a>, found: &mut Sink<'_>) {
    let before = found.count();
    for speeds in signal_speeds(signal) {
        plausible(map, signal, speeds, found);
    }
    // An implausible value gets only one finding.
    if found.count() > before {
        return;
    }
    let Some(shown) = speed(signal).filter(|speed| *speed > 0.0) else {
        return;
    };
    let differs =
        |node: &Node<'_>| speed(*node).is_some_and(|said| (said - shown).abs() > 0.02 * shown);
    if !signal_speeds(signal).all(|node| differs(&node)) {
        return;
    }
    let Some(node) = signal_speeds(signal).next() else {
        return;
    };
    let text = format!(
        "the semantics of {} define {} {}, but the signal itself shows {} {}; both should agree",
        named(signal),
        node.attr("value").unwrap_or_default(),
        node.attr("unit").unwrap_or_default(),
        given(signal).unwrap_or_default(),
        signal.attr("unit").unwrap_or_default()
    );
    found
        .issue(Place::attribute_or_node(node, "value"), text)
        .stands(map, signal)
        .at(
            Place::attribute_or_node(signal, "value"),
            "the value of the signal",
        );
}
