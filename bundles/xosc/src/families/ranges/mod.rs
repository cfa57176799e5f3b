//! Numbers and the ranges that the standard gives them: tables by type, and one walk over each.
//!
//! The schema says `Double` and no more; the ranges are in the standard's class descriptions. A row
//! is left out where they are plainly wrong (a clothoid whose curvature falls, a road below sea level).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use qcbus_openscenario::{Element, Reading, Scenario};
use qcbus_sdk::{Finding, Level, Sink};

use crate::families::values;
use crate::model::About;

pub(crate) mod tables;

/// The rule that ranges hold for what parameters and expressions lead to: another name for them all.
pub(crate) const RESOLVED: &str = "qcbus.dev:xosc:1.0.0:parameters.range_after_resolution";

/// One end of a range.
#[derive(Clone, Copy)]
pub(crate) enum Bound {
    /// Up to and including this.
    At(f64),
    /// Up to this, but not this itself.
    Beyond(f64),
    /// There is none.
    Open,
}

use Bound::{At, Beyond, Open};

/// How bad it is that a value is out of range.
pub(crate) type Judge = fn(Element<'_, '_>, f64) -> Level;

/// An attribute of a type and its range.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// Names of the elements of the type; empty when there is one, named like the type.
    elements: &'static [&'static str],
    class: &'static str,
    attribute: &'static str,
    low: Bound,
    high: Bound,
    unit: &'static str,
    /// Another rule says what is not finite.
    finite: bool,
    /// The attribute is a count.
    counts: bool,
    judge: Judge,
    /// Why the value does no harm, where it does none.
    excuse: &'static str,
    uid: &'static str,
}

impl Row {
    /// The elements of the type have other names than the type.
    pub(crate) const fn called(self, elements: &'static [&'static str]) -> Row {
        Row { elements, ..self }
    }

    /// It depends on the value how bad it is; the text says why it is no worse where it is a warning.
    pub(crate) const fn judged(self, judge: Judge, excuse: &'static str) -> Row {
        Row {
            judge,
            excuse,
            ..self
        }
    }

    /// What is not finite is said by another rule.
    pub(crate) const fn if_finite(self) -> Row {
        Row {
            finite: true,
            ..self
        }
    }

    /// The value is a count.
    pub(crate) const fn count(self) -> Row {
        Row {
            counts: true,
            ..self
        }
    }

    /// The upper end itself is out of range.
    pub(crate) const fn half_open(self) -> Row {
        let high = match self.high {
            At(end) => Beyond(end),
            other => other,
        };
        Row { high, ..self }
    }

    /// Both ends themselves are out of range.
    pub(crate) const fn open(self) -> Row {
        let low = match self.low {
            At(end) => Beyond(end),
            other => other,
        };
        Row { low, ..self }.half_open()
    }

    fn contains(&self, value: f64) -> bool {
        let above = match self.low {
            At(end) => value >= end,
            Beyond(end) => value > end,
            Open => !value.is_nan(),
        };
        let below = match self.high {
            At(end) => value <= end,
            Beyond(end) => value < end,
            Open => !value.is_nan(),
        };
        above && below
    }

    /// The value of the attribute. Of a count only what is one: the schema reports the rest.
    fn value(&self, element: Element<'_, '_>) -> Option<f64> {
        if self.counts {
            let count = element.integer(self.attribute)?;
            u32::try_from(count).ok().map(f64::from)
        } else if self.finite {
            element.number(self.attribute)
        } else {
            element.double(self.attribute)
        }
    }

    fn names(&self) -> &[&'static str] {
        if self.elements.is_empty() {
            std::slice::from_ref(&self.class)
        } else {
            self.elements
        }
    }
}

/// A row without a lower or an upper end, to begin with.
const fn row(
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    Row {
        elements: &[],
        class,
        attribute,
        low: Open,
        high: Open,
        unit,
        finite: false,
        counts: false,
        judge: error,
        excuse: "",
        uid,
    }
}

/// `[0..inf[`
pub(crate) const fn from_zero(
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    at_least(0.0, class, attribute, unit, uid)
}

/// `]0..inf[`
pub(crate) const fn above_zero(
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    Row {
        low: Beyond(0.0),
        ..row(class, attribute, unit, uid)
    }
}

/// `[low..inf[`
pub(crate) const fn at_least(
    low: f64,
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    Row {
        low: At(low),
        ..row(class, attribute, unit, uid)
    }
}

/// `]-inf..high]`
pub(crate) const fn at_most(
    high: f64,
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    Row {
        high: At(high),
        ..row(class, attribute, unit, uid)
    }
}

