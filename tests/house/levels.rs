//! The page of levels, `docs/levels.md`. `QCBUS_BLESS=1` writes it.

use std::fmt::Write as _;

use qcbus_rule_tests::corpus::agrees_or_says;
use qcbus_sdk::{Bundle, Checker};

use super::root;

/// Text before the tables.
const INTRODUCTION: &str = include_str!("levels.md");

/// The bundles with the headings of their tables.
const BUNDLES: [(&str, &Bundle); 3] = [
    ("OpenDRIVE", &qcbus_xodr::BUNDLE),
    ("OpenSCENARIO XML", &qcbus_xosc::BUNDLE),
    ("Modular scenarios", &qcbus_modular::BUNDLE),
];

#[test]
fn page_of_levels_has_every_rule() {
    let mut page = INTRODUCTION.to_owned();
    for (standard, bundle) in BUNDLES {
        different(&mut page, standard, &rules(bundle));
    }
    page.push_str("\n## All rules\n");
    for (standard, bundle) in BUNDLES {
        all(&mut page, standard, &rules(bundle));
    }
    agrees_or_says(&root().join("docs/levels.md"), &page);
}

/// Returns the rules of a bundle, without the checkers of older documents.
fn rules(bundle: &Bundle) -> Vec<Checker> {
    let checkers = bundle.checkers().into_iter();
    checkers.filter(|checker| !checker.is_backport).collect()
}

/// Adds the table of the rules whose level differs from that of the standard.
fn different(page: &mut String, standard: &str, rules: &[Checker]) {
    let head = "| rule | level | with `--strict` | readers |\n|---|---|---|---|\n";
    let rows: Vec<String> = rules.iter().filter_map(difference).collect();
    if !rows.is_empty() {
        // Writing to a string cannot fail.
        let _ = write!(page, "\n### {standard}\n\n{head}{}", rows.concat());
    }
}

fn difference(rule: &Checker) -> Option<String> {
    let readers = rule.facts.readers?;
    let because = readers.because.replace('|', "\\|");
    let of_asam = rule.facts.level.as_str();
    Some(format!(
        "| `{}` | {} | {of_asam} | {because} |\n",
        name(rule),
        level(rule)
    ))
}

/// Adds the table of all rules.
fn all(page: &mut String, standard: &str, rules: &[Checker]) {
    let _ = write!(
        page,
        "\n### Rules for {standard}\n\n| rule | level | why |\n|---|---|---|\n"
    );
    for rule in rules {
        let off = match rule.facts.default_on {
            true => "",
            false => ", off",
        };
        let (name, level, why) = (name(rule), level(rule), why(rule));
        let _ = writeln!(page, "| `{name}` | {level}{off} | {why} |");
    }
}

/// Returns the name of a rule as reports show it: the last part of its UID.
fn name(rule: &Checker) -> &str {
    let uid = rule.facts.uids.first().copied().unwrap_or(rule.facts.id);
    uid.rsplit(':').next().unwrap_or(uid)
}

/// Returns the level of a rule without `--strict`.
fn level(rule: &Checker) -> &'static str {
    let of_readers = rule.facts.readers.map(|readers| readers.in_a_word());
    of_readers.unwrap_or(rule.facts.level.as_str())
}

/// Returns the first sentence of the reasons on a rule's page, else that of its introduction.
fn why(rule: &Checker) -> String {
    let (_, reasons) = rule.facts.page.split_once("\n## Why\n").unwrap_or_default();
    let paragraph = reasons
        .trim_start()
        .split("\n\n")
        .next()
        .unwrap_or_default();
    let words: Vec<&str> = match paragraph {
        "" => rule.description.split_whitespace().collect(),
        text => text.split_whitespace().collect(),
    };
    first_sentence(&words).replace('|', "\\|")
}

/// Returns the words up to the first full stop at the end of a word.
fn first_sentence(words: &[&str]) -> String {
    let ends = |word: &&str| {
        let bare = word.trim_end_matches([')', '"', '*']);
        bare.ends_with('.') && !["e.g.", "i.e."].contains(&bare)
    };
    let end = words.iter().position(ends).map_or(words.len(), |at| at + 1);
    words[..end].join(" ")
}
