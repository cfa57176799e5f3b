//! Input that was made to break something. Each file gets an issue at a place or a clear error. The
//! file beside it is judged as usual, and nothing else happens.

use std::io::Write;
use std::path::Path;

use crate::support::asam;
use crate::support::cli::{Cli, checkers, files_below, issues, places};
use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::inside::skip;
use crate::support::watchdog::until_or;
use flate2::Compression;
use flate2::write::GzEncoder;
use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;

/// Checks a directory with a hostile file and a good one. The hostile one must be rejected with an
/// issue that contains `text` and is at `place`. The other one must be accepted.
fn is_rejected(cli: &Cli, name: &str, text: &str, place: (u64, u64)) {
    cli.write("in/good.xodr", Content::Good(1).bytes());
    let said = cli.qcbus(&["check", "in", "-v", "--out", "out"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(cli));
    assert!(
        said.stdout.contains("accepted: in/good.xodr: "),
        "{}",
        said.whole(cli)
    );
    assert!(
        said.stdout.contains(&format!("rejected: in/{name}: ")),
        "{}",
        said.whole(cli)
    );
    assert_eq!(said.stderr, "", "nothing else is reported");
    let results = cli.result(&format!("out/in/{name}.xqar"));
    let found: Vec<_> = issues(&results)
        .map(|(_, issue)| (issue.description.as_str(), places(issue)))
        .collect();
    let hit = found
        .iter()
        .any(|(said, at)| said.contains(text) && at.contains(&place));
    assert!(
        hit,
        "expected an issue with `{text}` at {place:?}, found {found:#?}"
    );
    assert!(checkers(&results).all(|it| it.status != Some(Status::Error)));
    let written = std::fs::read_to_string(cli.path().join(format!("out/in/{name}.xqar"))).unwrap();
    assert_eq!(asam::complaints(&written), [""; 0]);
}

fn hostile(name: &str, bytes: impl AsRef<[u8]>, text: &str, place: (u64, u64)) {
    let cli = Cli::new();
    cli.write(&format!("in/{name}"), bytes);
    is_rejected(&cli, name, text, place);
}

const XML: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn empty_file_is_rejected() {
    hostile("x.xodr", "", "the file is empty", (1, 1));
}

#[test]
fn directory_with_a_map_name_is_searched_for_files() {
    let cli = Cli::new();
    cli.write("in/good.xodr", Content::Good(1).bytes());
    cli.write("in/x.xodr/inner.xodr", Content::NoHeader(2).bytes());
    let said = cli.qcbus(&["check", "in", "-v", "--out", "out"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    assert!(
        said.stdout
            .contains("rejected: in/x.xodr/inner.xodr: 1 error"),
        "{}",
        said.whole(&cli)
    );
    assert_eq!(
        files_below(&cli.path().join("out")).len(),
        2,
        "the directory has no result"
    );
}

#[test]
fn two_hundred_megabytes_of_open_tags_are_rejected() {
    let mut text = XML.to_owned();
    text.push_str(&"<a>".repeat((200 << 20) / 3));
    hostile("x.xodr", text, "1024", (2, 1 + 3 * 1024));
}

#[test]
fn deeply_nested_elements_are_rejected() {
    let (open, close) = ("<a>\n".repeat(100_000), "</a>".repeat(100_000));
    hostile("x.xosc", format!("{open}{close}"), "1024", (1025, 1));
}

#[test]
fn entity_bomb_is_rejected() {
    let text = format!(
        "{XML}<!DOCTYPE bomb [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\">\
         <!ENTITY c \"&b;&b;&b;&b;&b;&b;&b;&b;\">]>\n<OpenDRIVE>&c;</OpenDRIVE>\n"
    );
    hostile("x.xodr", text, "DOCTYPE", (2, 1));
}

#[test]
fn external_entity_is_rejected() {
    let text = format!(
        "{XML}<!DOCTYPE x [<!ENTITY secret SYSTEM \"file:///etc/passwd\">]>\n\
         <OpenDRIVE><header name=\"&secret;\"/></OpenDRIVE>\n"
    );
    let cli = Cli::new();
    cli.write("in/x.xodr", text);
    is_rejected(&cli, "x.xodr", "DOCTYPE", (2, 1));
    let written = std::fs::read_to_string(cli.path().join("out/in/x.xodr.xqar")).unwrap();
    assert!(
        !written.contains("root:"),
        "the external entity is not read"
    );
}

#[test]
fn gzip_bomb_is_rejected() {
    hostile(
        "x.xodrz",
        gzip(&vec![b' '; 16 << 20]),
        "inflating was stopped",
        (1, 1),
    );
}

#[test]
fn truncated_gzip_is_rejected() {
    let whole = gzip(&Content::Good(1).bytes());
    hostile("x.xodr.gz", &whole[..whole.len() / 2], "gzip", (1, 1));
}

#[test]
fn wrong_encoding_declaration_is_rejected() {
    // The file declares UTF-16 but is not encoded in it.
    let text = "<?xml version=\"1.0\" encoding=\"UTF-16\"?>\n<OpenDRIVE/>\n";
    hostile("x.xodr", text, "UTF-16", (1, 31));
}

#[test]
fn unknown_encoding_is_rejected() {
    let text = "<?xml version=\"1.0\" encoding=\"KLINGON\"?>\n<OpenDRIVE/>\n";
    hostile("x.xodr", text, "KLINGON", (1, 31));
}

#[test]
fn invalid_utf_8_is_rejected() {
    let mut bytes = format!("{XML}<OpenDRIVE>\n<header name=\"M").into_bytes();
    bytes.push(0xfc);
    bytes.extend(b"hle\"/></OpenDRIVE>\n");
    hostile("x.xodr", bytes, "UTF-8", (3, 16));
}

#[test]
fn nul_bytes_are_rejected() {
    hostile(
        "x.xodr",
        format!("{XML}<OpenDRIVE>\n  \0</OpenDRIVE>\n"),
        "U+0000",
        (3, 3),
    );
}

#[test]
fn file_of_only_nul_bytes_is_rejected() {
    hostile("x.xodr", [0; 4096], "U+0000", (1, 1));
}

#[test]
fn second_root_is_rejected() {
    hostile(
        "x.xodr",
        format!("{XML}<OpenDRIVE/>\n<OpenDRIVE/>\n"),
        "second root",
        (3, 1),
    );
}

#[test]
fn text_after_the_root_is_rejected() {
    hostile(
        "x.xodr",
        format!("{XML}<OpenDRIVE/>\nthe end"),
        "after the root",
        (3, 1),
    );
}

#[test]
fn include_cycle_is_rejected() {
    let cli = Cli::new();
    let include = |file: &str| format!("<OpenDRIVE>\n<include file=\"{file}\"/>\n</OpenDRIVE>\n");
    cli.write("in/x.xodr", include("one.xml"));
    cli.write("in/one.xml", include("two.xml"));
    cli.write("in/two.xml", include("one.xml"));
    // FIXME: the place in the root file should be its `include`, 2:1.
    is_rejected(&cli, "x.xodr", "leads back to", (1, 1));
}

#[test]
fn include_outside_the_root_is_rejected() {
    let cli = Cli::new();
    cli.write("secret.xml", "<OpenDRIVE><road id=\"secret\"/></OpenDRIVE>");
    cli.write(
        "in/x.xodr",
        "<OpenDRIVE>\n  <include file=\"../secret.xml\"/>\n</OpenDRIVE>\n",
    );
    is_rejected(&cli, "x.xodr", "points outside", (2, 3));
}

#[test]
fn pipe_is_refused_without_waiting() {
    // A pipe without a writer: opening it waits for ever.
    let cli = Cli::new();
    cli.write("in/good.xodr", Content::Good(1).bytes());
    let status = std::process::Command::new("mkfifo")
        .arg(cli.path().join("in/x.xodr"))
        .status();
    if !status.is_ok_and(|it| it.success()) {
        return skip("pipe_is_refused_without_waiting", "there is no mkfifo");
    }
    let said = cli.qcbus(&["check", "in", "-v", "--out", "out"]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
    assert!(said.stderr.contains("it is a pipe"), "{}", said.stderr);
    let said = cli.qcbus(&["check", "in/x.xodr", "in/good.xodr", "--out", "out"]);
    assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
    assert!(
        said.stderr.contains("not a regular file"),
        "{}",
        said.stderr
    );
}

#[test]
fn unreadable_file_does_not_affect_other_files() {
    use std::os::unix::fs::PermissionsExt as _;
    let cli = Cli::new();
    let file = cli.write("in/x.xodr", Content::Good(2).bytes());
    cli.write("in/good.xodr", Content::Good(1).bytes());
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o000)).unwrap();
    if std::fs::read(&file).is_ok() {
        return skip(
            "unreadable_file_does_not_affect_other_files",
            "this user may read everything",
        );
    }
    let said = cli.qcbus(&["check", "in", "-v", "--out", "out"]);
    assert!(said.code.is_some_and(|it| it != 0), "{}", said.whole(&cli));
    assert!(
        said.stdout.contains("accepted: in/good.xodr: "),
        "{}",
        said.whole(&cli)
    );
}

/// Returns small hostile files for a broker that must survive them.
fn zoo_of_files() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("empty.xodr", Vec::new()),
        ("deep.xodr", "<a>".repeat(100_000).into_bytes()),
        (
            "doctype.xodr",
            format!("{XML}<!DOCTYPE x [<!ENTITY a \"b\">]><x>&a;</x>").into_bytes(),
        ),
        ("bomb.xodrz", gzip(&vec![b' '; 16 << 20])),
        (
            "torn.xodr.gz",
            gzip(&Content::Good(1).bytes())[..40].to_vec(),
        ),
        ("nul.xosc", vec![0; 4096]),
        ("bytes.xosc", (0..=255).cycle().take(100_000).collect()),
        ("no_zip.mosc", b"PK\x03\x04 not really".to_vec()),
        ("two.xodr", b"<OpenDRIVE/><OpenDRIVE/>".to_vec()),
        ("attributes.xodr", many_attributes()),
    ]
}

