//! The user's own schemas from end to end: command line, configuration, bundle, result file.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use sha2::{Digest, Sha256};
use tempfile::TempDir;

const MAP: &str = "<OpenDRIVE>\n<header revMajor=\"1\" revMinor=\"7\"/>\n<road/>\n</OpenDRIVE>\n";
const CHECKER: &str = "check_asam_xodr_xml_valid_schema";
/// Schema that knows only a header.
const OWN: &str = r#"<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">
<xs:element name="OpenDRIVE"><xs:complexType><xs:sequence>
<xs:element name="header" type="xs:anyType"/>
</xs:sequence></xs:complexType></xs:element>
</xs:schema>"#;
const BROKEN: &str = "<xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\">\n<xs:import namespace=\"x\"/>\n</xs:schema>";

/// Creates a folder with a map and two folders of schemas, one of them broken.
fn cli() -> TempDir {
    let cli = TempDir::new().unwrap();
    let write = |name: &str, text: &str| {
        let path = cli.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("map.xodr", MAP);
    write("own/map.xsd", OWN);
    write("broken/map.xsd", BROKEN);
    cli
}

/// A broker that ends together with its test, even if the test fails.
struct Broker<'d> {
    process: Child,
    cli: &'d Path,
}

impl<'d> Broker<'d> {
    fn serve(cli: &'d Path, options: &[&str]) -> Broker<'d> {
        let process = Command::new(env!("CARGO_BIN_EXE_qcbus"))
            .args(["serve", ".", "--instance", "schemas"])
            .args(options)
            .current_dir(cli)
            .env("XDG_RUNTIME_DIR", cli)
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        Broker { process, cli }
    }

    fn ask(&self, command: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_qcbus"))
            .args(command)
            .args(["--instance", "schemas"])
            .current_dir(self.cli)
            .env("XDG_RUNTIME_DIR", self.cli)
            .output()
            .unwrap()
    }

    /// Returns the result for the current map.
    fn judge(&mut self) -> String {
        // `wait` returns the exit code 4 until the broker is there.
        while self
            .ask(&["wait", "map.xodr", "-q", "--timeout", "60s"])
            .status
            .code()
            == Some(4)
        {
            assert!(
                self.process.try_wait().unwrap().is_none(),
                "the broker must keep running"
            );
        }
        result(self.cli, "qcbus-out/map.xodr.xqar")
    }

    fn down(mut self) {
        self.ask(&["down"]);
        self.process.wait().unwrap();
    }
}

impl Drop for Broker<'_> {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn qcbus(cli: &Path, arguments: &[&str]) -> Output {
    let runtime = cli.join("run");
    std::fs::create_dir_all(&runtime).unwrap();
    Command::new(env!("CARGO_BIN_EXE_qcbus"))
        .args(arguments)
        .current_dir(cli)
        .env("XDG_RUNTIME_DIR", runtime)
        .output()
        .unwrap()
}

fn configuration(cli: &Path, global: &str, bundle: &str, checker: &str) {
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
    std::fs::write(cli.join("config.xml"), text).unwrap();
}

fn result(cli: &Path, name: &str) -> String {
    std::fs::read_to_string(cli.join(name)).unwrap()
}

fn names_own_schema(cli: &Path, result: &str) -> bool {
    let digest = Sha256::digest(OWN.as_bytes());
    let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    let file = cli.join("own/map.xsd");
    result.contains(&format!("sha256:{digest}"))
        && result.contains(&file.display().to_string())
        && result.contains("&lt;road&gt; is not allowed in &lt;")
}

#[test]
fn schema_flag_reaches_the_bundles_and_the_result() {
    let cli = cli();
    let output = qcbus(
        cli.path(),
        &["check", "-q", "--schema-dir", "own", "map.xodr"],
    );
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let result = result(cli.path(), "qcbus-out/map.xodr.xqar");
    assert!(names_own_schema(cli.path(), &result), "{result}");
}

#[test]
fn broken_schema_stops_every_command_at_the_start() {
    let cli = cli();
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
        let output = qcbus(cli.path(), arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(
            said.contains("broken/map.xsd:2:1: <xs:import>"),
            "{arguments:?}: {said}"
        );
    }
}