/// `[low..high]`
pub(crate) const fn between(
    low: f64,
    high: f64,
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    Row {
        low: At(low),
        high: At(high),
        ..row(class, attribute, unit, uid)
    }
}

/// `]-inf..inf[`
pub(crate) const fn finite(
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    Row {
        low: Beyond(f64::NEG_INFINITY),
        high: Beyond(f64::INFINITY),
        ..row(class, attribute, unit, uid)
    }
}

/// What a rule about a table lists: its own UIDs, then those of the rows. `ALL` is how many they are.
pub(crate) const fn uids<const ALL: usize>(
    own: &[&'static str],
    rows: &[Row],
) -> [&'static str; ALL] {
    let mut all = [""; ALL];
    let mut index = 0;
    while index < ALL {
        all[index] = if index < own.len() {
            own[index]
        } else {
            rows[index - own.len()].uid
        };
        index += 1;
    }
    all
}

/// Out of range is an error.
pub(crate) fn error(_: Element<'_, '_>, _: f64) -> Level {
    Level::Error
}

/// Simulators cope, and files in use do it.
pub(crate) fn warning(_: Element<'_, '_>, _: f64) -> Level {
    Level::Warning
}

/// Zero is out of range and does no harm; what is below it does.
pub(crate) fn zero_is_harmless(_: Element<'_, '_>, value: f64) -> Level {
    if value == 0.0 {
        Level::Warning
    } else {
        Level::Error
    }
}

/// A direction a turn away is the same direction; what is farther away is another unit.
pub(crate) fn a_turn_is_harmless(_: Element<'_, '_>, value: f64) -> Level {
    // A little more than a turn: 6.2832 is meant to be one.
    if value.abs() <= TAU + 1e-3 {
        Level::Warning
    } else {
        Level::Error
    }
}

/// Says every value of a table that is out of its range, each under the UID of its row.
pub(crate) fn report(scenario: &Scenario<'_>, rows: &[Row], found: &mut Sink<'_>) {
    for (row, element, value) in out_of_range(scenario, rows) {
        say(row, element, value, found).uid(row.uid);
    }
}

/// Says every value of a table that is out of its range, under the first UID of the rule.
pub(crate) fn report_as_own(scenario: &Scenario<'_>, rows: &[Row], found: &mut Sink<'_>) {
    for (row, element, value) in out_of_range(scenario, rows) {
        say(row, element, value, found);
    }
}

fn out_of_range<'r, 'm, 'd>(
    scenario: &'m Scenario<'d>,
    rows: &'r [Row],
) -> impl Iterator<Item = (&'r Row, Element<'m, 'd>, f64)> {
    rows.iter().flat_map(move |row| {
        let elements = row
            .names()
            .iter()
            .flat_map(|name| scenario.elements_everywhere(name));
        elements.filter_map(move |element| {
            let concerned = element.has(row.attribute) && element.class() == Some(row.class);
            let value = concerned.then(|| row.value(element)).flatten()?;
            (!row.contains(value)).then_some((row, element, value))
        })
    })
}

fn say<'s, 'd>(
    row: &Row,
    element: Element<'_, '_>,
    value: f64,
    found: &'s mut Sink<'d>,
) -> Finding<'s, 'd> {
    let (text, level) = told(row, element, value);
    found.about(element, row.attribute, text).level(level)
}

/// The values of all tables that break a scenario because they are out of range, with what is to be
/// said of each.
pub(crate) fn broken<'m, 'd>(
    scenario: &'m Scenario<'d>,
) -> impl Iterator<Item = (Element<'m, 'd>, &'static str, String)> {
    let rows = tables::ALL.iter().copied();
    rows.flat_map(|rows| out_of_range(scenario, rows))
        .filter_map(|(row, element, value)| {
            let (text, level) = told(row, element, value);
            (level == Level::Error).then_some((element, row.attribute, text))
        })
}

/// What is said of a value that is out of range, and how bad it is.
fn told(row: &Row, element: Element<'_, '_>, value: f64) -> (String, Level) {
    let level = (row.judge)(element, value);
    let (must, excuse) = match level {
        Level::Error => ("must", ""),
        Level::Warning | Level::Information => ("should", row.excuse),
    };
    let mut text = format!(
        "`{}` of `{}` is {}, but {must} {}",
        row.attribute,
        element.name(),
        shown(element, row.attribute, value),
        wanted(row)
    );
    let remarks = [other_unit(row, value), excuse.to_owned()];
    for remark in remarks.iter().filter(|remark| !remark.is_empty()) {
        text.push_str("; ");
        text.push_str(remark);
    }
    (text, level)
}

