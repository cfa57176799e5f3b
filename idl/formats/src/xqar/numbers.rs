//! Conversion between doubles and text.

/// Returns the shortest text that reads back as the same double. `NaN`, `INF`, `-INF` are written
/// as in XML Schema. Very large and very small numbers have an exponent.
pub(super) fn write(value: f64) -> String {
    if value.is_nan() {
        return String::from("NaN");
    }
    if value.is_infinite() {
        return String::from(if value > 0.0 { "INF" } else { "-INF" });
    }
    let size = value.abs();
    if size == 0.0 || (1e-5..1e16).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Reads the output of [`write()`], of C++ and of Python.
pub(super) fn read(text: &str) -> Option<f64> {
    match text.trim() {
        "INF" | "+INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        other => other.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_is_written_as_shortest_text_that_reads_back() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "-0"),
            (0.1, "0.1"),
            (1571.3260652726844, "1571.3260652726844"),
            (1e-9, "1e-9"),
            (1e15, "1000000000000000"),
            (1e300, "1e300"),
            (f64::NEG_INFINITY, "-INF"),
        ] {
            assert_eq!(write(value), text);
            assert_eq!(read(text).map(f64::to_bits), Some(value.to_bits()));
        }
        assert_eq!(write(f64::NAN), "NaN");
        assert_eq!(read(" 1.5E+3 "), Some(1500.0));
        assert_eq!(read("1,5"), None);
    }
}
