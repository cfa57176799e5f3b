//! Texts, numbers and dates that the rules read and print. These files of the rules are compiled once more here,
//! because compiling the whole crate for a few unit tests takes long.

use qcbus_xodr::BUNDLE;

#[expect(dead_code, reason = "only a part is tested here")]
#[path = "../../src/families/dates.rs"]
mod dates;
#[path = "../../src/families/proj_values.rs"]
mod proj_values;
#[path = "../../src/families/shown.rs"]
mod shown;
#[expect(dead_code, reason = "only a part is tested here")]
#[path = "../../src/families/written_numbers.rs"]
mod written_numbers;

use dates::is_iso_8601;
use proj_values::degrees;
use shown::{beside, number};
use written_numbers::{Written, brief, is_suspicious};

#[test]
fn degrees_are_parsed_in_proj_notation() {
    assert_eq!(degrees("11.5"), Some(11.5));
    assert_eq!(degrees("-12d30'"), Some(-12.5));
    assert_eq!(degrees("12d30'36\"W"), Some(-12.51));
    assert_eq!(degrees("9E"), Some(9.0));
    for wrong in ["48,1", "north", "", "d", "12x"] {
        assert_eq!(degrees(wrong), None, "{wrong}");
    }
}

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

#[test]
fn non_finite_spellings_are_recognised() {
    for text in ["NaN", "nan", "-nan(ind)", "1.#QNAN", "-1.#IND", " NaN "] {
        assert_eq!(Written::read(text), Some(Written::Nan), "{text}");
        assert!(is_suspicious(text.as_bytes()), "{text}");
    }
    for text in [
        "INF",
        "-INF",
        "+INF",
        "inf",
        "Infinity",
        "1.#INF",
        "-infinity",
    ] {
        assert_eq!(Written::read(text), Some(Written::Infinite), "{text}");
        assert!(is_suspicious(text.as_bytes()), "{text}");
    }
    let long = "9".repeat(400);
    for text in ["1e999", "-1E+400", long.as_str()] {
        assert_eq!(Written::read(text), Some(Written::Overflow), "{text}");
        assert!(is_suspicious(text.as_bytes()), "{text}");
    }
    for text in [
        "1e300",
        "1e9",
        "123456789",
        "1.5E+0012",
        "+100000000.5",
        "1234567e1",
        "5e+007 ",
    ] {
        assert!(is_suspicious(text.as_bytes()), "{text}");
    }
    for text in [
        "0",
        "-12.5",
        "1.0e+00",
        "3.0000000000000000e-02",
        "1e-300",
        "road",
        "none",
        "4.9e-324",
        "",
    ] {
        assert!(!is_suspicious(text.as_bytes()), "{text}");
    }
}

#[test]
fn long_numbers_are_shortened() {
    assert_eq!(brief(12.345, 1), "12.3");
    assert_eq!(brief(1.234e19, 3), "1.2e19");
    assert_eq!(written_numbers::shown(" 1.5 "), "1.5");
    assert_eq!(written_numbers::shown(&"9".repeat(400)).chars().count(), 25);
}

#[test]
fn iso_8601_dates_are_recognised() {
    for right in [
        "2024-02-29",
        "2026-01-31T12:30:00",
        "2026-01-31T12:30:00.25Z",
        "2026-01-31T12:30+01:00",
    ] {
        assert!(is_iso_8601(right), "{right}");
    }
    for wrong in [
        "2023-02-29",
        "Thu Apr 20 14:40:28 2017",
        "2026-1-31",
        "2026-01-31T24:01:00",
        "2026-01-31T12:30:00.",
        "",
    ] {
        assert!(!is_iso_8601(wrong), "{wrong}");
    }
}

#[test]
fn every_rule_row_names_a_chapter() {
    for row in include_str!("../../src/sections.tsv").lines() {
        let rule = row.split('\t').next().unwrap();
        let (name, page) = qcbus_xodr::section(rule).unwrap_or_else(|| panic!("{rule}"));
        assert!(name.len() > 30 && page.ends_with(".html"), "{name} {page}");
    }
    assert_eq!(qcbus_xodr::section("no.such_rule"), None);
}

#[test]
fn nearly_every_rule_has_a_section() {
    let rules = BUNDLE.rules.iter();
    let uids = rules.flat_map(|rule| rule.facts().uids);
    let ours = uids.filter(|uid| uid.starts_with("asam.net:xodr:"));
    let name = |uid: &&&str| uid.rsplit(':').next().unwrap().to_owned();
    let names: Vec<String> = ours.map(|uid| name(&uid)).collect();
    let without = names
        .iter()
        .filter(|name| qcbus_xodr::section(name).is_none());
    let without: Vec<&String> = without.collect();
    assert!(without.len() * 20 < names.len(), "{without:?}");
}
