use crate::families::actions::short;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[MOST],
    run,
    ..Rule::after(READABLE)
};

const MOST: Param = Param::number(
    "most",
    5.0,
    "standard deviations",
    "a range that is further away from the expected value is never reached",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let most = found.number(&MOST);
    for name in ["NormalDistribution", "PoissonDistribution"] {
        for one in scenario.elements(name) {
            let (Some(mean), Some(range)) = (one.number("expectedValue"), one.child("Range"))
            else {
                continue;
            };
            // The variance of a Poisson distribution is its expected value.
            let variance = match name {
                "NormalDistribution" => one.number("variance"),
                _ => Some(mean),
            };
            let limits = (range.number("lowerLimit"), range.number("upperLimit"));
            let (Some(variance), (Some(low), Some(high))) = (variance, limits) else {
                continue;
            };
            let away = (low - mean).max(mean - high);
            let deviation = variance.sqrt();
            // Other rules report a range that is empty and a variance that is not positive.
            if !(variance > 0.0 && low <= high && away > most * deviation) {
                continue;
            }
            let text = format!(
                "the expected value {} is {} standard deviations outside of the `Range` from {} to {}, so no value \
                 in it is ever drawn; correct the expected value, the variance or the range",
                short(mean),
                short((away / deviation * 10.0).round() / 10.0),
                short(low),
                short(high)
            );
            found.about(one, "expectedValue", text);
        }
    }
}
