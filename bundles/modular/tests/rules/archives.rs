//! Tests of archives and files as bytes, which pages cannot show: byte order marks, damage, names
//! that a packer refuses, and faults that must be reported only once.

#![expect(
    clippy::needless_pass_by_value,
    reason = "test helpers take their arguments by value"
)]

use std::path::{Path, PathBuf};

use qcbus_sdk::modular::pack;
use qcbus_sdk::{Level, Loaded, Plan, examine};

/// Names and bytes.
type Files = Vec<(String, Vec<u8>)>;

fn file(name: &str, bytes: impl Into<Vec<u8>>) -> (String, Vec<u8>) {
    (name.to_owned(), bytes.into())
}

fn archive(name: &str, members: Files) -> (String, Vec<u8>) {
    file(name, pack(&members).unwrap())
}

/// Returns a scenario with one group for each of these references: file, group.
fn main(references: &[(&str, &str)]) -> String {
    let mut groups = String::new();
    for (index, (file, group)) in references.iter().enumerate() {
        groups.push_str(&format!(
            "<ManeuverGroup name=\"M{index}\" maximumExecutionCount=\"1\">\
             <Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Ego\"/></Actors>\
             <ScenarioReference scenarioFileName=\"{file}\">\
             <ManeuverGroupReference maneuverGroupName=\"{group}\"/></ScenarioReference></ManeuverGroup>"
        ));
    }
    scenario(&groups)
}

fn library() -> String {
    scenario(
        "<ManeuverGroup name=\"Drive\" maximumExecutionCount=\"1\">\
         <Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Veh\"/></Actors></ManeuverGroup>",
    )
}

fn scenario(groups: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenSCENARIO>\
         <FileHeader revMajor=\"1\" revMinor=\"0\" date=\"2026-01-01T00:00:00\" description=\"d\" author=\"a\"/>\
         <Storyboard><Story name=\"S\"><Act name=\"A\">{groups}</Act></Story></Storyboard></OpenSCENARIO>"
    )
}

/// Writes files into a folder of this test. Returns the findings in the first file of the rules
/// about files, archives and references.
fn found(test: &str, files: Files) -> Vec<String> {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    for (name, bytes) in &files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    said(&folder.join(&files[0].0))
}

fn said(path: &Path) -> Vec<String> {
    let loaded = Loaded::from_path(path, path.parent().unwrap()).unwrap();
    let outcome = examine(&Plan::by_default(&qcbus_modular::BUNDLE), &loaded).unwrap();
    let mut all = Vec::new();
    for checker in &outcome.checkers {
        let rule = checker.id.trim_start_matches("check_qcbus_mosc_");
        let ours = ["archive_", "xml_"].iter().any(|set| rule.starts_with(set));
        let references = [
            "reference_file_found",
            "reference_depth",
            "reference_order_dependence",
        ];
        if !ours && !references.contains(&rule) {
            continue;
        }
        for issue in &checker.issues {
            let level = match issue.level {
                Level::Error => "error",
                Level::Warning => "warning",
                Level::Information => "information",
            };
            all.push(format!("{level} {rule}: {}", issue.description));
        }
    }
    all
}

/// Asserts that each finding starts with the expected rule and contains the expected text.
#[track_caller]
fn expect(found: &[String], expected: &[(&str, &str)]) {
    let fits = found.len() == expected.len()
        && found.iter().zip(expected).all(|(said, (rule, piece))| {
            said.starts_with(&format!("{rule}: ")) && said.contains(piece)
        });
    assert!(fits, "found {found:#?}\nexpected {expected:#?}");
}

#[test]
fn plain_archive_has_no_findings() {
    let members = vec![
        file("main.xosc", main(&[("library.xosc", "Drive")])),
        file("library.xosc", library()),
    ];
    expect(&found("plain", vec![archive("a.mosc", members)]), &[]);
}

