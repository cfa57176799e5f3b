//! Encoding of numbers and strings in the plan.

use std::collections::HashMap;

/// Largest number that JavaScript represents exactly.
const LARGEST: u64 = (1 << 53) - 1;

/// Maximum number of characters of a string. Strings are names only for people.
const LONGEST_STRING: usize = 300;

/// The written bytes and the strings to which they refer by number.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    pub(crate) bytes: Vec<u8>,
    pub(crate) strings: Strings,
}

/// Strings without duplicates, numbered in the order of first use.
#[derive(Debug, Default)]
pub(crate) struct Strings {
    pub(crate) list: Vec<String>,
    numbers: HashMap<String, u64>,
}

impl Strings {
    fn number(&mut self, text: &str) -> u64 {
        let text = match text.char_indices().nth(LONGEST_STRING) {
            Some((end, _)) => text.get(..end).unwrap_or(""),
            None => text,
        };
        if let Some(number) = self.numbers.get(text) {
            return *number;
        }
        let number = self.list.len() as u64;
        self.list.push(text.to_owned());
        self.numbers.insert(text.to_owned(), number);
        number
    }
}

impl Writer {
    /// Writes `u`: an unsigned number.
    pub(crate) fn unsigned(&mut self, value: u64) {
        unsigned(&mut self.bytes, value);
    }

    /// Writes `u n`: the number of items that follow.
    pub(crate) fn count(&mut self, count: usize) {
        self.unsigned(count as u64);
    }

    /// Writes `u` for an optional index: 0 for `None`, else the index plus 1.
    pub(crate) fn maybe(&mut self, index: Option<usize>) {
        self.unsigned(index.map_or(0, |index| index as u64 + 1));
    }

    /// Writes `z`: a signed number.
    pub(crate) fn signed(&mut self, value: i64) {
        let bound = (LARGEST / 2) as i64;
        let value = value.clamp(-bound, bound);
        self.unsigned(((value << 1) ^ (value >> 63)) as u64);
    }

    /// Writes `s`: a string by its number.
    pub(crate) fn string(&mut self, text: &str) {
        let number = self.strings.number(text);
        self.unsigned(number);
    }

    /// Writes points, each except the first as the difference from the previous one. `then` writes
    /// the other data of a point.
    pub(crate) fn points<T>(
        &mut self,
        points: &[T],
        at: impl Fn(&T) -> [i64; 2],
        mut then: impl FnMut(&mut Writer, &T),
    ) {
        self.count(points.len());
        let mut last = [0; 2];
        for point in points {
            let [x, y] = at(point);
            self.signed(x - last[0]);
            self.signed(y - last[1]);
            last = [x, y];
            then(self, point);
        }
    }
}

/// Appends `u` to some bytes.
pub(crate) fn unsigned(bytes: &mut Vec<u8>, value: u64) {
    let mut rest = value.min(LARGEST);
    while rest >= 0x80 {
        bytes.push((rest & 0x7f) as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
}

/// Converts metres to whole centimetres that are not negative; NaN becomes zero.
pub(crate) fn length(metres: f64) -> u64 {
    // The conversion saturates, and NaN becomes zero.
    (100.0 * metres).round() as u64
}

/// Converts metres to whole centimetres; NaN becomes zero.
pub(crate) fn offset(metres: f64) -> i64 {
    (100.0 * metres).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_use_variable_length_up_to_53_bits() {
        let mut out = Writer::default();
        for value in [0, 127, 128, 300] {
            out.unsigned(value);
        }
        for value in [0, -1, 1, -64, 64] {
            out.signed(value);
        }
        assert_eq!(out.bytes, [0, 127, 0x80, 1, 0xac, 2, 0, 1, 2, 127, 0x80, 1]);
        let mut largest = Writer::default();
        largest.unsigned(u64::MAX);
        assert_eq!(
            largest.bytes,
            [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x0f]
        );
        let mut lowest = Writer::default();
        lowest.signed(i64::MIN);
        assert_eq!(lowest.bytes.len(), 8);
        assert_eq!((length(f64::NAN), length(-1.0), offset(-0.014)), (0, 0, -1));
    }

    #[test]
    fn each_string_is_written_once() {
        let mut out = Writer::default();
        for text in ["a", "b", "a", ""] {
            out.string(text);
        }
        assert_eq!(out.bytes, [0, 1, 0, 2]);
        assert_eq!(out.strings.list, ["a", "b", ""]);
    }
}
