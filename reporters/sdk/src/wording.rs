//! Display form of rules and numbers.

use qcbus_messages::Verdict;

/// Returns the short name of a rule: the end of its UID (`road.lane.link_order` of
/// `asam.net:xodr:1.4.0:road.lane.link_order`), which `qcbus rule` and `--select` accept. Without a
/// UID, it is the id of the checker.
pub fn rule_name<'r>(uid: &'r str, checker: &'r str) -> &'r str {
    match uid.rsplit(':').next() {
        Some(name) if !name.is_empty() => name,
        _ => checker,
    }
}

/// Returns a number of metres or seconds, rounded to the thousandth, without zeros at its end. Very
/// large numbers, which no road has, use scientific notation.
pub fn rounded(number: f64) -> String {
    if !number.is_finite() || number.abs() >= 1e9 {
        return format!("{number:e}");
    }
    let text = format!("{number:.3}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    match short {
        "-0" => "0".to_owned(),
        short => short.to_owned(),
    }
}

/// Returns a short explanation of a verdict for new users.
pub fn meaning(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Accepted => "all demanded checkers have run and found no error",
        Verdict::Rejected => "at least one error was found",
        Verdict::Undetermined => "a demanded checker could not run; the file is not accepted",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rule_name_is_end_of_its_uid() {
        assert_eq!(rule_name("asam.net:xodr:1.4.0:ids.x", "check_x"), "ids.x");
        assert_eq!(rule_name("odd", "check_x"), "odd");
        assert_eq!(rule_name("", "check_x"), "check_x");
        assert_eq!(rule_name("a:", "check_x"), "check_x");
    }

    #[test]
    fn numbers_are_rounded_to_relevant_digits() {
        for (number, text) in [
            (0.0, "0"),
            (-0.0001, "0"),
            (12.340_000_000_000_002, "12.34"),
            (690_123.456_789, "690123.457"),
            (-1.75, "-1.75"),
            (100.0, "100"),
            (1e300, "1e300"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(rounded(number), text);
        }
    }
}
