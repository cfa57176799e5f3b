//! Tests with a broker that works differently from the check itself. Its own answer must not be
//! used.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use super::bench::{Bench, Made, text};
use crate::support::broker::Broker;
use crate::support::content::{Content, Mark};
use crate::support::farm::Farm;
use crate::support::inside::{refused, skip};
use crate::support::programs::copy_program;
use crate::support::watchdog::until;

const CONFIG: &str = "<Config><CheckerBundle application=\"xodrBundle\"><Checker \
    checkerId=\"check_asam_xodr_xml_valid_xml_document\" minLevel=\"3\" maxLevel=\"1\"/></CheckerBundle></Config>";
/// A schema that knows a header and one other element.
const SCHEMA: &str = r#"<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">
<xs:element name="OpenDRIVE"><xs:complexType><xs:sequence>
<xs:element name="header" type="xs:anyType"/>
<xs:element name="WHAT" type="xs:anyType"/>
</xs:sequence></xs:complexType></xs:element>
</xs:schema>"#;

/// Checks a good and a bad file with a broker that has these arguments. Returns how the checks were
/// made.
fn asked_of(serve: &[&str], check: &[&str]) -> Made {
    let bench = Bench::with(serve);
    let _broker = bench.farm.serve_ready();
    let good = bench.beside("good.xodr", Content::Good(1).bytes());
    let bad = bench.beside("bad.xodr", Content::NoHeader(2).bytes());
    let made = [good, bad].map(|file| bench.compared(&[&[file.as_str()], check].concat()));
    assert_eq!(made[0], made[1]);
    made[0]
}

#[test]
fn other_limits_or_formats_are_checked_without_the_broker() {
    for words in [
        &["--max-depth", "3"][..],
        &["--max-file", "1"],
        &["--max-unpacked", "1"],
        &["--max-ratio", "2"],
        &["--max-members", "1"],
        &["--job-deadline", "50s"],
        &["--silence-limit", "20s"],
        &["--memory-limit", "2000"],
        &["--xqar-dialect", "qc4openx"],
        &["--no-sandbox"],
    ] {
        assert_eq!(asked_of(words, &[]), Made::Cold, "the broker has {words:?}");
        assert_eq!(asked_of(&[], words), Made::Cold, "the check has {words:?}");
        assert_eq!(asked_of(words, words), Made::Warm, "both have {words:?}");
    }
    // The number of threads changes only the time, not the findings.
    assert_eq!(
        asked_of(&["--threads", "1"], &["--threads", "2"]),
        Made::Warm
    );
}

#[test]
fn narrowed_or_configured_check_runs_without_the_broker() {
    let bench = Bench::new();
    let config = bench.beside("config.xml", CONFIG);
    let empty = bench.cli.path().join("bundles");
    std::fs::create_dir(&empty).unwrap();
    for words in [
        &["--select", "xodrBundle"][..],
        &["--ignore", "check_asam_xodr_xml_fileheader_is_present"],
        &["--config", &config],
        &["--bundles-d", &text(&empty)],
    ] {
        assert_eq!(asked_of(&[], words), Made::Cold, "{words:?}");
    }
    for words in [&["--config", &config][..], &["--no-standard-bundles"]] {
        let bench = Bench::with(words);
        let _broker = bench.farm.serve();
        until("the broker answers", || bench.farm.status());
        let bad = bench.beside("bad.xodr", Content::NoHeader(2).bytes());
        assert_eq!(bench.compared(&[&bad]), Made::Cold, "{words:?}");
    }
}

#[test]
fn bundle_known_only_to_the_broker_is_not_used() {
    let bench = Bench::new();
    bench.farm.let_in("judges_strictly", "");
    let _broker = bench.farm.serve_ready();
    bench.peer("judges_strictly", |it| it.state == "ready");
    let marked = bench.watched("marked.xodr", Content::Marked(1).bytes());
    assert_eq!(bench.compared(&[&marked]), Made::Warm);
    let verdict = bench.farm.verdict("marked.xodr").verdict;
    assert_eq!(
        verdict,
        Content::Marked(1).verdict(),
        "the bundle judges the watched file"
    );
}

#[test]
fn changed_schemas_are_used_as_they_are_now() {
    let bench = Bench::new();
    let schemas = text(&bench.cli.path().join("own"));
    bench.beside("own/map.xsd", SCHEMA.replace("WHAT", "road"));
    let bad = bench.beside(
        "map.xodr",
        "<OpenDRIVE>\n<header revMajor=\"1\" revMinor=\"7\"/>\n<road/>\n</OpenDRIVE>\n",
    );
    let farm = Farm::with(&["--schema-dir", &schemas]);
    let bench = Bench { farm, ..bench };
    let _broker = bench.farm.serve_ready();
    let words = [bad.as_str(), "--schema-dir", &schemas];
    bench.compared(&words);
    bench.beside("own/map.xsd", SCHEMA.replace("WHAT", "signal"));
    bench.compared(&words);
    assert!(
        bench.cold(&words).says("signal"),
        "the current schema is used"
    );
    assert_eq!(
        bench.compared(&words[..1]),
        Made::Cold,
        "no schema is used when none is given"
    );
}