/// A value in backticks, and what is written where a parameter or an expression led to it.
pub(crate) fn shown(element: Element<'_, '_>, attribute: &str, value: f64) -> String {
    let written = element.written(attribute).unwrap_or_default();
    match element.read(attribute) {
        Reading::Value(_) => format!("`{}` (`{}`)", rounded(value), values::short(written)),
        _ => format!("`{}`", values::short(written.trim())),
    }
}

/// A number without the noise that arithmetic leaves behind.
fn rounded(value: f64) -> f64 {
    const PARTS: f64 = 1e9;
    let rounded = (value * PARTS).round() / PARTS;
    if rounded == 0.0 || !rounded.is_finite() {
        value
    } else {
        rounded
    }
}

/// What a range demands, after "must".
fn wanted(row: &Row) -> String {
    let number = |end: f64| named(end, row.unit);
    match (row.low, row.high) {
        (At(low), Open) => format!("be at least {}", number(low)),
        (Beyond(low), Open) => format!("be greater than {}", number(low)),
        (Open, At(high)) => format!("be at most {}", number(high)),
        (Open, Beyond(high)) => format!("be less than {}", number(high)),
        (At(low), At(high)) => format!("lie between {} and {}", named(low, ""), number(high)),
        (At(low), Beyond(high)) => {
            format!(
                "be at least {} and less than {}",
                named(low, ""),
                number(high)
            )
        }
        (Beyond(low), Beyond(high)) if low.is_infinite() && high.is_infinite() => {
            "be finite".to_owned()
        }
        (Beyond(low), At(high) | Beyond(high)) => {
            format!(
                "lie between {} and {}, both excluded",
                named(low, ""),
                number(high)
            )
        }
        (Open, Open) => "be a number".to_owned(),
    }
}

/// A number with its unit; parts of a turn as people know them.
fn named(end: f64, unit: &str) -> String {
    let known = [(TAU, "2π"), (PI, "π"), (FRAC_PI_2, "π/2")];
    let word = known.iter().find(|(value, _)| *value == end.abs());
    let number = match word {
        Some((value, word)) => {
            let sign = if end < 0.0 { "-" } else { "" };
            format!("{sign}{word} ({sign}{value:.4})")
        }
        None => end.to_string(),
    };
    match unit {
        "" => number,
        "°" => format!("{number}°"),
        unit => format!("{number} {unit}"),
    }
}

/// What is out of range and would be in it in another unit was probably meant as such.
fn other_unit(row: &Row, value: f64) -> String {
    let (meant, unit, digits) = match row.unit {
        // What is within a turn may be one.
        "rad" if value.abs() > TAU + 1e-3 => (value.to_radians(), "°", 4),
        "K" => (value + 273.15, " °C", 2),
        "Pa" => (value * 100.0, " hPa", 0),
        _ => return String::new(),
    };
    if !row.contains(meant) {
        return String::new();
    }
    format!("{}{unit} are {meant:.digits$} {}", rounded(value), row.unit)
}

#[cfg(test)]
mod tests {
    use super::{PI, TAU, above_zero, at_most, between, from_zero};

    #[test]
    fn ranges_have_their_ends() {
        let closed = between(0.0, 1.0, "A", "a", "", "");
        let holds = |row: &super::Row, values: [f64; 5]| values.map(|value| row.contains(value));
        let values = [-0.1, 0.0, 0.5, 1.0, f64::NAN];
        assert_eq!(holds(&closed, values), [false, true, true, true, false]);
        assert_eq!(
            holds(&closed.half_open(), values),
            [false, true, true, false, false]
        );
        assert_eq!(
            holds(&closed.open(), values),
            [false, false, true, false, false]
        );
        let above = above_zero("A", "a", "", "");
        let values = [-1.0, 0.0, 1e-9, f64::INFINITY, f64::NAN];
        assert_eq!(holds(&above, values), [false, false, true, true, false]);
        let below = at_most(0.0, "A", "a", "", "");
        assert_eq!(holds(&below, values), [true, true, false, false, false]);
    }

    #[test]
    fn ranges_are_said_in_words() {
        let turn = between(0.0, TAU, "A", "a", "rad", "").half_open();
        assert_eq!(
            super::wanted(&turn),
            "be at least 0 and less than 2π (6.2832) rad"
        );
        let half = between(-PI, PI, "A", "a", "rad", "");
        assert_eq!(
            super::wanted(&half),
            "lie between -π (-3.1416) and π (3.1416) rad"
        );
        assert_eq!(super::other_unit(&half, 90.0), "90° are 1.5708 rad");
        assert_eq!(super::other_unit(&half, 900.0), "");
        assert_eq!(
            super::wanted(&from_zero("A", "a", "m/s", "")),
            "be at least 0 m/s"
        );
    }
}
