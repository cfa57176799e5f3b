//! Tests shadows on a running broker: they check every file and report what they would change, but
//! change nothing.

use std::path::Path;

use crate::support::content::Content;
use crate::support::farm::{Farm, tail, zoo};
use crate::support::programs::told;
use crate::support::watchdog::until_or;
use qcbus_formats::xqar;
use qcbus_messages::Verdict;

const STRICT: &str = "judges_strictly";

fn bundle(farm: &Farm, words: &[&str]) -> (Option<i32>, String) {
    told(&farm.qcbus(&[&["bundle"], words].concat()))
}

/// Adds the zoo bundle that rejects a word, as a shadow.
fn add_strict(farm: &Farm) {
    let zoo = zoo();
    let zoo = zoo.to_str().unwrap();
    let (code, text) = bundle(farm, &["add", "--shadow", STRICT, zoo, STRICT]);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("a shadow and does not affect verdicts"),
        "{text}"
    );
}

/// Returns the report on the trials, once `tried` files are tried and none is waiting.
fn trials(farm: &Farm, name: &str, tried: u64) -> (Option<i32>, serde_json::Value) {
    until_or(
        "everything is tried",
        || {
            let (code, text) = bundle(farm, &["trials", name, "--json"]);
            let told: serde_json::Value = serde_json::from_str(&text).ok()?;
            let counts = &told["counts"];
            (counts["waiting"] == 0 && counts["tried"] == tried).then_some((code, told))
        },
        || tail(&farm.log()),
    )
}

fn names(results: &xqar::Results) -> Vec<String> {
    results
        .bundles
        .iter()
        .map(|it| it.name.to_string())
        .collect()
}

#[test]
fn shadow_reports_its_effect_and_changes_no_verdict() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    farm.write("before.xodr", &Content::Marked(1).bytes());
    farm.write("wrong.xodr", &Content::NoHeader(2).bytes());
    farm.settle(2);
    add_strict(&farm);
    farm.write("after.xodr", &Content::Marked(3).bytes());
    farm.write("clean.xodr", &Content::Good(4).bytes());
    farm.settle(4);
    let verdict = |name: &str| farm.verdict(name).verdict;
    for name in ["before.xodr", "after.xodr", "clean.xodr"] {
        assert_eq!(verdict(name), Verdict::Accepted, "{name}");
        assert!(
            !names(&farm.result(name)).contains(&STRICT.to_owned()),
            "{name}"
        );
    }
    let epoch = farm.status().unwrap().epoch;
    let (code, told) = trials(&farm, STRICT, 4);
    assert_eq!(code, Some(1), "a file would be rejected: {told}");
    let counts = &told["counts"];
    assert_eq!(
        (&counts["tried"], &counts["would_reject"]),
        (&4.into(), &2.into()),
        "{told}"
    );
    for trial in told["trials"].as_array().unwrap().iter().take(2) {
        assert_eq!(trial["would"], "rejected", "{told}");
        // The findings of the shadow are stored as a separate result.
        let path = trial["result"].as_str().unwrap();
        let results = xqar::read(&std::fs::read(path).unwrap()).unwrap();
        assert!(names(&results).contains(&STRICT.to_owned()), "{path}");
    }
    let (_, text) = bundle(&farm, &["trials", STRICT]);
    assert!(
        text.contains("after.xodr: accepted, would be rejected (1 error)"),
        "{text}"
    );
    assert!(
        text.ends_with("4 of 4 files tried, 2 would be rejected\n"),
        "{text}"
    );
    let (_, text) = told_status(&farm);
    assert!(text.contains("a shadow, ready"), "{text}");
    assert_eq!(
        farm.status().unwrap().epoch,
        epoch,
        "no other bundle is required"
    );

    let (code, text) = bundle(&farm, &["upgrade", STRICT, "--no-shadow"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("it affects verdicts from now on"), "{text}");
    assert_eq!(verdict("before.xodr"), Verdict::Rejected);
    assert_eq!(verdict("clean.xodr"), Verdict::Accepted);
    let (code, text) = bundle(&farm, &["trials", STRICT]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("is not a shadow here"), "{text}");

    let (code, text) = bundle(&farm, &["upgrade", STRICT, "--shadow"]);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(verdict("before.xodr"), Verdict::Accepted);
    assert_eq!(trials(&farm, STRICT, 4).1["counts"]["would_reject"], 2);
}

