//! Tests that one misbehaving bundle or reporter beside the standard bundles harms only itself.

#![allow(
    missing_docs,
    reason = "this is all test code, including functions without `#[test]`"
)]

use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::judge::{Files, judge};
use crate::support::processes::{peak_private_kib, private_kib};
use crate::support::watchdog::{until_or, until_so};
use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;

/// Limits that reveal misbehaviour soon, but leave a busy machine enough time.
const IMPATIENT: &[&str] = &[
    "--silence-limit",
    "4s",
    "--job-deadline",
    "6s",
    "--max-restarts",
    "2",
    "--memory-limit",
    "1024",
];

/// Limits for bundles that are detected by their messages: 90 MiB for each job, which take time on
/// a busy machine. The deadlines are the defaults of the product.
const PATIENT: &[&str] = &["--max-restarts", "2", "--memory-limit", "1024"];

/// Maximum private memory of the broker in KiB: far above its need, far below the size of a flood.
const BROKER_KIB: u64 = 1 << 20;

/// Maximum private memory of the broker in KiB beside a bundle that reports 16 MiB about every
/// file.
const FLOODED_KIB: u64 = 512 << 10;

fn some_files(farm: &Farm) -> Files {
    let contents = [
        Content::Good(1),
        Content::NoHeader(2),
        Content::NoVersion(3),
        Content::WrongRoot(4),
        Content::Good(5),
        Content::Torn(b"<OpenDRIVE>".to_vec()),
    ];
    let named = contents.into_iter().enumerate();
    let files: Files = named
        .map(|(at, content)| (format!("{at}.xodr"), content))
        .collect();
    for (name, content) in &files {
        farm.write(name, &content.bytes());
    }
    files
}

/// Serves a farm with a misbehaving bundle or reporter, and checks the conditions that must hold
/// beside all of them.
fn beside(animal: &str, reason: &str) -> (Farm, Broker) {
    beside_within(IMPATIENT, animal, reason)
}

/// Does the same with these limits.
fn beside_within(limits: &[&str], animal: &str, reason: &str) -> (Farm, Broker) {
    let farm = Farm::with(limits);
    let broker = farm.serve_ready();
    farm.let_in(animal, "");
    until_or(
        "the animal has been seen",
        || is_known(&farm, animal),
        || farm.log(),
    );
    let mut files = some_files(&farm);
    farm.settle(files.len());
    // A new file is judged while the misbehaving bundle is still there.
    let fresh = Content::Good(99);
    farm.write("fresh.xodr", &fresh.bytes());
    files.insert("fresh.xodr".to_owned(), fresh);
    farm.verdict("fresh.xodr");
    farm.settle(files.len());
    judge(&farm, &files, &[animal]).demand(&tail(&farm.log()));
    if !reason.is_empty() {
        let reasons = reasons_of(&farm, "0.xodr", animal);
        assert!(reasons.iter().all(|it| it.contains(reason)), "{reasons:#?}");
        assert_eq!(farm.verdict("0.xodr").verdict, Verdict::Undetermined);
        assert!(
            !reasons.is_empty(),
            "its checkers are listed\n{}",
            tail(&farm.log())
        );
    }
    let memory = private_kib(broker.pid()).unwrap();
    assert!(memory < BROKER_KIB, "the broker holds {memory} KiB");
    (farm, broker)
}

fn is_known(farm: &Farm, animal: &str) -> Option<()> {
    let status = farm.status()?;
    let named =
        |it: &qcbus_messages::control::PeerStatus| it.name == animal && it.state != "starting";
    let told = |notice: &qcbus_messages::control::NoticeStatus| {
        notice.kind != "loading" && notice.text.contains(animal)
    };
    (status.peers.iter().any(named) || status.notices.iter().any(told)).then_some(())
}

/// Returns the reasons why checkers of the misbehaving bundle failed on a file.
fn reasons_of(farm: &Farm, name: &str, animal: &str) -> Vec<String> {
    let results = farm.result(name);
    let bundles = results
        .bundles
        .iter()
        .filter(|bundle| bundle.name == animal);
    let failed = bundles.flat_map(|bundle| &bundle.checkers);
    let failed = failed.filter(|checker| checker.status == Some(Status::Error));
    failed.map(|checker| checker.summary.to_string()).collect()
}

