use crate::families::distributions;
use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    params: &[MOST],
    run,
    ..Rule::after(READABLE)
};

const MOST: Param = Param::number(
    "most",
    1e6,
    "",
    "largest plausible number of scenarios from one distribution; more are considered a mistake",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for range in scenario.elements("Range") {
        let inside = range
            .ancestors()
            .any(|around| around.is("ParameterValueDistribution"));
        let limits = (range.double("lowerLimit"), range.double("upperLimit"));
        if let (true, (Some(lower), Some(upper))) = (inside, limits)
            && lower > upper
        {
            let text = format!(
                "the range starts at {lower} and ends at {upper}; the lower limit must not be greater than the \
                 upper limit"
            );
            found.about(range, "lowerLimit", text);
        }
    }
    for distribution in scenario.elements("DistributionRange") {
        let step = distribution.number("stepWidth");
        if let Some(step) = step.filter(|step| *step <= 0.0) {
            let text = format!(
                "the step width is {}, but must be greater than 0; otherwise the range never ends",
                quoted(distribution, "stepWidth", &step.to_string())
            );
            found.about(distribution, "stepWidth", text);
        }
    }
    for bins in scenario.elements("Histogram") {
        overlap(bins, found);
    }
    for all in scenario.elements("Deterministic") {
        count(all, found);
    }
}

/// Reports bins of a histogram that overlap.
fn overlap(histogram: Element<'_, '_>, found: &mut Sink<'_>) {
    let mut bins: Vec<_> = histogram
        .children_named("Bin")
        .filter_map(|bin| {
            let limits = distributions::limits(bin.child("Range")?)?;
            Some((limits, bin))
        })
        .collect();
    bins.sort_by(|((one, _), _), ((other, _), _)| one.total_cmp(other));
    for pair in bins.windows(2) {
        let [((_, end), before), ((start, _), bin)] = pair else {
            continue;
        };
        if start < end {
            let text = format!(
                "the bin starts at {start}, but another bin ends at {end}; bins should not overlap"
            );
            found
                .issue(bin.node(), text)
                .level(Level::Warning)
                .at(before.node(), "the other bin");
        }
    }
}

/// Reports the number of runs. Every value of one parameter is combined with every value of the
/// others.
fn count(all: Element<'_, '_>, found: &mut Sink<'_>) {
    let single = all.children_named("DeterministicSingleParameterDistribution");
    let singles = single.map(|one| match one.child("DistributionRange") {
        Some(range) => distributions::steps(range).unwrap_or(1.0),
        None => one
            .path(&["DistributionSet"])
            .map_or(1.0, |set| number_of(set, "Element")),
    });
    let multi = all.children_named("DeterministicMultiParameterDistribution");
    let multis = multi.map(|one| {
        one.child("ValueSetDistribution")
            .map_or(1.0, |sets| number_of(sets, "ParameterValueSet"))
    });
    let total: f64 = singles.chain(multis).product();
    let most = found.number(&MOST);
    if total > most {
        let text = format!(
            "the values combine to {total:.0} scenarios; more than {most:.0} are considered a mistake"
        );
        found.issue(all.node(), text).level(Level::Warning);
    }
}

fn number_of(element: Element<'_, '_>, name: &str) -> f64 {
    let count = u32::try_from(element.children_named(name).count()).unwrap_or(u32::MAX);
    f64::from(count.max(1))
}
