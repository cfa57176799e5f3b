//! Output for people who type commands: helps, mistakes, explanations.

use crate::support::cli::Cli;
use crate::support::content::Content;

/// Runs several commands and returns their output.
fn session(cli: &Cli, commands: &[&str]) -> String {
    let mut text = String::new();
    for command in commands {
        let words: Vec<&str> = command.split_whitespace().collect();
        text.push_str(&format!(
            "$ qcbus {command}\n{}\n",
            cli.qcbus(&words).whole(cli)
        ));
    }
    text
}

#[test]
fn help_of_every_command() {
    let cli = Cli::new();
    insta::assert_snapshot!(session(
        &cli,
        &[
            "--help",
            "check --help",
            "serve --help",
            "down --help",
            "status --help",
            "wait --help",
            "reload --help",
            "bundle --help",
            "bundle run --help",
            "bundle add --help",
            "bundle upgrade --help",
            "bundle new --help",
            "bundle remove --help",
            "rule --help",
            "config check --help",
            "timeline --help",
            "doctor --help",
        ]
    ));
}

#[test]
fn mistakes_are_reported_with_advice() {
    let cli = Cli::new();
    cli.write("notes.txt", "nothing");
    std::fs::create_dir(cli.path().join("empty")).unwrap();
    insta::assert_snapshot!(session(
        &cli,
        &[
            "chekc",
            "check",
            "check nowhere.xodr",
            "check notes.txt",
            "check empty",
            "check --colour x",
            "check -c nowhere.xml",
            "serve",
            "serve nowhere",
            "serve notes.txt",
            "wait",
            "wait x.xodr",
            "wait x.xodr --timeout soon",
            "status",
            "down",
            "reload",
            "rule nope",
            "rule check_asam_xodr_ids_id_unique_in_clas",
            "config check nowhere.xml",
            "bundle run nobody",
            "bundle run xodr --frob",
            "bundle remove nobody",
            "bundle add a/b true",
            "status --instance a/b",
        ]
    ));
}

#[test]
fn parameters_of_a_checker_are_validated() {
    let cli = Cli::new();
    let config = |name: &str, value: &str| {
        format!(
            "<Config><CheckerBundle application=\"xodrBundle\">\n\
             <Checker checkerId=\"check_qcbus_xodr_road_linkage_ends_meet\">\n\
             <Param name=\"{name}\" value=\"{value}\"/></Checker></CheckerBundle></Config>\n"
        )
    };
    cli.write("listed.xml", config("qcbus.max_issues", "5"));
    cli.write("comma.xml", config("gap_broken_from", "0,05"));
    insta::assert_snapshot!(session(
        &cli,
        &["config check listed.xml", "config check comma.xml"]
    ));
}

#[test]
fn wait_reports_why_there_will_be_no_verdict() {
    use crate::support::farm::Farm;
    let farm = Farm::new();
    farm.write(".qcignore", b"*_wip.xodr\n");
    farm.write("a_wip.xodr", &Content::Good(1).bytes());
    farm.write("b.xodr", &Content::NoHeader(1).bytes());
    let _broker = farm.serve_ready();
    let mut text = String::new();
    let root = farm.root();
    for (file, more) in [
        (root.join("a_wip.xodr"), "5s"),
        (root.join("notes.txt"), "5s"),
        (root.join("gone.xodr"), "1ms"),
        (farm.base().join("outside.xodr"), "5s"),
        (root.join("b.xodr"), "5m"),
    ] {
        let said = farm.qcbus(&["wait", &file.to_string_lossy(), "--timeout", more]);
        text.push_str(&String::from_utf8_lossy(&said.stdout));
        text.push_str(&String::from_utf8_lossy(&said.stderr));
        text.push_str(&format!("--- exit {}\n", said.status.code().unwrap()));
    }
    insta::assert_snapshot!(text.replace(&*farm.base().to_string_lossy(), "[DIR]"));
}

#[test]
fn rule_command_explains_each_rule() {
    let cli = Cli::new();
    let said = cli.qcbus(&["rule", "check_asam_xodr_xml_fileheader_is_present"]);
    insta::assert_snapshot!(said.whole(&cli));
    let listed = cli.qcbus(&["rule"]);
    assert!(listed.stdout.lines().count() > 10);
    for line in listed.stdout.lines() {
        let id = line.split_whitespace().next().unwrap();
        assert_eq!(cli.qcbus(&["rule", id]).code, Some(0), "{id}");
    }
}