fn many_attributes() -> Vec<u8> {
    let mut text = String::from("<OpenDRIVE");
    for number in 0..200_000 {
        text.push_str(&format!(" a{number}=\"\""));
    }
    text.push_str("/>");
    text.into_bytes()
}

#[test]
fn broker_survives_all_hostile_files_at_once() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let bundles = |farm: &Farm| -> Vec<u32> {
        let peers = farm.status().unwrap().peers;
        peers
            .iter()
            .filter(|it| it.role == "bundle")
            .map(|it| it.pid)
            .collect()
    };
    let before = bundles(&farm);
    let files = zoo_of_files();
    for (name, bytes) in &files {
        farm.write(name, bytes);
    }
    farm.write("good.xodr", &Content::Good(1).bytes());
    farm.settle(files.len() + 1);
    for (name, _) in &files {
        let verdict = farm.verdict(name);
        assert_eq!(verdict.verdict, Verdict::Rejected, "{name}: {verdict:?}");
        let written = std::fs::read_to_string(farm.out().join(format!("{name}.xqar"))).unwrap();
        assert_eq!(asam::complaints(&written), [""; 0], "{name}");
    }
    assert_eq!(farm.verdict("good.xodr").verdict, Verdict::Accepted);
    assert!(broker.is_alive());
    assert_eq!(bundles(&farm), before, "no bundle may die");
}