fn notices(farm: &Farm) -> String {
    farm.status()
        .map(|status| {
            status
                .notices
                .iter()
                .map(|it| format!("{}\n", it.text))
                .collect()
        })
        .unwrap_or_default()
}

#[test]
fn hangs_after_hello() {
    let (farm, _broker) = beside("hangs_after_hello", "");
    until_so("it is told apart from those who answer", || {
        notices(&farm).contains("hangs_after_hello: it joined but did not register its checkers")
    });
    assert_eq!(
        farm.verdict("0.xodr").verdict,
        Verdict::Undetermined,
        "its manifest makes it required"
    );
}

#[test]
fn hangs_in_a_job() {
    beside("hangs_in_a_job", "hangs_in_a_job");
}

#[test]
fn floods_issues() {
    let (farm, broker) = beside_within(PATIENT, "floods_issues", "");
    let reasons = reasons_of(&farm, "0.xodr", "floods_issues");
    assert!(
        reasons.iter().any(|it| it.contains("were dropped")),
        "{reasons:#?}"
    );
    // Many floods at once use no more memory of the broker than a few, because waiting jobs stay in
    // the queue.
    for at in 0..40 {
        farm.write(&format!("many{at}.xodr"), &Content::Good(at).bytes());
    }
    farm.settle(47);
    let peak = peak_private_kib(broker.pid()).unwrap();
    assert!(peak < FLOODED_KIB, "the broker held {peak} KiB");
}

/// Maximum size of a result in bytes beside a bundle that reports far too much. None of its data is
/// kept.
const RESULT_BYTES: u64 = 1 << 20;

fn results_are_small(farm: &Farm) {
    let result = farm.verdict("0.xodr").xqar;
    let bytes = result.metadata().unwrap().len();
    assert!(bytes < RESULT_BYTES, "the result has {bytes} bytes");
}

#[test]
fn floods_metadata() {
    let reason = "too many parameters and metadata: they take 3145";
    let (farm, broker) = beside_within(PATIENT, "floods_metadata", reason);
    results_are_small(&farm);
    let peak = peak_private_kib(broker.pid()).unwrap();
    assert!(peak < FLOODED_KIB, "the broker held {peak} KiB");
}

#[test]
fn floods_with_huge_messages() {
    let reason = "at most 4194304 are allowed";
    let (farm, broker) = beside_within(
        PATIENT,
        "floods_with_huge_messages",
        "floods_with_huge_messages",
    );
    let reasons = reasons_of(&farm, "0.xodr", "floods_with_huge_messages");
    let said = format!("{reasons:#?}{}", notices(&farm));
    assert!(said.contains(reason), "{said}");
    results_are_small(&farm);
    let peak = peak_private_kib(broker.pid()).unwrap();
    assert!(peak < FLOODED_KIB, "the broker held {peak} KiB");
}

#[test]
fn never_the_same() {
    let (farm, _broker) = beside("never_the_same", "");
    let status = farm.status().unwrap();
    let flapping = status.notices.iter().filter(|it| it.kind == "flapping");
    assert!(flapping.count() > 0, "{:#?}", status.notices);
    // Each accepted change starts an epoch. Of hundreds of changes, only the forgiven ones and a
    // few later ones are accepted.
    let epochs = status.epoch & 0xffff_ffff;
    assert!(epochs < 40, "{epochs} epochs");
}

#[test]
fn dies_on_every_job() {
    let (farm, _broker) = beside("dies_on_every_job", "dies_on_every_job");
    assert!(notices(&farm).contains("dies_on_every_job"));
}

#[test]
fn lies_about_job_id() {
    // A false job id may by chance be one of its own jobs. That job is then "done" without any
    // result.
    let (farm, _broker) = beside("lies_about_job_id", "");
    assert!(!reasons_of(&farm, "0.xodr", "lies_about_job_id").is_empty());
    until_so("it is said", || {
        notices(&farm).contains("it refers to jobs or checkers")
    });
}

#[test]
fn never_acknowledges() {
    beside("never_acknowledges", "never_acknowledges");
}

#[test]
fn sends_garbage() {
    beside("sends_garbage", "sends_garbage");
}

