//! Piecewise cubic profiles along s, t or a section: elevation, superelevation, lane offset, width,
//! border and the coefficients of a cross section surface.

use qcbus_document::Node;

use crate::geometry::{Cubic, finite};
use crate::types::station::Station;
use crate::types::steps::{Starts, Steps};
use crate::types::value::{known, numbers};

/// One record of a profile: `a + b·ds + c·ds² + d·ds³`, valid from its start to the next record.
#[derive(Debug, Clone, Copy)]
pub struct Record<'a> {
    node: Node<'a>,
    start: f64,
    cubic: Cubic,
}

impl<'a> Record<'a> {
    fn read(node: Node<'a>, start: &str) -> Record<'a> {
        let [start, a, b, c, d] = numbers(node, [start, "a", "b", "c", "d"]);
        let cubic = Cubic { a, b, c, d };
        Record { node, start, cubic }
    }

    /// Reads like [`Record::read`], but an absent coefficient (not a malformed one) is zero.
    fn read_sparse(node: Node<'a>, start: &str) -> Record<'a> {
        let mut record = Record::read(node, start);
        let Cubic { a, b, c, d } = &mut record.cubic;
        for (name, coefficient) in [("a", a), ("b", b), ("c", c), ("d", d)] {
            if coefficient.is_nan() && node.attr(name).is_none() {
                *coefficient = 0.0;
            }
        }
        record
    }

    /// Returns the element.
    #[inline]
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns the start of the record: `@s` on the road, `@sOffset` in the section.
    #[inline]
    pub fn start(&self) -> Option<f64> {
        known(self.start)
    }

    /// Returns the polynomial if all four coefficients exist.
    #[inline]
    pub fn cubic(&self) -> Option<Cubic> {
        let Cubic { a, b, c, d } = self.cubic;
        let all = [a, b, c, d];
        all.iter()
            .all(|value| value.is_finite())
            .then_some(self.cubic)
    }

    /// Returns the value at `x`, which has the same origin as the record's start.
    #[inline]
    pub fn at(&self, x: f64) -> Option<f64> {
        self.cubic()?.eval(x - self.start()?)
    }
}

impl Starts for Record<'_> {
    #[inline]
    fn start(&self) -> f64 {
        self.start
    }
}

/// Records in document order, evaluated in order of their starts.
#[derive(Debug, Clone, Default)]
pub struct Profile<'a> {
    steps: Steps<Record<'a>>,
}

/// The record that is valid at a station, with the distance from its start.
#[derive(Debug, Clone, Copy)]
pub struct Valid<'p, 'a> {
    /// The record.
    pub record: &'p Record<'a>,
    /// Distance from the record's start, never negative.
    pub ds: f64,
    /// Polynomial of the record.
    pub cubic: Cubic,
}

impl<'a> Profile<'a> {
    /// Reads the profile from these elements. The attribute `start` contains their starts.
    pub fn read(nodes: impl Iterator<Item = Node<'a>>, start: &str) -> Profile<'a> {
        let records = nodes.map(|node| Record::read(node, start)).collect();
        let steps = Steps::new(records);
        Profile { steps }
    }

    /// Reads a profile like [`Profile::read`], but absent coefficients are zero.
    pub fn read_sparse(nodes: impl Iterator<Item = Node<'a>>, start: &str) -> Profile<'a> {
        let records = nodes.map(|node| Record::read_sparse(node, start)).collect();
        let steps = Steps::new(records);
        Profile { steps }
    }

    /// Returns the records in document order.
    #[inline]
    pub fn records(&self) -> &[Record<'a>] {
        self.steps.items()
    }

    /// Checks whether there are no records.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.records().is_empty()
    }

    /// Returns the records in ascending order of start. Records with equal starts keep their order.
    /// Returns none if the start of a record is unknown.
    #[inline]
    pub fn in_order(&self) -> impl DoubleEndedIterator<Item = &Record<'a>> {
        self.steps.in_order()
    }

    /// Returns the first station with a value.
    pub fn begin(&self) -> Option<f64> {
        self.in_order().next()?.start()
    }

    /// Returns the valid record at a station: the last one that starts at or before it. Returns
    /// `None` before the first record, if the record is incomplete, or if any start is unknown.
    #[inline]
    pub fn valid_at(&self, station: impl Into<Station>) -> Option<Valid<'_, 'a>> {
        let station = station.into();
        let record = self.steps.ranked(self.steps.rank_at(station)?)?;
        Some(Valid {
            record,
            ds: (station.x() - record.start).max(0.0),
            cubic: record.cubic()?,
        })
    }

    /// Returns the value at a station; see [`Profile::valid_at`].
    #[inline]
    pub fn at(&self, station: impl Into<Station>) -> Option<f64> {
        let valid = self.valid_at(station)?;
        valid.cubic.eval(valid.ds)
    }

    /// Returns the slope at a station; see [`Profile::valid_at`].
    pub fn slope_at(&self, station: impl Into<Station>) -> Option<f64> {
        let valid = self.valid_at(station)?;
        finite(valid.cubic.slope(valid.ds))
    }

    /// Returns the value and slope at a station; see [`Profile::valid_at`].
    pub(crate) fn both_at(&self, station: Station) -> Option<[f64; 2]> {
        let valid = self.valid_at(station)?;
        let (ds, cubic) = (valid.ds, valid.cubic);
        Some([cubic.eval(ds)?, finite(cubic.slope(ds))?])
    }

    /// Returns the value at a station, or zero without records and before the first one. Elevation,
    /// superelevation and lane offset have this default.
    #[inline]
    pub fn at_or_zero(&self, station: impl Into<Station>) -> Option<f64> {
        let station = station.into();
        if self.steps.silent_at(station) {
            Some(0.0)
        } else {
            self.at(station)
        }
    }

    /// Returns the slope at a station, or zero without records and before the first one.
    pub fn slope_or_zero(&self, station: impl Into<Station>) -> Option<f64> {
        let station = station.into();
        if self.steps.silent_at(station) {
            Some(0.0)
        } else {
            self.slope_at(station)
        }
    }

    /// Returns each record with its stretch up to `end`, in ascending order. Incomplete records are
    /// left out. So are records that start at or beyond `end`, and records with the same start as
    /// the next one.
    #[inline]
    pub fn stretches(&self, end: f64) -> impl Iterator<Item = Stretch<'_, 'a>> {
        (0..self.steps.ranks()).filter_map(move |rank| {
            let record = self.steps.ranked(rank)?;
            let next = self
                .steps
                .ranked(rank + 1)
                .map_or(end, |next| next.start.min(end));
            let cubic = record.cubic()?;
            (record.start < next).then_some(Stretch {
                record,
                from: record.start,
                to: next,
                cubic,
            })
        })
    }
}

/// A record with its stretch of validity.
#[derive(Debug, Clone, Copy)]
pub struct Stretch<'p, 'a> {
    /// The record.
    pub record: &'p Record<'a>,
    /// Start of the stretch.
    pub from: f64,
    /// End of the stretch: the start of the next record, or the end.
    pub to: f64,
    /// Polynomial of the record, in the distance from `from`.
    pub cubic: Cubic,
}

impl Stretch<'_, '_> {
    /// Returns the length of the stretch.
    pub fn length(&self) -> f64 {
        self.to - self.from
    }
}
