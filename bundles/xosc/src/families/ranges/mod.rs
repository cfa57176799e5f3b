//! Numbers and their ranges in the standard: tables by type, and one walk over each.
//!
//! The schema only says `Double`. The ranges are in the standard's class descriptions. Ranges that
//! are plainly wrong are left out (a clothoid with falling curvature, a road below sea level).

use qcbus_sdk::fault_of;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use qcbus_openscenario::{Element, Reading, Scenario};
use qcbus_sdk::{Finding, Level, Sink};

use crate::families::values;
use crate::model::About;

pub(crate) mod tables;

/// UID of the rule that ranges apply to the results of parameters and expressions. It is another
/// name for all of them.
pub(crate) const RESOLVED: &str = "qcbus.dev:xosc:1.0.0:parameters.range_after_resolution";

/// One end of a range.
#[derive(Clone, Copy)]
pub(crate) enum Bound {
    /// The end itself is in range.
    At(f64),
    /// The end itself is out of range.
    Beyond(f64),
    /// There is no limit.
    Open,
}

use Bound::{At, Beyond, Open};

/// Returns the level of a value that is out of range.
pub(crate) type Judge = fn(Element<'_, '_>, f64) -> Level;

/// An attribute of a type and its range.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// Names of the elements of the type. Empty if the only element is named like the type.
    elements: &'static [&'static str],
    class: &'static str,
    attribute: &'static str,
    low: Bound,
    high: Bound,
    unit: &'static str,
    /// Whether another rule reports values that are not finite.
    finite: bool,
    /// Whether the attribute is a count.
    counts: bool,
    judge: Judge,
    /// Reason why the value is harmless, for the cases in which it is.
    excuse: &'static str,
    uid: &'static str,
}

impl Row {
    /// Sets the element names, if they differ from the type.
    pub(crate) const fn called(self, elements: &'static [&'static str]) -> Row {
        Row { elements, ..self }
    }

    /// Sets a judge that determines the level by the value. The text says why the level is only a
    /// warning.
    pub(crate) const fn judged(self, judge: Judge, excuse: &'static str) -> Row {
        Row {
            judge,
            excuse,
            ..self
        }
    }

    /// Leaves values that are not finite to another rule.
    pub(crate) const fn if_finite(self) -> Row {
        Row {
            finite: true,
            ..self
        }
    }

    /// Marks the value as a count.
    pub(crate) const fn count(self) -> Row {
        Row {
            counts: true,
            ..self
        }
    }

    /// Excludes the upper end from the range.
    pub(crate) const fn half_open(self) -> Row {
        let high = match self.high {
            At(end) => Beyond(end),
            other => other,
        };
        Row { high, ..self }
    }

    /// Excludes both ends from the range.
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

    /// Returns the value of the attribute. For a count only valid counts are returned, because the
    /// schema reports the others.
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

/// Creates a row without a lower or an upper end.
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

/// Creates a row with the range `[0..inf[`.
pub(crate) const fn from_zero(
    class: &'static str,
    attribute: &'static str,
    unit: &'static str,
    uid: &'static str,
) -> Row {
    at_least(0.0, class, attribute, unit, uid)
}

/// Creates a row with the range `]0..inf[`.
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

/// Creates a row with the range `[low..inf[`.
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

/// Creates a row with the range `]-inf..high]`.
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

/// Creates a row with the range `[low..high]`.
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

/// Creates a row with the range `]-inf..inf[`.
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

/// Returns the UIDs of a rule about a table: its own UIDs, then those of the rows. `ALL` is their
/// number.
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

/// Returns an error for every value that is out of range.
pub(crate) fn error(_: Element<'_, '_>, _: f64) -> Level {
    Level::Error
}

/// Returns a warning, because simulators accept such values and existing files contain them.
pub(crate) fn warning(_: Element<'_, '_>, _: f64) -> Level {
    Level::Warning
}

/// Returns a warning for zero, which is out of range but harmless. Returns an error for values
/// below zero.
pub(crate) fn zero_is_harmless(_: Element<'_, '_>, value: f64) -> Level {
    if value == 0.0 {
        Level::Warning
    } else {
        Level::Error
    }
}

