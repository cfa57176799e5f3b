//! Sets of characters as sorted, disjoint ranges.

use crate::simple::{is_name_char, is_name_start};

const LAST: u32 = 0x10_FFFF;

/// First digits of Unicode's blocks of decimal digits. Each block has ten characters.
const ZEROS: &[u32] = &[
    0x30, 0x660, 0x6F0, 0x7C0, 0x966, 0x9E6, 0xA66, 0xAE6, 0xB66, 0xBE6, 0xC66, 0xCE6, 0xD66,
    0xDE6, 0xE50, 0xED0, 0xF20, 0x1040, 0x1090, 0x17E0, 0x1810, 0x1946, 0x19D0, 0x1A80, 0x1A90,
    0x1B50, 0x1BB0, 0x1C40, 0x1C50, 0xA620, 0xA8D0, 0xA900, 0xA9D0, 0xA9F0, 0xAA50, 0xABF0, 0xFF10,
    0x104A0,
];

/// A set of characters.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct CharSet {
    ranges: Vec<(u32, u32)>,
}

impl CharSet {
    pub(super) fn one(c: char) -> Self {
        Self::range(c, c)
    }

    pub(super) fn range(first: char, last: char) -> Self {
        Self {
            ranges: vec![(first as u32, last as u32)],
        }
    }

    pub(super) fn ranges(&self) -> &[(u32, u32)] {
        &self.ranges
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.ranges.extend_from_slice(&other.ranges);
        self.ranges.sort_unstable();
        let mut merged: Vec<(u32, u32)> = Vec::with_capacity(self.ranges.len());
        for &(first, last) in &self.ranges {
            match merged.last_mut() {
                Some(before) if first <= before.1.saturating_add(1) => {
                    before.1 = before.1.max(last);
                }
                _ => merged.push((first, last)),
            }
        }
        self.ranges = merged;
    }

    pub(super) fn negated(&self) -> Self {
        let mut ranges = Vec::with_capacity(self.ranges.len() + 1);
        let mut next = 0;
        for &(first, last) in &self.ranges {
            if first > next {
                ranges.push((next, first - 1));
            }
            next = last + 1;
        }
        if next <= LAST {
            ranges.push((next, LAST));
        }
        Self { ranges }
    }

    pub(super) fn without(&self, other: &Self) -> Self {
        let mut outside = self.negated();
        outside.add(other);
        outside.negated()
    }

    /// Returns the set of `.`: all characters except line ends.
    pub(super) fn dot() -> Self {
        let mut ends = Self::one('\n');
        ends.add(&Self::one('\r'));
        ends.negated()
    }

    /// Returns the set for a letter after a backslash.
    pub(super) fn escape(letter: char) -> Option<Self> {
        Some(match letter {
            's' => Self::of(|c| matches!(c, ' ' | '\t' | '\n' | '\r'), 0x20),
            'd' => Self {
                ranges: ZEROS.iter().map(|&zero| (zero, zero + 9)).collect(),
            },
            'i' => Self::of(is_name_start, 0xF_0000),
            'c' => Self::of(is_name_char, 0xF_0000),
            'S' | 'D' | 'I' | 'C' => Self::escape(letter.to_ascii_lowercase())?.negated(),
            'n' => Self::one('\n'),
            'r' => Self::one('\r'),
            't' => Self::one('\t'),
            '\\' | '|' | '.' | '?' | '*' | '+' | '(' | ')' | '{' | '}' | '-' | '[' | ']' | '^' => {
                Self::one(letter)
            }
            _ => return None,
        })
    }

    fn of(member: fn(char) -> bool, last: u32) -> Self {
        let mut ranges: Vec<(u32, u32)> = Vec::new();
        for code in (0..=last).filter(|&code| char::from_u32(code).is_some_and(member)) {
            match ranges.last_mut() {
                Some(before) if before.1 + 1 == code => before.1 = code,
                _ => ranges.push((code, code)),
            }
        }
        Self { ranges }
    }
}
