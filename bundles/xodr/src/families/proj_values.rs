//! Parsing of numbers and angles as in PROJ.

/// Parses a finite number.
pub(crate) fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Parses degrees in the notation of PROJ: `11.5`, `-12d30'15.5"`, `9E`, `0.2r` (radians).
pub(crate) fn degrees(text: &str) -> Option<f64> {
    if let Some(degrees) = number(text) {
        return Some(degrees);
    }
    if let Some(radians) = text.strip_suffix('r').and_then(number) {
        return Some(radians.to_degrees());
    }
    let (text, sign) = match text.strip_suffix(['S', 's', 'W', 'w']) {
        Some(text) => (text, -1.0),
        None => (text.strip_suffix(['N', 'n', 'E', 'e']).unwrap_or(text), 1.0),
    };
    let sign = if text.starts_with('-') { -sign } else { sign };
    let text = text.trim_start_matches(['-', '+']);
    let mut parts = text.split(['d', 'D', '°', '\'', '"']);
    let whole = parts.next().and_then(number)?;
    let mut sum = whole;
    for (part, share) in parts.zip([60.0, 3600.0, f64::INFINITY]) {
        if !part.is_empty() {
            sum += number(part)? / share;
        }
    }
    Some(sign * sum)
}
