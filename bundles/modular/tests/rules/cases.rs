//! Tests of cases with known results of the reference tool. If the tool is right, the expansion has
//! the same canonical form. If it is wrong, the check for this fault fires.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use qcbus_document::{Document, Node};
use qcbus_modular::BUNDLE;
use qcbus_sdk::modular::SearchPath;
use qcbus_sdk::{Loaded, Plan, examine};
use sha2::{Digest, Sha256};

/// The checks in the order of their numbers in the list of cases.
const CHECKS: [&str; 38] = [
    "archive.main_present",
    "reference.file_found",
    "reference.extension",
    "reference.form",
    "reference.maneuver_group_known",
    "reference.cycle",
    "key.matches",
    "key.crashes_reference_tool",
    "key.path_exact",
    "key.ambiguous",
    "parameter_reference.attributes",
    "actor.entity_ref",
    "key.duplicate",
    "group_reference.duplicate",
    "scenario_reference.single",
    "scenario_reference.placement",
    "reference.unexpanded",
    "archive.member_collision",
    "reference.order_dependence",
    "group.content_dropped",
    "text.lt_in_values",
    "archive.path_safety",
    "xml.no_doctype",
    "xml.encoding",
    "result.parameters_resolved",
    "archive.unused_member",
    "result.entities_declared",
    "result.names_unique",
    "value.type",
    "value.range",
    "library.parameter_attributes_missing",
    "reference.depth",
    "result.valid_schema",
    "library.context_mismatch",
    "archive.limits",
    "result.catalogs_resolve",
    "library.default_kept",
    "library.name_with_dot",
];

/// Cases in which the expansion of the reference tool is the same, whatever else it does.
const SAME: [&str; 23] = [
    "02_value_before_key",
    "12_key_matches_nothing",
    "19_gt_amp",
    "24b_zip_slip_main_first",
    "24d_zip_slip_parent",
    "26_user_tmp_deleted",
    "35_umlaut_utf8_locale",
    "36_comments_doctype",
    "40b_nested_order_swapped",
    "46_scenario_path_semicolon",
    "51_xosc_created_by_earlier_mosc_order",
    "70_two_dotted_keys_1",
    "70_two_dotted_keys_3",
    "70_two_dotted_keys_5",
    "71_param_case",
    "74_attr_absent",
    "75_pa_spaces",
    "76_trailing_dot_key",
    "77_mg_maxexec_lost",
    "78_modular_two_actors",
    "79_param_undeclared_after_compose",
    "80_unused_member",
    "81_dup_zip_entry",
];

/// A case with the platform's separator in a search path. It is accepted as well as `;`, so the
/// file is found.
const FOUND_HERE: &str = "45_scenario_path_colon";

fn cases() -> Option<PathBuf> {
    let cases = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/cases"
    ));
    let there = cases.join("modular-cases.json").is_file();
    if !there {
        println!("skipped: {} is not here", cases.display());
    }
    there.then(|| cases.to_path_buf())
}

/// A case with an archive: its name and the expected results.
struct Case {
    name: String,
    folder: PathBuf,
    canonical: Option<String>,
    checks: Vec<&'static str>,
}

