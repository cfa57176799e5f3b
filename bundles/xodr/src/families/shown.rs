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