#[test]
fn byte_order_mark_is_reported_once_per_file() {
    let mark = |text: String| format!("\u{FEFF}{text}");
    let utf16: Vec<u8> = library()
        .replace("UTF-8", "UTF-16")
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    let utf16 = [&b"\xFF\xFE"[..], &utf16].concat();
    let references = [
        ("marked.xosc", "Drive"),
        ("wide.xosc", "Drive"),
        ("wider.xosc", "Drive"),
    ];
    let members = vec![
        file("main.xosc", mark(main(&references))),
        file("marked.xosc", mark(library())),
        file("wide.xosc", utf16.clone()),
        file("wider.xosc", utf16),
    ];
    expect(
        &found("marks", vec![archive("a.mosc", members)]),
        &[
            ("warning xml_encoding", "`a.mosc!main.xosc` begins"),
            ("warning xml_encoding", "`a.mosc!marked.xosc` begins"),
            (
                "warning xml_encoding",
                "`a.mosc!wide.xosc`: the file is in UTF-16LE",
            ),
            (
                "warning xml_encoding",
                "`a.mosc!wider.xosc`: the file is in UTF-16LE",
            ),
        ],
    );
}

#[test]
fn invalid_archive_is_reported_at_its_reference() {
    let root = file("main.xosc", main(&[("library.mosc", "Drive")]));
    let broken = file("library.mosc", "no archive");
    expect(
        &found("none", vec![root.clone(), broken.clone()]),
        &[(
            "error archive_main_present",
            "`library.mosc`: the file is not a zip archive",
        )],
    );
    expect(
        &found("none_itself", vec![broken]),
        &[(
            "error archive_main_present",
            "`library.mosc`: the file is not a zip archive",
        )],
    );
    let (name, mut bytes) = archive("library.mosc", vec![file("main.xosc", library())]);
    bytes.truncate(bytes.len() - 10);
    expect(
        &found("cut", vec![root, (name, bytes)]),
        &[("error archive_main_present", "cannot be read")],
    );
}

#[test]
fn non_scenario_library_is_reported_by_single_rule() {
    let root = || file("main.xosc", main(&[("library.xosc", "Drive")]));
    for (test, text) in [("ill_formed", "<OpenSCENARIO>"), ("a_map", "<OpenDRIVE/>")] {
        expect(
            &found(test, vec![root(), file("library.xosc", text)]),
            &[("error reference_file_found", "library.xosc")],
        );
    }
    let (_, zip) = archive("library.xosc", vec![file("main.xosc", library())]);
    expect(
        &found("zip_as_xosc", vec![root(), file("library.xosc", zip)]),
        &[(
            "error reference_file_found",
            "modular scenarios end in .mosc",
        )],
    );
}

#[test]
fn ill_formed_main_scenario_is_left_to_scenario_bundle() {
    let text = main(&[("library.xosc", "Drive")]).replace("</Story>", "");
    let files = vec![file("main.xosc", text), file("library.xosc", library())];
    expect(&found("root_ill_formed", files), &[]);
}

#[test]
fn reason_for_missing_file_is_reported() {
    let name = "https://example.org/library.xosc";
    expect(
        &found("remote", vec![file("main.xosc", main(&[(name, "Drive")]))]),
        &[(
            "error reference_file_found",
            "nothing is fetched from the network",
        )],
    );
    let files = vec![
        file("main.xosc", main(&[("folder.xosc", "Drive")])),
        file("folder.xosc/x", ""),
    ];
    expect(
        &found("folder", files),
        &[("error reference_file_found", "`folder.xosc` is a directory")],
    );
}

#[test]
fn duplicate_member_names_are_reported_once_per_archive() {
    let members = vec![
        file("main.xosc", main(&[("aa.xosc", "Drive")])),
        file("aa.xosc", library()),
        file("ab.xosc", library()),
    ];
    let (name, mut bytes) = archive("a.mosc", members);
    for at in 0..bytes.len() {
        if bytes[at..].starts_with(b"ab.xosc") {
            bytes[at + 1] = b'a';
        }
    }
    expect(
        &found("twice", vec![(name, bytes)]),
        &[("error archive_path_safety", "the same name, `aa.xosc`")],
    );
}

#[test]
fn escaping_member_names_are_not_also_reported_as_unused() {
    for (test, name, what) in [
        ("up", "../x.xosc", "points outside the archive"),
        (
            "up_back",
            "..\\x.xosc",
            "`..\\x.xosc` points outside the archive",
        ),
        ("root", "/x.xosc", "points outside the archive"),
        ("drive", "C:x.xosc", "points outside the archive"),
        (
            "back",
            "a\\x.xosc",
            "`a\\x.xosc` has a backslash in its name",
        ),
        ("control", "../\tx", "`../\\tx` points outside the archive"),
    ] {
        let members = vec![file("main.xosc", library()), file(name, library())];
        expect(
            &found(test, vec![archive("a.mosc", members)]),
            &[("error archive_path_safety", what)],
        );
    }
}