fn list(cases: &Path) -> Vec<Case> {
    let text = std::fs::read_to_string(cases.join("modular-cases.json")).unwrap();
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let case = |case: &serde_json::Value| {
        let name = case["case"].as_str()?.rsplit('/').next()?.to_owned();
        let folder = cases.join("modular").join(&name);
        let should = case["checker_should"].as_str().unwrap_or("");
        let numbers = should.split("MOD-").skip(1);
        let checks = numbers.filter_map(|rest| {
            let number: usize = rest.get(..3)?.parse().ok()?;
            CHECKS.get(number - 1).copied()
        });
        folder.join("in.mosc").is_file().then(|| Case {
            canonical: case["actual"]["canonical_sha256"]
                .as_str()
                .map(str::to_owned),
            checks: checks.collect(),
            name,
            folder: folder.clone(),
        })
    };
    all["cases"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(case)
        .collect()
}

fn load(case: &Case) -> Loaded {
    let path = match case.name.as_str() {
        "42_self_cwd_env" => ".",
        FOUND_HERE => "nowhere:lib",
        _ => "nowhere;lib",
    };
    let search = SearchPath::parse(OsStr::new(path), &case.folder);
    Loaded::searching(&case.folder.join("in.mosc"), &case.folder, &search).unwrap()
}

/// Returns the expansion, if there is one.
fn expanded(loaded: &Loaded) -> Option<String> {
    let subject = loaded.subject(&BUNDLE).unwrap();
    let expansion = subject.expansion();
    let whole = expansion.is_complete() && expansion.pieces[0].document.root().is_some();
    whole.then(|| expansion.text())
}

#[test]
fn expansion_equals_reference_tool_where_it_is_right() {
    let Some(cases) = cases() else { return };
    let mut seen = 0;
    for case in list(&cases) {
        let text = expanded(&load(&case));
        let same = text.as_deref().map(digest) == case.canonical;
        if SAME.contains(&case.name.as_str()) {
            assert!(same, "{}: {text:?}", case.name);
            seen += 1;
        } else {
            assert!(
                !same || text.is_none(),
                "{} must still differ from the recorded expansion",
                case.name
            );
        }
    }
    assert_eq!(seen, SAME.len());
}

#[test]
fn named_check_fires_where_reference_tool_is_wrong() {
    let Some(cases) = cases() else { return };
    let plan = Plan::by_default(&BUNDLE);
    let mut silent = Vec::new();
    for case in list(&cases) {
        let outcome = examine(&plan, &load(&case)).unwrap();
        let issues = outcome.checkers.iter().flat_map(|checker| &checker.issues);
        let fired: BTreeSet<&str> = issues.map(|issue| &*issue.rule_uid).collect();
        let checks = case.checks.iter().filter(|_| case.name != FOUND_HERE);
        for check in checks {
            let uid = format!("qcbus.dev:mosc:1.0.0:{check}");
            if !fired.contains(uid.as_str()) {
                silent.push(format!("{}: {check}, only {fired:?}", case.name));
            }
        }
    }
    assert!(silent.is_empty(), "{silent:#?}");
}

#[test]
fn every_listed_check_is_a_rule() {
    let uids: BTreeSet<String> = BUNDLE
        .rules
        .iter()
        .flat_map(|rule| rule.facts().uids.iter().map(|uid| (*uid).to_owned()))
        .collect();
    let listed = CHECKS.map(|check| format!("qcbus.dev:mosc:1.0.0:{check}"));
    assert_eq!(uids, BTreeSet::from(listed));
}

/// Returns the SHA-256 of the canonical form. It has no comments, no instructions and no blanks at
/// the ends of text. Attributes are sorted, and all elements have end tags.
fn digest(text: &str) -> String {
    let prepared = qcbus_ingest::prepare_bytes(
        Path::new("/x.xosc"),
        text.to_owned().into_bytes(),
        &qcbus_ingest::Limits::default(),
    );
    let image = prepared.build();
    let document = Document::open(&image).unwrap();
    let mut out = String::new();
    canonical(
        document.root().unwrap_or_else(|| panic!("no root")),
        &mut out,
    );
    Sha256::digest(out.as_bytes())
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn canonical(node: Node<'_>, out: &mut String) {
    let escaped = |value: &str, attribute: bool| {
        let value = value
            .replace('&', "&amp;")
            .replace('<', "&lt;")
            .replace('\r', "&#xD;");
        match attribute {
            true => value
                .replace('"', "&quot;")
                .replace('\t', "&#x9;")
                .replace('\n', "&#xA;"),
            false => value.replace('>', "&gt;"),
        }
    };
    out.push_str(&format!("<{}", node.name()));
    let mut attributes: Vec<_> = node
        .attributes()
        .map(|it| (it.name(), it.value()))
        .collect();
    attributes.sort_unstable();
    for (name, value) in attributes {
        out.push_str(&format!(" {name}=\"{}\"", escaped(value, true)));
    }
    out.push('>');
    let document = node.document();
    let mut run = String::new();
    let mut next = node.index() + 1;
    while next < node.subtree_end() {
        let Some(child) = document.node(next) else {
            break;
        };
        if child.is_element() {
            out.push_str(&escaped(run.trim(), false));
            run.clear();
            canonical(child, out);
        } else {
            run.push_str(child.character_run());
        }
        next = child.subtree_end();
    }
    out.push_str(&escaped(run.trim(), false));
    out.push_str(&format!("</{}>", node.name()));
}