fn told_status(farm: &Farm) -> (Option<i32>, String) {
    told(&farm.qcbus(&["status"]))
}

#[test]
fn failing_shadows_are_reported_and_delay_no_verdict() {
    let farm = Farm::with(&[
        "--silence-limit",
        "4s",
        "--job-deadline",
        "6s",
        "--max-restarts",
        "2",
        "--memory-limit",
        "1024",
    ]);
    let _broker = farm.serve_ready();
    let animals = [
        "dies_on_every_job",
        "floods_issues",
        "floods_with_huge_messages",
        "hangs_in_a_job",
        "lies_about_job_id",
        "sends_garbage",
        "stops_reading",
        "never_the_same",
    ];
    for animal in animals {
        farm.let_in_as_shadow(animal, "");
    }
    for number in 0..8 {
        farm.write(&format!("{number}.xodr"), &Content::Good(number).bytes());
    }
    farm.write("wrong.xodr", &Content::NoHeader(9).bytes());
    for number in 0..8 {
        let name = format!("{number}.xodr");
        assert_eq!(farm.verdict(&name).verdict, Verdict::Accepted, "{name}");
        let judged = names(&farm.result(&name));
        assert!(
            !judged.iter().any(|it| animals.contains(&it.as_str())),
            "{judged:?}"
        );
    }
    assert_eq!(farm.verdict("wrong.xodr").verdict, Verdict::Rejected);
    // The death of a shadow during a job must be recorded.
    until_or(
        "it has died with a file twice",
        || {
            let (_, text) = bundle(&farm, &["trials", "dies_on_every_job"]);
            text.contains("on which it failed").then_some(())
        },
        || tail(&farm.log()),
    );
}

#[test]
fn shadow_named_by_a_configuration_is_not_missing() {
    let mut farm = Farm::new();
    let config = farm.base().join("config.xml");
    std::fs::write(
        &config,
        format!("<Config><CheckerBundle application=\"xodrBundle\"/><CheckerBundle application=\"{STRICT}\"/></Config>"),
    )
    .unwrap();
    farm.arguments
        .extend(["-c".to_owned(), config.display().to_string()]);
    farm.let_in_as_shadow(STRICT, "");
    let _broker = farm.serve_ready();
    farm.write("a.xodr", &Content::Marked(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    assert_eq!(trials(&farm, STRICT, 1).1["counts"]["would_reject"], 1);
    let (_, text) = told_status(&farm);
    assert!(
        text.contains("which is a shadow"),
        "the status names the shadow: {text}"
    );
    // After the removal it is a required bundle that is missing.
    farm.send_away(STRICT);
    until_or(
        "it is missed",
        || (farm.verdict("a.xodr").verdict == Verdict::Undetermined).then_some(()),
        || tail(&farm.log()),
    );
}

#[test]
fn check_skips_shadows_and_reports_this() {
    let farm = Farm::new();
    farm.let_in_as_shadow(STRICT, "");
    farm.write("a.xodr", &Content::Marked(1).bytes());
    let (directory, file) = (farm.bundles_d(), farm.root().join("a.xodr"));
    let shown = |path: &Path| path.to_str().unwrap().to_owned();
    let (code, text) = told(&farm.qcbus(&[
        "check",
        &shown(&file),
        "--bundles-d",
        &shown(&directory),
        "--out",
        &shown(&farm.base().join("run")),
    ]));
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("is a shadow: it is not used in a run"),
        "{text}"
    );
}

#[test]
fn every_file_is_tried_again_after_a_restart() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    farm.write("a.xodr", &Content::Marked(1).bytes());
    add_strict(&farm);
    assert_eq!(trials(&farm, STRICT, 1).1["counts"]["would_reject"], 1);
    drop(broker);
    let _broker = farm.serve_ready();
    assert_eq!(trials(&farm, STRICT, 1).1["counts"]["would_reject"], 1);
    farm.settle(1);
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
}
