//! The time of day, as `Init` sets it.

use std::borrow::Cow;

use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::date_time::DateTime;

/// The time of day of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimeOfDay {
    /// At the begin of the run.
    begin: DateTime,
    /// Whether it passes with the simulation time.
    pub(super) passes: bool,
}

impl TimeOfDay {
    /// Returns the time of day if `Init` sets it, and nothing else does.
    pub(super) fn of(scenario: &Scenario<'_>) -> Option<TimeOfDay> {
        let mut all = scenario.elements_everywhere("TimeOfDay");
        let (Some(only), None) = (all.next(), all.next()) else {
            return None;
        };
        // An entry of a catalog belongs to the reference, which may lie in an event.
        only.ancestor("Init")?;
        Some(TimeOfDay {
            begin: date(only)?,
            passes: only.flag("animation")?,
        })
    }
}

impl Scenario<'_> {
    /// Returns the simulation time in seconds of a `TimeOfDayCondition`. Returns `None` if it is
    /// unknown or the time of day stands still.
    pub fn simulation_time_of(&self, time_of_day: Element<'_, '_>) -> Option<f64> {
        TimeOfDay::of(self).filter(|day| day.passes)?;
        let (_, seconds) = comparison_in_seconds(time_of_day)?;
        Some(seconds)
    }
}

/// Checks whether nothing in the scenario sets the time of day.
pub(super) fn is_unset(scenario: &Scenario<'_>) -> bool {
    let mut environments = scenario.elements_everywhere("EnvironmentAction");
    let is_known = |environment: Element<'_, '_>| {
        let reference = environment.child("CatalogReference");
        reference.is_none_or(|reference| reference.entry().is_some())
    };
    scenario.elements_everywhere("TimeOfDay").next().is_none()
        && scenario
            .elements_everywhere("UserDefinedAction")
            .next()
            .is_none()
        && environments.all(is_known)
}

/// Returns the comparison of a `TimeOfDayCondition`, and the seconds from the begin of the run to
/// its time.
pub(super) fn comparison_in_seconds<'d>(condition: Element<'_, 'd>) -> Option<(Cow<'d, str>, f64)> {
    let day = TimeOfDay::of(condition.scenario())?;
    let date = date(condition)?;
    if date.has_zone != day.begin.has_zone {
        return None;
    }
    Some((condition.word("rule")?, date.seconds - day.begin.seconds))
}

fn date(element: Element<'_, '_>) -> Option<DateTime> {
    DateTime::parse(&element.text("dateTime")?).ok()
}
