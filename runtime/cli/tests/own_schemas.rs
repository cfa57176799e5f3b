//! Schemas of the user, all the way: command line, configuration, bundle, result file.

#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot set up its desk has failed"
)]

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use sha2::{Digest, Sha256};
use tempfile::TempDir;

const MAP: &str = "<OpenDRIVE>\n<header revMajor=\"1\" revMinor=\"7\"/>\n<road/>\n</OpenDRIVE>\n";
const CHECKER: &str = "check_asam_xodr_xml_valid_schema";
/// A schema that knows a header and nothing else.
const OWN: &str = r#"<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">
<xs:element name="OpenDRIVE"><xs:complexType><xs:sequence>
<xs:element name="header" type="xs:anyType"/>
</xs:sequence></xs:complexType></xs:element>
</xs:schema>"#;
const BROKEN: &str = "<xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\">\n<xs:import namespace=\"x\"/>\n</xs:schema>";

/// A folder with a map and two folders of schemas, one of them broken.
fn desk() -> TempDir {
    let desk = TempDir::new().unwrap();
    let write = |name: &str, text: &str| {
        let path = desk.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("map.xodr", MAP);
    write("own/map.xsd", OWN);
    write("broken/map.xsd", BROKEN);
    desk
}

/// A broker that does not outlive a test that fails.
struct Broker(Child);

impl Drop for Broker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn qcbus(desk: &Path, arguments: &[&str]) -> Output {
    let runtime = desk.join("run");
    std::fs::create_dir_all(&runtime).unwrap();
    Command::new(env!("CARGO_BIN_EXE_qcbus"))
        .args(arguments)
        .current_dir(desk)
        .env("XDG_RUNTIME_DIR", runtime)
        .output()
        .unwrap()
}

fn configuration(desk: &Path, global: &str, bundle: &str, checker: &str) {
    let param = |value: &str| match value {
        "" => String::new(),
        value => format!("<Param name=\"schemaDir\" value=\"{value}\"/>"),
    };
    let text = format!(
        "<Config>{}<CheckerBundle application=\"xodrBundle\">{}\
         <Checker checkerId=\"{CHECKER}\" minLevel=\"3\" maxLevel=\"1\">{}</Checker></CheckerBundle></Config>",
        param(global),
        param(bundle),
        param(checker)
    );
    std::fs::write(desk.join("config.xml"), text).unwrap();
}

fn result(desk: &Path, name: &str) -> String {
    std::fs::read_to_string(desk.join(name)).unwrap()
}

fn names_own_schema(desk: &Path, result: &str) -> bool {
    let digest = Sha256::digest(OWN.as_bytes());
    let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    let file = desk.join("own/map.xsd");
    result.contains(&format!("sha256:{digest}"))
        && result.contains(&file.display().to_string())
        && result.contains("has no child &lt;road&gt;")
}

#[test]
fn the_flag_reaches_the_bundles_and_the_result_names_the_schema() {
    let desk = desk();
    let output = qcbus(
        desk.path(),
        &["check", "-q", "--schema-dir", "own", "map.xodr"],
    );
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let result = result(desk.path(), "qcbus-out/map.xodr.xqar");
    assert!(names_own_schema(desk.path(), &result), "{result}");
}

#[test]
fn a_broken_schema_ends_every_command_before_it_begins() {
    let desk = desk();
    for arguments in [
        &["check", "--schema-dir", "broken", "map.xodr"][..],
        &["serve", "--schema-dir", "broken", "."],
        &[
            "bundle",
            "run",
            "xodr",
            "--schema-dir",
            "broken",
            "map.xodr",
        ],
        &[
            "bundle",
            "run",
            "xodr",
            "--schema-dir",
            "broken",
            "-c",
            "config.xml",
        ],
    ] {
        let output = qcbus(desk.path(), arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(
            said.contains("broken/map.xsd:2:1: <xs:import>"),
            "{arguments:?}: {said}"
        );
    }
}

#[test]
fn a_configuration_names_schemas_checker_before_bundle_before_global() {
    let desk = desk();
    let own = desk.path().join("own").display().to_string();
    for (global, bundle, checker) in [
        (own.as_str(), "", ""),
        ("broken", own.as_str(), ""),
        ("broken", "broken", own.as_str()),
    ] {
        configuration(desk.path(), global, bundle, checker);
        let output = qcbus(
            desk.path(),
            &["check", "-q", "-c", "config.xml", "map.xodr"],
        );
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        let result = result(desk.path(), "Result.xqar");
        assert!(names_own_schema(desk.path(), &result), "{result}");
    }
}

#[test]
fn a_broken_schema_of_a_configuration_is_the_checkers_error_unless_the_flag_says_another() {
    let desk = desk();
    configuration(desk.path(), "", "broken", "");
    let output = qcbus(
        desk.path(),
        &["check", "-q", "-c", "config.xml", "map.xodr"],
    );
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let found = result(desk.path(), "Result.xqar");
    assert!(found.contains("status=\"error\""), "{found}");
    assert!(
        found.contains("broken/map.xsd:2:1: &lt;xs:import&gt;"),
        "{found}"
    );

    let flagged = [
        "check",
        "-q",
        "-c",
        "config.xml",
        "--schema-dir",
        "own",
        "map.xodr",
    ];
    let output = qcbus(desk.path(), &flagged);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let found = result(desk.path(), "Result.xqar");
    assert!(names_own_schema(desk.path(), &found), "{found}");
}

#[test]
fn other_schemas_make_a_running_broker_judge_again() {
    let desk = desk();
    let check = |schemas: &[&str]| {
        // Two brokers, one after the other, over one state.
        let arguments: Vec<&str> = [&["serve", ".", "--instance", "schemas"][..], schemas].concat();
        let mut broker = Command::new(env!("CARGO_BIN_EXE_qcbus"))
            .args(&arguments)
            .current_dir(desk.path())
            .env("XDG_RUNTIME_DIR", desk.path())
            .stderr(Stdio::null())
            .spawn()
            .map(Broker)
            .unwrap();
        let ask = |command: &[&str]| {
            Command::new(env!("CARGO_BIN_EXE_qcbus"))
                .args(command)
                .args(["--instance", "schemas"])
                .current_dir(desk.path())
                .env("XDG_RUNTIME_DIR", desk.path())
                .output()
                .unwrap()
        };
        // Until the broker is there, `wait` says so with exit code 4.
        while ask(&["wait", "map.xodr", "-q", "--timeout", "60s"])
            .status
            .code()
            == Some(4)
        {
            assert!(
                broker.0.try_wait().unwrap().is_none(),
                "the broker has ended"
            );
        }
        let found = result(desk.path(), "qcbus-out/map.xodr.xqar");
        ask(&["down"]);
        broker.0.wait().unwrap();
        found
    };
    assert!(check(&[]).contains("OpenDRIVE 1.7"));
    assert!(names_own_schema(
        desk.path(),
        &check(&["--schema-dir", "own"])
    ));
    assert!(check(&[]).contains("OpenDRIVE 1.7"));
}
