//! Numbers in the notation of XML Schema, checked and compared without allocation.

use std::cmp::Ordering;

use crate::edition::Edition;

/// `[+-]?[0-9]+`
pub(crate) fn is_integer(text: &str) -> bool {
    let digits = unsigned(text);
    !digits.is_empty() && digits.iter().all(u8::is_ascii_digit)
}

/// `[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)`
pub(crate) fn is_decimal(text: &str) -> bool {
    let bytes = unsigned(text);
    mantissa(bytes) == Some(bytes.len())
}

/// Checks for a decimal with optional exponent, `INF`, `-INF` or `NaN` (`+INF` since XSD 1.1).
pub(crate) fn is_float(text: &str, edition: Edition) -> bool {
    let bytes = unsigned(text);
    let Some(end) = mantissa(bytes) else {
        return is_special(text, edition);
    };
    match bytes.get(end) {
        None => true,
        Some(b'e' | b'E') => {
            let exponent = match bytes.get(end + 1) {
                Some(b'+' | b'-') => &bytes[end + 2..],
                _ => &bytes[end + 1..],
            };
            !exponent.is_empty() && exponent.iter().all(u8::is_ascii_digit)
        }
        Some(_) => false,
    }
}

fn is_special(text: &str, edition: Edition) -> bool {
    matches!(text, "INF" | "-INF" | "NaN") || (text == "+INF" && edition == Edition::V1_1)
}

/// Returns the value of a text that passed [`is_float`].
pub(crate) fn float_value(text: &str) -> Option<f64> {
    match text {
        "INF" | "+INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        "NaN" => Some(f64::NAN),
        _ => text.parse().ok(),
    }
}

/// Returns the text after the sign.
fn unsigned(text: &str) -> &[u8] {
    match text.as_bytes() {
        [b'+' | b'-', rest @ ..] => rest,
        bytes => bytes,
    }
}

/// Returns the length of `[0-9]+(\.[0-9]*)?|\.[0-9]+` at the start of `bytes`.
fn mantissa(bytes: &[u8]) -> Option<usize> {
    let whole = digits(bytes);
    if bytes.get(whole) != Some(&b'.') {
        return (whole > 0).then_some(whole);
    }
    let fraction = digits(&bytes[whole + 1..]);
    (whole + fraction > 0).then_some(whole + 1 + fraction)
}

/// Returns the number of digits at the start of `bytes`. Exporters write up to 17, so eight are
/// checked at the same time.
fn digits(bytes: &[u8]) -> usize {
    let (words, _) = bytes.as_chunks::<8>();
    let eights = words.iter().take_while(|word| are_digits(**word)).count();
    let rest = bytes[8 * eights..].iter();
    8 * eights + rest.take_while(|byte| byte.is_ascii_digit()).count()
}

/// Checks whether eight bytes are digits: their upper halves are 3, before and after an addition of
/// 6. A byte that begins with 3 does not overflow, so there is no carry into the next byte.
fn are_digits(word: [u8; 8]) -> bool {
    const UPPER: u64 = 0xF0F0_F0F0_F0F0_F0F0;
    const THREES: u64 = 0x3030_3030_3030_3030;
    const SIXES: u64 = 0x0606_0606_0606_0606;
    let word = u64::from_le_bytes(word);
    word & UPPER == THREES && word.wrapping_add(SIXES) & UPPER == THREES
}

/// Significant digits of a decimal number: the sign and the digits before and after the point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Digits<'a> {
    negative: bool,
    pub(crate) whole: &'a str,
    pub(crate) fraction: &'a str,
}

impl<'a> Digits<'a> {
    /// Reads a text that passed [`is_decimal`] or [`is_integer`].
    pub(crate) fn of(text: &'a str) -> Self {
        let bare = text.strip_prefix(['+', '-']).unwrap_or(text);
        let (whole, fraction) = bare.split_once('.').unwrap_or((bare, ""));
        let whole = whole.trim_start_matches('0');
        let fraction = fraction.trim_end_matches('0');
        let zero = whole.is_empty() && fraction.is_empty();
        Self {
            negative: text.starts_with('-') && !zero,
            whole,
            fraction,
        }
    }

    fn magnitude(&self, other: &Self) -> Ordering {
        let whole = self
            .whole
            .len()
            .cmp(&other.whole.len())
            .then_with(|| self.whole.cmp(other.whole));
        whole.then_with(|| self.fraction.cmp(other.fraction))
    }
}

impl Ord for Digits<'_> {
    fn cmp(&self, other: &Self) -> Ordering {
        match (self.negative, other.negative) {
            (false, true) => Ordering::Greater,
            (true, false) => Ordering::Less,
            (false, false) => self.magnitude(other),
            (true, true) => other.magnitude(self),
        }
    }
}

impl PartialOrd for Digits<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Checks whether an integer is in the range `(lowest, highest)`. An empty text means no limit.
pub(crate) fn in_bounds(text: &str, (lowest, highest): (&str, &str)) -> bool {
    let value = Digits::of(text);
    (lowest.is_empty() || value >= Digits::of(lowest))
        && (highest.is_empty() || value <= Digits::of(highest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_follow_the_lexical_rules() {
        for good in [
            "0", "-1.5", "1.", ".5", "+1e5", "1E-03", "INF", "-INF", "NaN",
        ] {
            assert!(is_float(good, Edition::V1_0), "{good}");
        }
        for bad in [
            "", ".", "1e", "e5", "1,5", "inf", "nan", "0x1", "1e+", "--1", "+INF", "1 2",
        ] {
            assert!(!is_float(bad, Edition::V1_0), "{bad}");
        }
        assert!(is_float("+INF", Edition::V1_1));
    }

    #[test]
    fn eight_digits_are_distinguished_from_other_bytes() {
        for at in 0..8 {
            for byte in 0..=u8::MAX {
                let mut word = *b"90817263";
                word[at] = byte;
                let expected = word.iter().all(u8::is_ascii_digit);
                assert_eq!(are_digits(word), expected, "{byte} at {at}");
            }
        }
        assert_eq!(digits(b"12345678901234567e"), 17);
        assert_eq!(digits(b"1234567/90"), 7);
        assert_eq!(digits(b""), 0);
    }

    #[test]
    fn decimals_compare_by_value() {
        let order = |a, b| Digits::of(a).cmp(&Digits::of(b));
        assert_eq!(order("007", "7"), Ordering::Equal);
        assert_eq!(order("-0", "0.00"), Ordering::Equal);
        assert_eq!(order("-10", "-9"), Ordering::Less);
        assert_eq!(order("0.25", "0.3"), Ordering::Less);
        assert_eq!(order("100", "99.9"), Ordering::Greater);
    }

    #[test]
    fn empty_bound_means_no_limit() {
        assert!(in_bounds("99999999999999999999", ("0", "")));
        assert!(!in_bounds("-1", ("0", "")));
        assert!(in_bounds("-2147483648", ("-2147483648", "2147483647")));
        assert!(!in_bounds("2147483648", ("-2147483648", "2147483647")));
    }
}
