//! Commands must not succeed without an effect: bundles that cannot be added, removed or found, and
//! configurations that demand missing items.

use std::path::Path;
use std::process::Output;

use crate::support::cli::{Cli, Said};
use crate::support::content::Content;
use crate::support::farm::{Farm, zoo};
use crate::support::programs::write_script;
use crate::support::watchdog;

/// Creates a program that can be started but joins no bus.
fn idler(directory: &Path) -> String {
    let path = directory.join("idler");
    write_script(&path, "#!/bin/sh\nexec sleep 600\n");
    path.to_str().unwrap().to_owned()
}

fn refused(said: &Said, cli: &Cli, code: i32, words: &str) {
    assert_eq!(said.code, Some(code), "{}", said.whole(cli));
    assert!(said.stderr.contains(words), "{}", said.whole(cli));
}

fn told(said: &Output) -> (Option<i32>, String) {
    (
        said.status.code(),
        String::from_utf8_lossy(&said.stderr).into_owned(),
    )
}

#[test]
fn missing_directory_of_bundles_is_refused() {
    let cli = Cli::new();
    cli.write("a.xodr", Content::Good(1).bytes());
    let words = "cannot take bundles from --bundles-d";
    let said = cli.qcbus(&["check", "a.xodr", "--bundles-d", "/nosuch"]);
    refused(&said, &cli, 2, words);
    let said = cli.qcbus(&["check", "a.xodr", "--bundles-d", "a.xodr"]);
    refused(&said, &cli, 2, words);
    let said = cli.qcbus(&["serve", ".", "--bundles-d", "/nosuch"]);
    refused(&said, &cli, 2, words);
    assert!(!cli.path().join("qcbus-out").exists());
}

#[test]
fn bundle_without_a_runnable_program_is_not_added() {
    let cli = Cli::new();
    cli.write("notes", "no program");
    for program in [
        "/nosuch/bundle",
        "./notes",
        ".",
        "surely-no-program-of-PATH",
    ] {
        for offline in [&[][..], &["--offline"]] {
            let words = [&["bundle", "add", "mine", program][..], offline].concat();
            refused(&cli.qcbus(&words), &cli, 2, "cannot run");
        }
    }
    assert!(!cli.path().join("qcbus-out").exists());
}

#[test]
fn editing_bundles_without_a_broker_needs_offline() {
    let cli = Cli::new();
    let program = idler(cli.path());
    let add = ["bundle", "add", "mine", &program, "--bundles-d", "d"];
    refused(&cli.qcbus(&add), &cli, 4, "nothing was done: no broker");
    assert!(!cli.path().join("d").exists());
    let said = cli.qcbus(&[&add[..], &["--offline"]].concat());
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(
        said.stderr
            .contains("no broker of this instance watches it now")
    );
    assert!(cli.path().join("d/mine.json").exists());

    let remove = ["bundle", "remove", "mine", "--bundles-d", "d"];
    refused(&cli.qcbus(&remove), &cli, 4, "nothing was done: no broker");
    assert!(cli.path().join("d/mine.json").exists());
    let offline = [&remove[..], &["--offline"]].concat();
    assert_eq!(cli.qcbus(&offline).code, Some(0));
    assert!(!cli.path().join("d/mine.json").exists());
    refused(&cli.qcbus(&offline), &cli, 2, "no bundle `mine` was added");
}

#[test]
fn program_is_stored_with_its_absolute_path() {
    let cli = Cli::new();
    idler(cli.path());
    let add = |program: &str| {
        let said = cli.qcbus(&["bundle", "add", "mine", program, "--offline"]);
        assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
        cli.command_in("qcbus-out/.qcbus/bundles.d/mine.json")
    };
    let beside = cli.path().join("./idler");
    assert_eq!(Path::new(&add("./idler")), beside);
    let found = add("sh");
    assert!(found.starts_with('/') && found.ends_with("/sh"), "{found}");
}

#[test]
fn bundle_is_added_only_if_the_broker_accepts_it() {
    let farm = Farm::new();
    let program = zoo().display().to_string();
    let elsewhere = farm.base().join("elsewhere");
    let _broker = farm.serve_ready();

    let elsewhere_named = elsewhere.to_string_lossy();
    let add = ["bundle", "add", "polite", &program, "polite"];
    let (code, text) = told(&farm.qcbus(&[&add[..], &["--bundles-d", &elsewhere_named]].concat()));
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("watches"), "{text}");
    assert!(!elsewhere.exists());

    let (code, text) = told(&farm.qcbus(&add));
    assert_eq!(code, Some(0), "{text}");
    assert!(farm.bundles_d().join("polite.json").exists());
    // The broker has accepted the bundle before the command ends.
    let is_known = || {
        let status = farm.status().unwrap();
        status.peers.iter().any(|peer| peer.name == "polite")
    };
    assert!(is_known());

    let (code, text) = told(&farm.qcbus(&["bundle", "remove", "polite"]));
    assert_eq!(code, Some(0), "{text}");
    watchdog::until("the bundle has gone", || (!is_known()).then_some(()));
    for name in ["polite", "nobody", "xodrBundle"] {
        let (code, text) = told(&farm.qcbus(&["bundle", "remove", name]));
        assert_eq!(code, Some(2), "{name}: {text}");
    }

    // A single bad manifest keeps the broker from accepting any.
    std::fs::write(farm.bundles_d().join("broken.json"), "{").unwrap();
    let (code, text) = told(&farm.qcbus(&add));
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("nothing was added") && text.contains("broken.json"),
        "{text}"
    );
    assert!(!farm.bundles_d().join("polite.json").exists());
}

