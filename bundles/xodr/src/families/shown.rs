//! Numbers in texts, with as few digits as necessary.

/// Maximum number of decimals. Numbers that need more are shown with an exponent.
const MOST_DECIMALS: usize = 6;

/// Magnitude from which a number is shown with an exponent.
const LARGE: f64 = 1e9;

/// Formats a length, a width or a position to the micrometre, without trailing zeros.
pub(crate) fn number(value: f64) -> String {
    rounded(value, MOST_DECIMALS).unwrap_or_else(|| with_exponent(value))
}

/// Formats a number beside its limit: in millimetres, or with as many more digits as necessary to
/// show the difference.
pub(crate) fn beside(value: f64, limit: f64) -> String {
    let differs = |text: &String| text.parse() != Ok(limit) && number(limit) != *text;
    (3..=MOST_DECIMALS)
        .filter_map(|decimals| rounded(value, decimals))
        .find(differs)
        .unwrap_or_else(|| {
            if (value - limit).abs() < 0.5 * limit.abs() {
                // The value is close to the limit, so rounding would hide the difference.
                format!("{value}")
            } else {
                with_exponent(value)
            }
        })
}

/// Rounds to at most this number of decimals, or returns `None` for zero or too many digits.
fn rounded(value: f64, decimals: usize) -> Option<String> {
    if value.abs() >= LARGE {
        return None;
    }
    let text = format!("{value:.decimals$}");
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => &text,
    };
    let is_nothing = matches!(text, "0" | "-0");
    match is_nothing {
        true if value == 0.0 => Some("0".to_owned()),
        true => None,
        false => Some(text.to_owned()),
    }
}

fn with_exponent(value: f64) -> String {
    let text = format!("{value:.2e}");
    match text.split_once('e') {
        Some((digits, exponent)) if digits.contains('.') => {
            let digits = digits.trim_end_matches('0').trim_end_matches('.');
            format!("{digits}e{exponent}")
        }
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::{beside, number};

    #[test]
    fn numbers_are_shown_with_significant_digits_only() {
        assert_eq!(number(3.5), "3.5");
        assert_eq!(number(0.004_999_999_999_995_452_5), "0.005");
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(4.9e-8), "4.9e-8");
        assert_eq!(number(5e-324), "4.94e-324");
        assert_eq!(number(-1e300), "-1e300");
        assert_eq!(number(f64::NAN), "NaN");
    }

    #[test]
    fn number_is_shown_distinct_from_its_limit() {
        assert_eq!(beside(-0.010_921, 0.0), "-0.011");
        assert_eq!(beside(-0.000_1, 0.0), "-0.0001");
        assert_eq!(beside(-3e-7, 0.0), "-3e-7");
        assert_eq!(beside(3.000_04, 3.0), "3.00004");
        assert_eq!(beside(3.000_000_000_1, 3.0), "3.0000000001");
        assert_eq!(beside(12.5, 3.0), "12.5");
    }
}