#[test]
fn files_removed_while_being_read_do_no_harm() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    // The map is large enough to be in work for a while.
    let large = large_map(4 << 20);
    for round in 0..12 {
        let name = format!("{round}.xodr");
        farm.write(&name, &large);
        if round % 3 == 0 {
            until_or(
                "it is on its way",
                || {
                    let status = farm.status()?;
                    (status.queue.active + status.queue.waiting + status.files.judged > 0)
                        .then_some(())
                },
                || tail(&farm.log()),
            );
        }
        std::fs::remove_file(farm.root().join(&name)).unwrap();
    }
    farm.write("good.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("good.xodr").verdict, Verdict::Accepted);
    farm.settle(1);
    until_or(
        "nothing is left of what was removed",
        || (results(&farm.out()) == ["good.xodr.verdict.json", "good.xodr.xqar"]).then_some(()),
        || format!("{:?}\n{}", results(&farm.out()), tail(&farm.log())),
    );
    assert!(broker.is_alive());
}

fn results(out: &Path) -> Vec<String> {
    let files = files_below(out)
        .into_iter()
        .filter(|file| !file.starts_with(".qcbus"));
    files
        .map(|file| file.to_string_lossy().into_owned())
        .collect()
}

fn large_map(bytes: usize) -> Vec<u8> {
    let text = String::from_utf8(Content::Good(1).bytes()).unwrap();
    let end = text.find("</OpenDRIVE>").unwrap();
    let mut large = text[..end].to_owned();
    while large.len() < bytes {
        large.push_str("<userData code=\"filler\" value=\"nothing to see here\"/>\n");
    }
    large.push_str("</OpenDRIVE>\n");
    large.into_bytes()
}