/// Configuration with every kind of name that may be unknown.
const ODD: &str = r#"<Config>
<Param name="InputFile" value="a.xodr"/>
<CheckerBundle application="xodr">
  <Checker checkerId="check_asam_xodr_road_lane_level_true_one_side"/>
  <Checker checkerId="check_asam_xodr_road_length_sum_geometrie"><Param name="x" value="1"/></Checker>
  <Checker checkerId="check_asam_xodr_junctions_no_overlap"><Param name="dept" value="1"/></Checker>
</CheckerBundle>
<CheckerBundle application="xodrBundel"/>
<ReportModule application="GitforgeReport"/>
</Config>"#;

/// Parts of the expected warnings, and their rows.
const ODDITIES: [(&str, u32); 4] = [
    (
        "`check_asam_xodr_road_length_sum_geometrie`; did you mean",
        5,
    ),
    ("no parameter `dept`; did you mean `depth`", 6),
    ("no bundle has the name `xodrBundel`; did you mean", 8),
    ("no reporter has the name `GitforgeReport`", 9),
];

fn says_it_all(text: &str) {
    for (words, row) in ODDITIES {
        let place = format!("config.xml:{row}:");
        let said = text.lines().any(|line| {
            line.contains(&place) && line.contains(": warning: ") && line.contains(words)
        });
        assert!(said, "{words}: {text}");
    }
}

#[test]
fn unknown_names_in_a_configuration_are_always_reported() {
    let cli = Cli::new();
    cli.write("a.xodr", Content::Good(1).bytes());
    cli.write("config.xml", ODD);
    let said = cli.qcbus(&["config", "check", "config.xml"]);
    refused(&said, &cli, 2, "not valid, 4 warnings");
    says_it_all(&said.stdout);

    // The unknown checker and the unknown bundle are demanded, but cannot be run.
    let said = cli.qcbus(&["check", "-c", "config.xml", "--quiet"]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
    says_it_all(&said.stderr);
}

#[test]
fn misspelt_parameter_is_reported_and_changes_no_verdict() {
    let cli = Cli::new();
    cli.write("a.xodr", Content::Good(1).bytes());
    let kept: Vec<&str> = ODD
        .lines()
        .filter(|line| !line.contains("geometrie\"") && !line.contains("Bundel"))
        .filter(|line| !line.contains("Gitforge"))
        .collect();
    cli.write("config.xml", kept.join("\n"));
    let said = cli.qcbus(&["check", "-c", "config.xml"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(
        said.stderr.contains("did you mean `depth`"),
        "{}",
        said.whole(&cli)
    );
    assert_eq!(cli.qcbus(&["config", "check", "config.xml"]).code, Some(2));

    cli.write(
        "config.xml",
        kept.join("\n").replace("\"dept\"", "\"depth\""),
    );
    let said = cli.qcbus(&["config", "check", "config.xml"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let said = cli.qcbus(&["check", "-c", "config.xml"]);
    assert_eq!(
        (said.code, said.stderr.contains("warning")),
        (Some(0), false)
    );
}

#[test]
fn serve_and_reload_report_unknown_configuration_names() {
    let mut farm = Farm::new();
    let config = farm.base().join("config.xml");
    std::fs::write(&config, ODD).unwrap();
    let config_named = config.to_string_lossy().into_owned();
    farm.arguments.extend(["-c".to_owned(), config_named]);
    let _broker = farm.serve_ready();
    let notices = farm.status().unwrap().notices;
    let texts: Vec<&str> = notices.iter().map(|it| it.text.as_str()).collect();
    says_it_all(&texts.join("\n"));
    std::fs::write(&config, ODD.replace("<Config>", "<Config><!-- new -->")).unwrap();
    let (code, text) = told(&farm.qcbus(&["reload"]));
    assert_eq!(code, Some(0), "{text}");
    says_it_all(&text);
}

#[test]
fn own_bundle_is_known_by_its_manifest() {
    let cli = Cli::new();
    let program = idler(cli.path());
    let add = [
        "bundle",
        "add",
        "mine",
        &program,
        "--offline",
        "--bundles-d",
        "d",
    ];
    assert_eq!(cli.qcbus(&add).code, Some(0));
    let text = r#"<Config><CheckerBundle application="mine"><Checker checkerId="c"/></CheckerBundle></Config>"#;
    cli.write("config.xml", text);
    let check = ["config", "check", "config.xml"];
    refused(&cli.qcbus(&check), &cli, 2, "not valid, 1 warning:");
    let said = cli.qcbus(&[&check[..], &["--bundles-d", "d"]].concat());
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(
        said.stdout.contains("only known once it has joined"),
        "{}",
        said.stdout
    );
}