#[test]
fn stops_reading() {
    beside("stops_reading", "stops_reading");
}

#[test]
fn allocates_forever() {
    beside("allocates_forever", "allocates_forever");
}

#[test]
fn reporter_that_never_acknowledges_is_reported() {
    let (farm, _broker) = beside("reporter_never_acknowledges", "");
    until_so("it is said", || {
        notices(&farm).contains("reporter_never_acknowledges: it does not acknowledge results")
    });
    assert_eq!(farm.verdict("0.xodr").verdict, Verdict::Accepted);
}

#[test]
fn another_protocol_is_refused_with_both_versions() {
    let (farm, _broker) = beside("speaks_another_protocol", "");
    until_so("it is said", || notices(&farm).contains("uses protocol"));
    assert_eq!(
        farm.verdict("0.xodr").verdict,
        Verdict::Undetermined,
        "its manifest makes it required"
    );
}

#[test]
fn slow_bundle_loses_no_file() {
    let farm = Farm::with(&["--silence-limit", "20s"]);
    let _broker = farm.serve_ready();
    farm.let_in("slow", "--millis 20");
    until_or("it is ready", || is_known(&farm, "slow"), || farm.log());
    let mut files = Files::new();
    for number in 0..60 {
        let content = Content::Good(number);
        farm.write(&format!("{number}.xodr"), &content.bytes());
        files.insert(format!("{number}.xodr"), content);
    }
    farm.settle(files.len());
    judge(&farm, &files, &[]).demand(&tail(&farm.log()));
    assert!(
        farm.result("7.xodr")
            .bundles
            .iter()
            .any(|bundle| bundle.name == "slow")
    );
}

#[test]
fn only_the_harmful_file_is_undetermined() {
    let farm = Farm::with(&["--silence-limit", "20s"]);
    let _broker = farm.serve_ready();
    farm.let_in("dies_on_some_files", "");
    until_or(
        "it is ready",
        || is_known(&farm, "dies_on_some_files"),
        || farm.log(),
    );
    farm.write("poison.xodr", &Content::Good(7).bytes());
    let files = some_files(&farm);
    farm.settle(files.len() + 1);
    assert_eq!(farm.verdict("poison.xodr").verdict, Verdict::Undetermined);
    let reasons = reasons_of(&farm, "poison.xodr", "dies_on_some_files");
    assert!(
        reasons
            .iter()
            .all(|it| it.contains("in a new process with only this file")),
        "{reasons:#?}"
    );
    assert_eq!(farm.verdict("0.xodr").verdict, Verdict::Accepted);
    // The file is not tried again until something changes. The process after the last death must be
    // up first, because it is a restart of its own.
    let peer = |farm: &Farm| {
        let peers = farm.status()?.peers;
        peers.into_iter().find(|it| it.name == "dies_on_some_files")
    };
    until_or(
        "it is up again",
        || peer(&farm).filter(|it| it.state == "ready").map(drop),
        || farm.log(),
    );
    let restarts = |farm: &Farm| peer(farm).unwrap().restarts;
    let before = restarts(&farm);
    farm.write("fresh.xodr", &Content::Good(8).bytes());
    assert_eq!(farm.verdict("fresh.xodr").verdict, Verdict::Accepted);
    assert_eq!(restarts(&farm), before);
}

#[test]
fn additional_bundle_joins_is_replaced_and_leaves() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let files = some_files(&farm);
    farm.settle(files.len());
    let versions = |farm: &Farm| -> Vec<String> {
        let results = farm.result("0.xodr");
        let bundles = results.bundles.iter().filter(|it| it.name == "polite");
        bundles.map(|bundle| bundle.version.clone()).collect()
    };
    assert!(versions(&farm).is_empty());
    for version in ["1.0.0", "2.0.0"] {
        farm.let_in("polite", &format!("--version {version}"));
        until_or(
            "old files are judged again by it",
            || (versions(&farm) == [version]).then_some(()),
            || farm.log(),
        );
    }
    farm.send_away("polite");
    until_or(
        "old files are judged again without it",
        || versions(&farm).is_empty().then_some(()),
        || farm.log(),
    );
    farm.settle(files.len());
    judge(&farm, &files, &[]).demand(&tail(&farm.log()));
}