#[test]
fn checker_schema_precedes_bundle_and_global_schema() {
    let cli = cli();
    let own = cli.path().join("own").display().to_string();
    for (global, bundle, checker) in [
        (own.as_str(), "", ""),
        ("broken", own.as_str(), ""),
        ("broken", "broken", own.as_str()),
    ] {
        configuration(cli.path(), global, bundle, checker);
        let output = qcbus(cli.path(), &["check", "-q", "-c", "config.xml", "map.xodr"]);
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        let result = result(cli.path(), "Result.xqar");
        assert!(names_own_schema(cli.path(), &result), "{result}");
    }
}

#[test]
fn broken_configured_schema_is_an_error_of_the_checker() {
    let cli = cli();
    configuration(cli.path(), "", "broken", "");
    let output = qcbus(cli.path(), &["check", "-q", "-c", "config.xml", "map.xodr"]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let found = result(cli.path(), "Result.xqar");
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
    let output = qcbus(cli.path(), &flagged);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let found = result(cli.path(), "Result.xqar");
    assert!(names_own_schema(cli.path(), &found), "{found}");
}

#[test]
fn other_schemas_make_the_next_broker_judge_again() {
    let cli = cli();
    let check = |schemas: &[&str]| {
        // The brokers run one after the other on the same state.
        let mut broker = Broker::serve(cli.path(), schemas);
        let found = broker.judge();
        broker.down();
        found
    };
    assert!(check(&[]).contains("OpenDRIVE 1.7"));
    assert!(names_own_schema(
        cli.path(),
        &check(&["--schema-dir", "own"])
    ));
    assert!(check(&[]).contains("OpenDRIVE 1.7"));
}

#[test]
fn running_broker_uses_a_changed_configured_schema() {
    let cli = cli();
    let write = |name: &str, text: &str| std::fs::write(cli.path().join(name), text).unwrap();
    let own = cli.path().join("own").display().to_string();
    configuration(cli.path(), "", "", &own);
    let mut broker = Broker::serve(cli.path(), &["-c", "config.xml"]);
    let found = broker.judge();
    assert!(names_own_schema(cli.path(), &found), "{found}");

    write(
        "own/map.xsd",
        &OWN.replace("</xs:seq", "<xs:element name=\"road\"/></xs:seq"),
    );
    write(
        "map.xodr",
        &MAP.replace("<road/>", "<road /><!-- saved -->"),
    );
    let found = broker.judge();
    assert!(found.contains("own/map.xsd sha256:"), "{found}");
    assert!(
        !found.contains("&lt;road&gt; is not allowed in &lt;"),
        "{found}"
    );

    write("own/map.xsd", BROKEN);
    write("map.xodr", MAP);
    let found = broker.judge();
    assert!(
        found.contains("own/map.xsd:2:1: &lt;xs:import&gt;"),
        "{found}"
    );
    broker.down();
}

#[test]
fn schema_tables_take_the_version_from_the_directory_name() {
    let cli = cli();
    let dir = cli.path().join("acme-1.7");
    std::fs::create_dir(&dir).unwrap();
    std::fs::write(dir.join("map.xsd"), OWN).unwrap();
    let compile = ["schema", "compile", "acme-1.7", "-o", "own.tbl"];
    let output = qcbus(cli.path(), &compile);
    assert!(output.status.success(), "{output:?}");
    let tables = result(cli.path(), "own.tbl");
    assert!(tables.contains("\ntitle acme-1.7\n"), "{tables}");

    let map = |minor: &str| {
        let text = MAP.replace("revMinor=\"7\"", &format!("revMinor=\"{minor}\""));
        std::fs::write(cli.path().join("map.xodr"), text).unwrap();
        qcbus(
            cli.path(),
            &["check", "-q", "--schema-dir", "own.tbl", "map.xodr"],
        );
        result(cli.path(), "qcbus-out/map.xodr.xqar")
    };
    assert!(map("7").contains("own.tbl sha256:"));
    assert!(map("6").contains("OpenDRIVE 1.6"));
}
