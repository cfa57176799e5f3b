//! Numbers in texts: as few digits as tell what they are.

/// Decimals that are shown at most; what needs more is shown with an exponent.
const MOST_DECIMALS: usize = 6;

/// From here on a number is shown with an exponent.
const LARGE: f64 = 1e9;

/// A length, a width, a place: to the micrometre, without zeros behind it.
pub(crate) fn number(value: f64) -> String {
    rounded(value, MOST_DECIMALS).unwrap_or_else(|| with_exponent(value))
}

/// A number beside the limit that it misses: millimetres, or as many digits more as it takes to see
/// that the two differ.
pub(crate) fn beside(value: f64, limit: f64) -> String {
    let differs = |text: &String| text.parse() != Ok(limit) && number(limit) != *text;
    (3..=MOST_DECIMALS)
        .filter_map(|decimals| rounded(value, decimals))
        .find(differs)
        .unwrap_or_else(|| {
            if (value - limit).abs() < 0.5 * limit.abs() {
                // Nearly the limit: no rounding would tell.
                format!("{value}")
            } else {
                with_exponent(value)
            }
        })
}

/// With so many decimals at most, unless that would make nothing or a row of digits of it.
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
    fn no_more_digits_than_tell_something() {
        assert_eq!(number(3.5), "3.5");
        assert_eq!(number(0.004_999_999_999_995_452_5), "0.005");
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(4.9e-8), "4.9e-8");
        assert_eq!(number(5e-324), "4.94e-324");
        assert_eq!(number(-1e300), "-1e300");
        assert_eq!(number(f64::NAN), "NaN");
    }

    #[test]
    fn a_number_differs_from_its_limit() {
        assert_eq!(beside(-0.010_921, 0.0), "-0.011");
        assert_eq!(beside(-0.000_1, 0.0), "-0.0001");
        assert_eq!(beside(-3e-7, 0.0), "-3e-7");
        assert_eq!(beside(3.000_04, 3.0), "3.00004");
        assert_eq!(beside(3.000_000_000_1, 3.0), "3.0000000001");
        assert_eq!(beside(12.5, 3.0), "12.5");
    }
}
