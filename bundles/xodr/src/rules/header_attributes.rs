use crate::families::dates::{digits, is_day, is_iso_8601, is_other_iso_8601};
use crate::families::shown::{beside, number};
use crate::prelude::*;
use qcbus_document::ValueError;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Document> = Rule {
    after: &["check_asam_xodr_xml_fileheader_is_present"],
    run,
    ..Rule::DEFAULTS
};

/// Tolerance in metres by which a bound may be less than the other.
const ROUNDING: f64 = 1e-9;

/// First version whose header table requires ISO 8601.
const ISO_DATES_SINCE: Version = Version::new(1, 6);

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    let Some(root) = document.root() else { return };
    let mut headers = root.children_named("header");
    let Some(header) = headers.next() else { return };
    for second in headers {
        let text = "there is a second `header`; a file must have exactly one";
        found
            .issue(second, text)
            .at(header, "the first one")
            .fault(fault_of(second));
    }
    if let Some(before) = root.children().next().filter(|first| *first != header) {
        let text = format!(
            "the header comes after `{}`; it must be the first element in the file",
            before.name()
        );
        found
            .issue(header, text)
            .level(Level::Warning)
            .at(before, "the element before it");
    }
    extent(header, found);
    numbers(
        header.child("offset"),
        &[("x", "m"), ("y", "m"), ("z", "m"), ("hdg", "rad")],
        found,
    );
    date(header, found);
}

/// Checks the extent in metres: the greater bound must not be below the smaller one.
fn extent(header: Node<'_>, found: &mut Sink<'_>) {
    numbers(
        Some(header),
        &[("north", "m"), ("south", "m"), ("east", "m"), ("west", "m")],
        found,
    );
    for (greater, smaller) in [("north", "south"), ("east", "west")] {
        if let (Ok(most), Ok(least)) = (header.f64(greater), header.f64(smaller))
            && most < least - ROUNDING
        {
            let text = format!(
                "`{greater}` is {} m and less than `{smaller}`, which is {} m; it must be the greater bound",
                beside(most, least),
                number(least)
            );
            found.issue(Place::attribute_or_node(header, greater), text);
        }
    }
}

/// Checks that each given attribute is a finite double.
fn numbers(node: Option<Node<'_>>, attributes: &[(&'static str, &str)], found: &mut Sink<'_>) {
    let Some(node) = node else { return };
    for (name, unit) in attributes {
        let value = match node.f64(name) {
            Err(ValueError::Missing { .. }) => continue,
            Ok(number) if number.is_finite() => continue,
            _ => node.attr(name).unwrap_or_default(),
        };
        let text = format!(
            "`{name}` of `{}` is `{value}`, but must be a finite number [{unit}] that fits a double (IEEE 754)",
            node.name()
        );
        found.issue(Place::attribute_or_node(node, name), text);
    }
}

fn date(header: Node<'_>, found: &mut Sink<'_>) {
    let Some(date) = header.attr("date").filter(|date| !date.trim().is_empty()) else {
        return;
    };
    if found
        .version()
        .is_none_or(|version| version < ISO_DATES_SINCE)
    {
        no_such_day(header, date, found);
        return;
    }
    if is_iso_8601(date) {
        return;
    }
    // The standard prefers one form but allows all of ISO 8601.
    let fault = if is_other_iso_8601(date) {
        "has a form of ISO 8601 that some readers do not know; the preferred form is"
    } else {
        "does not have the form that ISO 8601 requires, such as"
    };
    let text = format!("the date `{date}` {fault} `2026-01-31T12:30:00`");
    found
        .issue(Place::attribute_or_node(header, "date"), text)
        .level(Level::Information);
}

/// Reports a date in ISO form with a day that does not exist. In versions that do not require ISO
/// 8601, any other form is allowed.
fn no_such_day(header: Node<'_>, date: &str, found: &mut Sink<'_>) {
    let day = date.trim().get(..10).unwrap_or_default();
    let mut parts = day.split('-');
    let shape = [4, 2, 2].map(|count| {
        parts
            .next()
            .is_some_and(|part| digits(part, count).is_some())
    });
    if shape == [true; 3] && !is_day(day) {
        let text = format!(
            "the date `{date}` has the day `{day}`, which does not exist in any calendar; a date must be written \
             as year, month and day"
        );
        found
            .issue(Place::attribute_or_node(header, "date"), text)
            .level(Level::Warning);
    }
}
