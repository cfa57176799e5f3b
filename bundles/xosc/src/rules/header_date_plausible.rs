use crate::prelude::*;
use qcbus_openscenario::DateTime;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    params: &[EARLIEST],
    run,
    ..Rule::after(READABLE)
};

const EARLIEST: Param = Param::number(
    "earliest",
    2000.0,
    "year",
    "earliest plausible year in the date of a file",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(header) = scenario.root().child("FileHeader") else {
        return;
    };
    // The schema reports a text that is no date.
    let date = header.text("date");
    let year = date
        .and_then(|date| DateTime::parse(&date).ok())
        .map(|date| date.year);
    let earliest = found.number(&EARLIEST);
    if let Some(year) = year.filter(|year| (*year as f64) < earliest) {
        let text = format!(
            "the header's `date` is in the year {year}, before {earliest}; a tool has probably written another \
             value instead of the date"
        );
        found.issue(Place::attribute_or_node(header.node(), "date"), text);
    }
}