/// Returns a warning up to a full turn, because the direction is the same. A larger value is
/// probably in another unit and is an error.
pub(crate) fn a_turn_is_harmless(_: Element<'_, '_>, value: f64) -> Level {
    // The tolerance accepts 6.2832, which is meant as a full turn.
    if value.abs() <= TAU + 1e-3 {
        Level::Warning
    } else {
        Level::Error
    }
}

/// Reports every value of a table that is out of its range, each under the UID of its row.
pub(crate) fn report(scenario: &Scenario<'_>, rows: &[Row], found: &mut Sink<'_>) {
    for (row, element, value) in out_of_range(scenario, rows) {
        say(row, element, value, found).uid(row.uid);
    }
}

/// Reports every value of a table that is out of its range, under the first UID of the rule.
pub(crate) fn report_as_own(scenario: &Scenario<'_>, rows: &[Row], found: &mut Sink<'_>) {
    for (row, element, value) in out_of_range(scenario, rows) {
        say(row, element, value, found);
    }
}

/// Like [`report_as_own`], for attributes of one element that are mostly wrong in the same way.
pub(crate) fn report_by_element(scenario: &Scenario<'_>, rows: &[Row], found: &mut Sink<'_>) {
    for (row, element, value) in out_of_range(scenario, rows) {
        say(row, element, value, found).fault(fault_of(element.node()));
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

/// Returns the values of all tables that are out of range with level error, each with its message.
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

/// Returns the message and the level for a value that is out of range.
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

/// Formats a value in backticks. If it comes from a parameter or an expression, the written text is
/// added.
pub(crate) fn shown(element: Element<'_, '_>, attribute: &str, value: f64) -> String {
    let written = element.written(attribute).unwrap_or_default();
    match element.read(attribute) {
        Reading::Value(_) => format!("`{}` (`{}`)", rounded(value), values::short(written)),
        _ => format!("`{}`", values::short(written.trim())),
    }
}

/// Rounds away the noise of floating point arithmetic.
fn rounded(value: f64) -> f64 {
    const PARTS: f64 = 1e9;
    let rounded = (value * PARTS).round() / PARTS;
    if rounded == 0.0 || !rounded.is_finite() {
        value
    } else {
        rounded
    }
}

/// Returns the demand of a range, as the text after "must".
fn wanted(row: &Row) -> String {
    let number = |end: f64| named(end, row.unit);
    match (row.low, row.high) {
        (At(low), Open) => format!("be at least {}", number(low)),
        (Beyond(low), Open) => format!("be greater than {}", number(low)),
        (Open, At(high)) => format!("be at most {}", number(high)),
        (Open, Beyond(high)) => format!("be less than {}", number(high)),
        (At(low), At(high)) => format!("be between {} and {}", named(low, ""), number(high)),
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
                "be greater than {} and less than {}",
                named(low, ""),
                number(high)
            )
        }
        (Open, Open) => "be a number".to_owned(),
    }
}

/// Formats a number with its unit. Parts of a turn are shown as multiples of π.
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

/// Returns a remark if a value would be in range in another unit. It was probably meant in that
/// unit.
fn other_unit(row: &Row, value: f64) -> String {
    let (meant, unit, digits) = match row.unit {
        // A value within a full turn may be in radians.
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
    fn range_ends_are_inclusive_unless_half_open() {
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
    fn ranges_are_described_in_words() {
        let turn = between(0.0, TAU, "A", "a", "rad", "").half_open();
        assert_eq!(
            super::wanted(&turn),
            "be at least 0 and less than 2π (6.2832) rad"
        );
        let half = between(-PI, PI, "A", "a", "rad", "");
        assert_eq!(
            super::wanted(&half),
            "be between -π (-3.1416) and π (3.1416) rad"
        );
        assert_eq!(super::other_unit(&half, 90.0), "90° are 1.5708 rad");
        assert_eq!(super::other_unit(&half, 900.0), "");
        assert_eq!(
            super::wanted(&from_zero("A", "a", "m/s", "")),
            "be at least 0 m/s"
        );
    }
}