#[test]
fn doctor_and_bundle_list_work_without_a_broker() {
    let cli = Cli::new();
    let said = cli.qcbus(&["doctor"]);
    assert!(
        said.stdout
            .lines()
            .all(|it| it.starts_with("ok") || it.starts_with("FIX") || it.starts_with("  "))
    );
    assert!(said.stdout.contains("shared memory") && said.stdout.contains("journal"));
    let said = cli.qcbus(&["bundle", "list"]);
    assert_eq!(said.code, Some(0));
    let names: Vec<&str> = said
        .stdout
        .lines()
        .filter_map(|it| it.split_whitespace().next())
        .collect();
    assert_eq!(names, ["xodrBundle", "xoscBundle", "modularBundle"]);
}

#[test]
fn quiet_and_json_print_no_more_than_requested() {
    let cli = Cli::new();
    cli.write("in/a.xodr", Content::Good(1).bytes());
    cli.write("in/b.xodr", Content::NoHeader(1).bytes());
    let quiet = cli.qcbus(&["check", "in", "--quiet"]);
    let lines: Vec<&str> = quiet.stdout.lines().collect();
    assert_eq!(lines.len(), 1, "{}", quiet.whole(&cli));
    assert!(
        lines[0].starts_with("in/b.xodr:2:1: error: "),
        "{}",
        lines[0]
    );
    assert_eq!((quiet.code, quiet.stderr.as_str()), (Some(1), ""));
    let json = cli.qcbus(&["check", "in", "--format", "json"]);
    assert_eq!(
        (json.code, json.stdout.lines().count()),
        (Some(1), 2),
        "{}",
        json.stdout
    );
    for line in json.stdout.lines() {
        let _: serde_json::Value = serde_json::from_str(line).unwrap();
    }
}

#[test]
fn bundle_is_added_in_bundles_d_with_its_arguments() {
    let cli = Cli::new();
    let add = |name: &str, further: &[&str]| {
        let mut arguments = vec!["bundle", "add", name, "/bin/sh", "--offline"];
        arguments.extend(further);
        cli.qcbus(&arguments)
    };
    let said = add("mine", &["--bundles-d", "bundles"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert_eq!(cli.command_in("bundles/mine.json"), "/bin/sh");
    let own = ["a", "--bundles-d", "bundles", "--", "--bundles-d", "x"];
    assert_eq!(add("other", &own).code, Some(0));
    let command = "/bin/sh a --bundles-d x";
    assert_eq!(cli.command_in("bundles/other.json"), command);
    let unclear = add("third", &["--bundles-d", "bundles", "--its-own-flag"]);
    assert_eq!(unclear.code, Some(2));
    assert!(
        unclear.stderr.contains("'-- --its-own-flag'"),
        "{}",
        unclear.whole(&cli)
    );
    assert!(!cli.path().join("bundles/third.json").exists());
    assert!(!cli.path().join("qcbus-out").exists());
}

#[test]
fn gate_inside_a_watched_directory_is_refused() {
    let cli = Cli::new();
    cli.write("in/a.xodr", "");
    std::os::unix::fs::symlink("in", cli.path().join("farm")).unwrap();
    for (gate, words) in [
        ("farm/accepted", "is inside the watched directory"),
        ("in/new/accepted", "is inside the watched directory"),
        ("other/../farm/accepted", "is inside the watched directory"),
        ("farm", "is inside the watched directory"),
        (".", "is inside the gate"),
    ] {
        let said = cli.qcbus(&["serve", "farm", "--gate", gate]);
        assert_eq!(said.code, Some(2), "{gate}: {}", said.whole(&cli));
        assert!(said.stderr.contains(words), "{gate}: {}", said.whole(&cli));
    }
    assert!(!cli.path().join("in/accepted").exists());
}

/// A check without a broker needs no instance.
#[test]
fn check_works_where_no_instance_is_possible() {
    let cli = Cli::new();
    let map = cli.write("map.xodr", Content::Good(1).bytes());
    let map = map.to_str().unwrap();
    let there = cli.qcbus(&["check", map, "--cold"]);
    assert_eq!(there.code, Some(0), "{}", there.whole(&cli));
    let instance = cli.path().join(".run/qcbus/default");
    // An earlier command may have created it.
    let _ = std::fs::remove_dir(&instance);
    std::fs::write(&instance, "no directory").unwrap();
    for more in [&[][..], &["--cold"]] {
        let said = cli.qcbus(&[&["check", map], more].concat());
        assert_eq!(said.whole(&cli), there.whole(&cli), "{more:?}");
    }
    // An instance that is named explicitly is not ignored.
    let said = cli.qcbus(&["check", map, "--instance", "../other"]);
    assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
    assert!(said.stderr.contains("../other"), "{}", said.whole(&cli));
}