#[test]
fn bare_doctype_is_information_and_commented_out_is_ignored() {
    let with =
        |before: &str| library().replace("<OpenSCENARIO>", &format!("{before}<OpenSCENARIO>"));
    let bare = "<!DOCTYPE OpenSCENARIO>";
    for (test, before, expected) in [
        (
            "doctype_bare",
            bare,
            &[("information xml_no_doctype", "it is harmless")][..],
        ),
        (
            "doctype_comment",
            "<!-- <!DOCTYPE x> --><?p <!DOCTYPE x>?>",
            &[],
        ),
        (
            "doctype_full",
            "<!DOCTYPE OpenSCENARIO [<!ENTITY a \"b\">]>",
            &[("error xml_no_doctype", "is refused")],
        ),
    ] {
        let members = vec![file("main.xosc", with(before))];
        expect(&found(test, vec![archive("a.mosc", members)]), expected);
    }
}

/// Returns `outer.mosc` with a library and `inner.mosc`, to which it refers and which has another
/// file.
fn nested(inner: (String, Vec<u8>)) -> Files {
    let uses_inner = main(&[(inner.0.as_str(), "Drive")]);
    let of_inner = vec![file("main.xosc", uses_inner), inner];
    let references = [("inner.mosc", "M0.Drive"), ("library.xosc", "Drive")];
    let members = vec![
        file("main.xosc", main(&references)),
        file("library.xosc", library()),
        archive("inner.mosc", of_inner),
    ];
    vec![archive("outer.mosc", members)]
}

#[test]
fn same_named_members_with_different_content_collide() {
    expect(
        &found("alike", nested(file("library.xosc", library()))),
        &[],
    );
    expect(
        &found("apart", nested(file("other.xosc", library() + " "))),
        &[],
    );
    expect(
        &found("collide", nested(file("library.xosc", library() + " "))),
        &[(
            "error archive_member_collision",
            "`outer.mosc` and, with other content, in `outer.mosc!inner.mosc`",
        )],
    );
}

#[test]
fn outer_member_used_by_inner_archive_counts_as_used() {
    let inner = vec![file("main.xosc", main(&[("library.xosc", "Drive")]))];
    let members = vec![
        file("main.xosc", main(&[("inner.mosc", "M0.Drive")])),
        file("library.xosc", library()),
        archive("inner.mosc", inner),
        archive("never.mosc", vec![file("main.xosc", library())]),
    ];
    expect(
        &found("outward", vec![archive("a.mosc", members)]),
        &[(
            "information archive_unused_member",
            "`never.mosc` of `a.mosc`",
        )],
    );
}

/// Returns a chain of this number of references.
fn chain(length: usize) -> Files {
    let mut files = Vec::new();
    let mut group = "Drive".to_owned();
    for level in (1..length).rev() {
        files.push(file(
            &format!("l{level}.xosc"),
            main(&[(&format!("l{}.xosc", level + 1), &group)]),
        ));
        group = format!("M0.{group}");
    }
    files.push(file("main.xosc", main(&[("l1.xosc", &group)])));
    files.reverse();
    files.push(file(&format!("l{length}.xosc"), library()));
    files
}

#[test]
fn reference_depth_is_counted_in_references() {
    expect(&found("depth_8", chain(8)), &[]);
    expect(
        &found("depth_9", chain(9)),
        &[("warning reference_depth", "9 deep from here")],
    );
    expect(
        &found("depth_32", chain(32)),
        &[("warning reference_depth", "32 deep from here")],
    );
    expect(
        &found("depth_33", chain(33)),
        &[("error reference_depth", "more than 32 deep")],
    );
}

#[test]
fn upward_or_backslash_reference_cannot_be_packed() {
    let files = vec![
        file(
            "s/main.xosc",
            main(&[("../library.xosc", "Drive"), ("sub\\library.xosc", "Drive")]),
        ),
        file("library.xosc", library()),
        file("s/sub/library.xosc", library()),
    ];
    expect(
        &found("upwards", files),
        &[
            (
                "warning archive_path_safety",
                "`../library.xosc` cannot be packed",
            ),
            (
                "warning archive_path_safety",
                "`sub\\library.xosc` cannot be packed",
            ),
        ],
    );
}