#[test]
fn other_search_path_is_checked_without_the_broker() {
    let bench = Bench::new();
    bench.beside("library/note.txt", "");
    let file = bench.beside("map.xodr", Content::Good(1).bytes());
    let _broker = bench.farm.serve_ready();
    let searching = |path: &str, more: &[&str]| {
        let words = [&[file.as_str(), "-v"], more].concat();
        let mut command = bench.command(&words);
        command.env("SCENARIO_PATH", path);
        bench.told(command)
    };
    for path in ["library", "/nosuch"] {
        let (made, found) = searching(path, &[]);
        assert_eq!(made, Made::Cold, "{path}");
        assert_eq!(found, searching(path, &["--cold"]).1);
    }
}

#[test]
fn copy_of_the_program_counts_as_another_program() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let file = bench.beside("bad.xodr", Content::NoHeader(1).bytes());
    let copy = bench.cli.path().join("qcbus");
    copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), &copy);
    let cold = bench.cold(&[&file, "-v"]);
    let mut command = Command::new(copy);
    command.args(bench.command(&[&file, "-v"]).get_args());
    let (made, found) = bench.told(command);
    assert_eq!((made, found), (Made::Cold, cold));
}

#[test]
fn client_in_another_mount_namespace_is_not_answered() {
    let name = "client_in_another_mount_namespace_is_not_answered";
    if let Some(why) = refused() {
        return skip(name, &why);
    }
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    // In the other mount namespace the same path is another file.
    let file = bench.beside("d/map.xodr", Content::Good(1).bytes());
    bench.beside("other/map.xodr", Content::NoHeader(2).bytes());
    let check = bench.command(&[&file, "-v"]);
    let words = ["--mount", "--propagation", "private", "sh", "-c"];
    let mut command = Command::new("unshare");
    command
        .args(words)
        .arg("mount --bind other d && exec \"$@\"")
        .arg("sh");
    command.arg(check.get_program()).args(check.get_args());
    let (made, found) = bench.told(command);
    assert_eq!((made, found.code()), (Made::Cold, Some(1)), "{found:?}");
}

/// Command that runs root without its capabilities.
const WITH_LESS: [&str; 5] = ["setpriv", "--bounding-set", "-all", "--inh-caps", "-all"];

fn with_less(command: &Command) -> Command {
    let mut less = Command::new(WITH_LESS[0]);
    less.args(&WITH_LESS[1..])
        .arg(command.get_program())
        .args(command.get_args());
    for (name, value) in command.get_envs() {
        less.env(name, value.unwrap_or_default());
    }
    less
}

/// Writes a file that cannot be read without additional rights, and one that includes such a file.
fn hidden(bench: &Bench) -> [String; 2] {
    let hidden = bench.beside("map.xodr", Content::Good(1).bytes());
    let part = bench.beside("part.xml", Content::Part(1, Mark::Clean).bytes());
    let including = Content::Including(2, "part.xml".to_owned()).bytes();
    for file in [&hidden, &part] {
        std::fs::set_permissions(file, Permissions::from_mode(0o000)).unwrap();
    }
    [hidden, bench.beside("including.xodr", including)]
}

#[test]
fn client_with_other_rights_is_not_answered() {
    let can_drop = with_less(&Command::new("true")).output();
    if !rustix::process::geteuid().is_root() || !can_drop.is_ok_and(|it| it.status.success()) {
        return skip(
            "client_with_other_rights_is_not_answered",
            "nobody can drop rights here",
        );
    }
    let bench = Bench::new();
    let files = hidden(&bench);
    let all = |words: &[&str]| bench.command(words);
    let less = |words: &[&str]| with_less(&bench.command(words));
    // First the broker has more rights than the caller, then fewer.
    let ask = |command: &dyn Fn(&[&str]) -> Command| {
        for file in &files {
            let cold = bench.told(command(&[file, "-v", "--cold"]));
            assert_eq!(bench.told(command(&[file, "-v"])), cold, "{file}");
        }
    };
    {
        let _broker = bench.farm.serve_ready();
        ask(&less);
    }
    let mut serve = with_less(&bench.farm.serve_command());
    let _broker = Broker::start(&mut serve, &bench.farm.log_path());
    bench.peer("xodrBundle", |it| it.state == "ready");
    ask(&all);
    let differs = |file: &str| bench.told(all(&[file, "-v"])) != bench.told(less(&[file, "-v"]));
    assert!(
        files.iter().all(|file| differs(file)),
        "permissions make a difference"
    );
}

#[test]
fn client_in_other_groups_is_not_answered() {
    let groups = ["--groups", "12345"];
    let mut command = Command::new("setpriv");
    let can_change = command.args(groups).arg("true").output();
    if !can_change.is_ok_and(|it| it.status.success()) {
        return skip(
            "client_in_other_groups_is_not_answered",
            "nobody can change groups here",
        );
    }
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let file = bench.beside("map.xodr", Content::NoHeader(1).bytes());
    let check = bench.command(&[&file, "-v"]);
    let mut command = Command::new("setpriv");
    command
        .args(groups)
        .arg(check.get_program())
        .args(check.get_args());
    let cold = bench.cold(&[&file, "-v"]);
    assert_eq!(bench.told(command), (Made::Cold, cold));
}