/// Returns a name of this length. There is no room for `.xqar` after the longest names.
fn long_name(length: usize) -> String {
    let name = "x".repeat(length - ".xodr".len());
    format!("{name}.xodr")
}

#[test]
fn too_long_name_is_undetermined_and_delays_no_other() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let long = long_name(255);
    farm.write(&long, &Content::Good(1).bytes());
    let verdict = farm.verdict(&long);
    assert_eq!(verdict.verdict, Verdict::Undetermined);
    assert_eq!(verdict.xqar, Path::new(""), "there is no result");
    let why = verdict.why.join("\n");
    assert!(why.contains("cannot write "), "{why}");
    assert!(why.contains("File name too long"), "{why}");
    let said = farm.qcbus(&["wait", &farm.root().join(&long).to_string_lossy()]);
    assert_eq!(said.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&said.stdout).contains("no result\n  cannot write "));
    let notices = farm.status().unwrap().notices;
    assert!(
        notices
            .iter()
            .any(|it| it.text.contains("stays undetermined")),
        "{notices:#?}"
    );
    // A result that could never be written is withdrawn at once and delays no other work.
    std::fs::remove_file(farm.root().join(&long)).unwrap();
    farm.settle(0);
    for number in 0..60 {
        farm.write(&format!("{number}.xodr"), &Content::Good(number).bytes());
    }
    farm.settle(60);
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
    let written = files_below(&farm.out());
    let of_long = written.iter().filter(|it| it.starts_with(&long));
    assert_eq!(of_long.count(), 0);
}

#[test]
fn directory_in_place_of_a_result_delays_no_other() {
    let farm = Farm::new();
    let in_the_way = farm.out().join("a.xodr.xqar");
    std::fs::create_dir_all(&in_the_way).unwrap();
    let _broker = farm.serve_ready();
    farm.write("a.xodr", &Content::Good(1).bytes());
    let verdict = farm.verdict("a.xodr");
    assert_eq!(verdict.verdict, Verdict::Undetermined);
    assert!(!farm.out().join("a.xodr.verdict.json").exists());
    std::fs::remove_file(farm.root().join("a.xodr")).unwrap();
    farm.settle(0);
    // The directory is removed, so the file is judged like any other.
    std::fs::remove_dir(in_the_way).unwrap();
    farm.write("a.xodr", &Content::Good(2).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Content::Good(2).verdict());
}

#[test]
fn check_ends_when_its_result_cannot_be_written() {
    let cli = Cli::new();
    let long = long_name(251);
    cli.write(&format!("in/{long}"), Content::Good(1).bytes());
    cli.write("in/a.xodr", Content::NoHeader(1).bytes());
    let said = cli.qcbus(&["check", "in", "-v", "--out", "out"]);
    assert_eq!(said.code, Some(5), "{}", said.whole(&cli));
    let told = format!("error: in/{long} has no result: cannot write ");
    assert!(said.stderr.contains(&told), "{}", said.whole(&cli));
    assert!(
        said.stdout.contains("1 rejected, 1 undetermined"),
        "{}",
        said.whole(&cli)
    );
    assert!(said.stdout.contains("rejected: in/a.xodr: "));
    assert!(cli.path().join("out/in/a.xodr.xqar").exists());
}

#[test]
fn check_does_not_start_where_results_are_unwritable() {
    let cli = Cli::new();
    cli.write("file", "");
    cli.write("in/a.xodr", Content::Good(1).bytes());
    let said = cli.qcbus(&["check", "in/a.xodr", "--out", "file/x"]);
    assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
    assert_eq!(
        cli.tidy(&said.stderr),
        "error: cannot write results into [DIR]/file/x: [DIR]/file: Not a directory (os error \
         20); choose another directory with --out\n"
    );
}
