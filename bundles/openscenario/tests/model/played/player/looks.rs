//! Conditions of the small simulator.

use qcbus_openscenario::{Comparison, Condition, Edge, Logic, State, Trigger};

use super::{Phase, Player, STEP};

/// Memory of a condition.
#[derive(Default)]
pub(super) struct Look {
    last: Option<bool>,
    /// Steps in which it was true, before the delay.
    held: Vec<usize>,
    step: usize,
}

impl Player<'_> {
    pub(super) fn triggers(&mut self, trigger: &Trigger) -> bool {
        // Each condition is looked at, also if the outcome is clear. Lenient simulators stop earlier.
        let mut any = false;
        for group in &trigger.groups {
            let mut all = true;
            for condition in group {
                let is_timed = condition.delay.is_some_and(|it| it > 0.0);
                if all || is_timed || !self.is_lenient {
                    all &= self.holds(condition);
                }
            }
            any |= all;
        }
        any
    }

    fn holds(&mut self, condition: &Condition) -> bool {
        let key = std::ptr::from_ref(condition);
        let step = self.step;
        let last = self.looked.insert(key, step);
        let value = self.value(&condition.logic) || self.was(&condition.logic, last);
        let look = self.looks.entry(key).or_default();
        // Elements that waited before look anew.
        if look.step + 1 != step {
            *look = Look::default();
        }
        look.step = step;
        let last = look.last.replace(value);
        let edged = match (condition.edge, last) {
            (Edge::None, _) => value,
            (_, None) => false,
            (Edge::Rising, Some(last)) => value && !last,
            (Edge::Falling, Some(last)) => !value && last,
            (_, Some(last)) => value != last,
        };
        if edged {
            look.held.push(step);
        }
        let delay = (condition.delay.unwrap_or(0.0) / STEP).round() as usize;
        step.checked_sub(delay)
            .is_some_and(|then| look.held.contains(&then))
    }

    /// Checks whether a state came after the last look, in a simulator that remembers it.
    fn was(&self, logic: &Logic, last: Option<usize>) -> bool {
        let Logic::State(place, state) = logic else {
            return false;
        };
        let is_new = |step: usize| step <= self.step && last.is_none_or(|last| step > last);
        let mut changes = self.changes.iter();
        self.is_lenient && changes.any(|it| (it.1, it.2) == (*place, *state) && is_new(it.0))
    }

    fn value(&mut self, logic: &Logic) -> bool {
        match logic {
            Logic::Time(comparison, value) => {
                let (now, value) = (self.time(), *value);
                let is_equal = (now - value).abs() < STEP / 2.0;
                match comparison {
                    Comparison::EqualTo => is_equal,
                    Comparison::NotEqualTo => !is_equal,
                    Comparison::GreaterThan => now > value && !is_equal,
                    Comparison::GreaterOrEqual => now > value || is_equal,
                    Comparison::LessThan => now < value && !is_equal,
                    Comparison::LessOrEqual => now < value || is_equal,
                }
            }
            Logic::State(place, state) => match state {
                State::Standby => self.before[*place] == Phase::Standby,
                State::Running => self.before[*place] == Phase::Running,
                State::Complete => self.before[*place] == Phase::Complete,
                transition => self.seen.contains(&(*place, *transition)),
            },
            Logic::Never => false,
            Logic::Unknown => self.draw().is_multiple_of(8),
        }
    }
}
