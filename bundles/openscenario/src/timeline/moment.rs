//! Moments of a run that are only known within bounds, and sets of times.

/// A moment of a run, in seconds of simulation time, known within bounds. Infinity means never.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Not before this time.
    pub earliest: f64,
    /// Not after this time. Infinite if the moment may never come.
    pub latest: f64,
}

impl Moment {
    /// The moment never comes.
    pub const NEVER: Moment = Moment {
        earliest: f64::INFINITY,
        latest: f64::INFINITY,
    };

    /// Nothing is known: the moment may come at any time or never.
    pub const UNKNOWN: Moment = Moment {
        earliest: 0.0,
        latest: f64::INFINITY,
    };

    /// The begin of the run.
    pub const BEGIN: Moment = Moment {
        earliest: 0.0,
        latest: 0.0,
    };

    /// Checks whether the moment certainly never comes.
    pub fn is_never(self) -> bool {
        self.earliest == f64::INFINITY
    }

    /// Checks whether the moment certainly comes.
    pub fn is_certain(self) -> bool {
        self.latest < f64::INFINITY
    }

    /// Returns the first of two moments.
    #[must_use]
    pub fn or(self, other: Moment) -> Moment {
        Moment {
            earliest: self.earliest.min(other.earliest),
            latest: self.latest.min(other.latest),
        }
    }

    /// Returns the last of two moments.
    #[must_use]
    pub fn and(self, other: Moment) -> Moment {
        Moment {
            earliest: self.earliest.max(other.earliest),
            latest: self.latest.max(other.latest),
        }
    }
}

/// Returns the largest error of a sum of times, in seconds.
fn rounding(time: f64) -> f64 {
    if time.is_finite() {
        1e-9 + 4.0 * f64::EPSILON * time.abs()
    } else {
        0.0
    }
}

/// Times at which something holds: closed intervals, ascending and separate.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Times(Vec<(f64, f64)>);

impl Times {
    pub(super) fn none() -> Times {
        Times(Vec::new())
    }

    pub(super) fn always() -> Times {
        Times::between(0.0, f64::INFINITY)
    }

    /// The times from `from` to `to`, or none if they are the wrong way round or `from` is never.
    pub(super) fn between(from: f64, to: f64) -> Times {
        match from <= to && from < f64::INFINITY {
            true => Times(vec![(from, to)]),
            false => Times::none(),
        }
    }

    pub(super) fn from(from: f64) -> Times {
        Times::between(from, f64::INFINITY)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the first time, or infinity.
    pub(super) fn first(&self) -> f64 {
        self.0.first().map_or(f64::INFINITY, |(from, _)| *from)
    }

    /// Returns the begin of the first interval that lasts so long, or infinity.
    pub(super) fn first_lasting(&self, seconds: f64) -> f64 {
        let mut lasting = self.0.iter().filter(|(from, to)| to - from >= seconds);
        lasting.next().map_or(f64::INFINITY, |(from, _)| *from)
    }

    /// Returns the common times of two sets. Times that differ only by rounding are common, so that
    /// `0.75 + 1` and `1.75` are never taken for different moments.
    pub(super) fn meet(&self, other: &Times) -> Times {
        let wider = self.0.iter().map(|(from, to)| {
            let begin = (from - rounding(*from)).max(from.min(0.0));
            (begin, to + rounding(*to))
        });
        Times(wider.collect()).intersect(other)
    }

    pub(super) fn intersect(&self, other: &Times) -> Times {
        let mut found = Vec::new();
        for (from, to) in &self.0 {
            for (low, high) in &other.0 {
                let (from, to) = (from.max(*low), to.min(*high));
                if from <= to && from < f64::INFINITY {
                    found.push((from, to));
                }
            }
        }
        Times(found)
    }

    pub(super) fn unite(&self, other: &Times) -> Times {
        let mut all: Vec<(f64, f64)> = self.0.iter().chain(&other.0).copied().collect();
        all.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut united: Vec<(f64, f64)> = Vec::new();
        for (from, to) in all {
            match united.last_mut() {
                Some((_, end)) if from <= *end => *end = end.max(to),
                _ => united.push((from, to)),
            }
        }
        Times(united)
    }

    /// Returns the times later by `delay`.
    pub(super) fn later(&self, delay: f64) -> Times {
        Times(
            self.0
                .iter()
                .map(|(from, to)| (from + delay, to + delay))
                .collect(),
        )
    }

    /// Returns the times with later ends.
    pub(super) fn longer(&self, seconds: f64) -> Times {
        let longer = self.0.iter().map(|(from, to)| (*from, to + seconds));
        Times(longer.collect()).unite(&Times::none())
    }

    /// Returns the times with later begins.
    pub(super) fn shorter(&self, seconds: f64) -> Times {
        let shorter = self.0.iter().map(|(from, to)| (from + seconds, *to));
        Times(shorter.filter(|(from, to)| from <= to).collect())
    }

    /// Returns these times without the inner times of others. With `begins`, their begins stay;
    /// with `ends`, their ends stay.
    pub(super) fn without(&self, others: &Times, begins: bool, ends: bool) -> Times {
        let mut left = self.0.clone();
        for (low, high) in &others.0 {
            let mut rest = Vec::new();
            for (from, to) in left {
                if to < *low || from > *high {
                    rest.push((from, to));
                    continue;
                }
                let keeps_begin = from < *low || (begins && from <= *low);
                if keeps_begin {
                    rest.push((from, to.min(*low)));
                }
                let keeps_end = *high < f64::INFINITY && (to > *high || (ends && to >= *high));
                let is_same = keeps_begin && *high <= *low && to <= *high;
                if keeps_end && !is_same {
                    rest.push((from.max(*high), to));
                }
            }
            left = rest;
        }
        Times(left)
    }

    /// Checks whether all times of an interval belong to the set.
    pub(super) fn covers(&self, from: f64, to: f64) -> bool {
        self.0.iter().any(|(low, high)| *low <= from && to <= *high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_that_differ_by_rounding_meet() {
        // A rising `!= 1.75`, and `> 0.75` with a delay of 1 s.
        let just_after = 1e-6;
        let one = Times::between(1.75 + just_after, 1.75 + just_after);
        let other = Times::from(0.75 + just_after).later(1.0);
        assert!(one.intersect(&other).is_empty(), "{one:?} {other:?}");
        assert!(!one.meet(&other).is_empty());
        assert!(!other.meet(&one).is_empty());
        assert!(one.meet(&Times::from(1.75 + 2.0 * just_after)).is_empty());
        assert_eq!(Times::always().meet(&Times::from(2.0)), Times::from(2.0));
    }
}
