//! ASAM modules on the bus: added by a manifest, by a command, or by a configuration alone.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::cli::{Cli, Said, files_below, read_result};
use crate::support::content::Content;
use crate::support::farm::Farm;
use crate::support::inside::skip;
use crate::support::processes::all_with;
use crate::support::programs::{install_script, told};
use crate::support::watchdog::{until, until_or};
use qcbus_formats::xqar::{CheckerBundle, Results, Status};
use qcbus_messages::Verdict;

const MANNERS: &str = include_str!("../../bundles/asam-adapter/tests/modules/guests/manners.sh");

/// Script that finds something in every file.
const FINDS: &str = r#"{ begin; checker one completed "$(issue 1 "wrong in $input")"; checker two completed; end; } > "$result""#;

/// Installs a module that is polite for small files and runs this script for real ones.
fn install(path: &Path, script: &str) {
    install_script(path, &format!("#!/bin/sh\n{MANNERS}\n{script}\n"));
}

fn manifest(name: &str, command: &str, more: &serde_json::Value) -> String {
    let mut module = serde_json::json!({
        "name": name,
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": command,
        "kinds": ["xodr"],
    });
    for (key, value) in more.as_object().into_iter().flatten() {
        module[key] = value.clone();
    }
    serde_json::json!({ "module": [module] }).to_string()
}

fn bundle<'r>(results: &'r Results, name: &str) -> &'r CheckerBundle {
    let found = results.bundles.iter().find(|it| it.name == name);
    found.unwrap_or_else(|| panic!("the result must contain bundle {name}"))
}

/// Returns the status of each checker with the number of its issues.
fn endings(bundle: &CheckerBundle) -> Vec<(String, Option<Status>, usize)> {
    let checkers = bundle.checkers.iter();
    checkers
        .map(|it| (it.id.to_string(), it.status, it.issues.len()))
        .collect()
}

const OWN: &str = "check_qcbus_asam_module_is_known";

/// Returns the expected endings of a guest that has found one issue.
fn found_one() -> Vec<(String, Option<Status>, usize)> {
    let done = |id: &str, issues| (id.to_owned(), Some(Status::Completed), issues);
    vec![done("one", 1), done("two", 0), done(OWN, 0)]
}

/// A cli with a guest and its manifest.
struct Table {
    cli: Cli,
    program: PathBuf,
}

impl Table {
    fn with(script: &str, name: &str, more: &serde_json::Value) -> Table {
        let cli = Cli::new();
        let program = cli.path().join("qc_guest");
        install(&program, script);
        let text = manifest(name, &program.to_string_lossy(), more);
        cli.write("bundles.d/guest.json", text);
        cli.write("a.xodr", Content::Good(1).bytes());
        cli.write("tmp/x", "");
        Table { cli, program }
    }

    fn check(&self, arguments: &[&str]) -> Said {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.arg("check").args(arguments).args(["--out", "out"]);
        let path = std::env::var_os("PATH").unwrap_or_default();
        let own = std::iter::once(self.cli.path().to_path_buf());
        let path: OsString = std::env::join_paths(own.chain(std::env::split_paths(&path))).unwrap();
        command.env("PATH", path);
        command.env("TMPDIR", self.cli.path().join("tmp"));
        self.cli.run(&mut command)
    }
}

#[test]
fn manifest_of_the_asam_framework_is_sufficient() {
    let table = Table::with(FINDS, "guest", &serde_json::Value::Null);
    let said = table.check(&["a.xodr", "--bundles-d", "bundles.d"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&table.cli));
    let results = table.cli.result("out/a.xodr.xqar");
    let guest = bundle(&results, "guest");
    assert_eq!(endings(guest), found_one());
    assert_eq!(
        (guest.version.as_str(), guest.description.as_str()),
        ("7.1", "a guest")
    );
    let issue = &guest.checkers[0].issues[0];
    let real = table.cli.path().join("a.xodr");
    assert_eq!(issue.description, format!("wrong in {}", real.display()));
    assert_eq!(issue.rule_uid, "guest.example:xodr:1.0.0:rule");
    assert_eq!(*guest.checkers[0].description, *"what one checks");
    assert!(said.stdout.contains("wrong in"), "{}", said.stdout);
    // No private directory is left.
    assert_eq!(rooms(&table.cli.path().join("tmp")), Vec::<PathBuf>::new());
}

#[test]
fn module_named_like_a_standard_bundle_joins_beside_it() {
    let table = Table::with(FINDS, "xodrBundle", &serde_json::Value::Null);
    let said = table.check(&["a.xodr", "--bundles-d", "bundles.d"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&table.cli));
    assert!(
        said.stderr.contains("joins as `asam.xodrBundle`"),
        "{}",
        said.stderr
    );
    let results = table.cli.result("out/a.xodr.xqar");
    assert_eq!(endings(bundle(&results, "asam.xodrBundle")), found_one());
    assert!(bundle(&results, "xodrBundle").checkers.len() > 100);
}

#[test]
fn configured_parameters_reach_the_module() {
    let script = r#"[ "$(value limit)" = "a & b" ] || exit 4
        grep -q 'checkerId="one"' "$config" || exit 5
        polite"#
        .replace("\"a & b\"", "\"a &amp; b\"");
    let table = Table::with(&script, "mine", &serde_json::Value::Null);
    table.cli.write(
        "config.xml",
        r#"<Config><CheckerBundle application="mine"><Param name="limit" value="a &amp; b"/>
           <Checker checkerId="one" maxLevel="1" minLevel="3"/></CheckerBundle></Config>"#,
    );
    let said = table.check(&["a.xodr", "-c", "config.xml", "--bundles-d", "bundles.d"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&table.cli));
    let results = table.cli.result("out/Result.xqar");
    let one = ("one".to_owned(), Some(Status::Completed), 0);
    assert_eq!(endings(bundle(&results, "mine")), [one]);
}

#[test]
fn configuration_alone_starts_a_program_on_the_path() {
    let script = r#"[ "$1 $2" = "-c $config" ] || exit 4
        polite"#;
    let table = Table::with(script, "unused", &serde_json::Value::Null);
    let named = |name: &str| {
        let text = format!("<Config><CheckerBundle application=\"{name}\"/></Config>");
        table.cli.write("config.xml", text);
        table.check(&["a.xodr", "-c", "config.xml"])
    };
    let said = named("qc_guest");
    assert_eq!(said.code, Some(0), "{}", said.whole(&table.cli));
    let results = table.cli.result("out/Result.xqar");
    assert!(endings(bundle(&results, "qc_guest")).len() == 3);
    // A program that does not look like a module is not run, even if a configuration names it.
    std::fs::rename(&table.program, table.cli.path().join("guest")).unwrap();
    let said = named("guest");
    assert_eq!(said.code, Some(3), "{}", said.whole(&table.cli));
}

#[test]
fn failing_module_leaves_the_file_undetermined() {
    let table = Table::with(
        "echo what a pity >&2; exit 9",
        "guest",
        &serde_json::Value::Null,
    );
    let said = table.check(&["a.xodr", "--bundles-d", "bundles.d"]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&table.cli));
    let results = table.cli.result("out/a.xodr.xqar");
    for checker in &bundle(&results, "guest").checkers {
        assert_eq!(checker.status, Some(Status::Error), "{}", checker.id);
        let summary = &*checker.summary;
        assert!(
            summary.contains("exit code 9") && summary.contains("what a pity"),
            "{summary}"
        );
    }
}

#[test]
fn module_cannot_write_or_signal_outside_its_directory() {
    if qcbus_confine::kernel_level() == 0 {
        skip(
            "it_writes_nowhere_else",
            "this kernel does not support Landlock",
        );
        return;
    }
    let script = r#"( echo x > "OUTSIDE" ) 2>/dev/null && exit 4
        ( echo x > "$ASAM_QC_FRAMEWORK_WORKING_DIR/inside" ) || exit 5
        ( echo x > "${ASAM_QC_FRAMEWORK_WORKING_DIR%/*/work}/other" ) 2>/dev/null && exit 6
        ( kill -0 $OUTER ) 2>/dev/null && exit 7
        polite"#;
    let table = Table::with(script, "guest", &serde_json::Value::Null);
    let outside = table.cli.path().join("outside");
    let own = std::process::id().to_string();
    let script = script.replace("OUTSIDE", &outside.to_string_lossy());
    install(&table.program, &script.replace("$OUTER", &own));
    let said = table.check(&["a.xodr", "--bundles-d", "bundles.d"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&table.cli));
    assert!(!outside.exists());
}

#[test]
fn run_settings_in_a_manifest_are_applied() {
    let script = r#"[ "$MINE" = "a b" ] || exit 4
        [ "$PWD" = "/" ] || exit 5
        grep -q 'application="inner"' "$config" || exit 6
        polite"#;
    let more = serde_json::json!({
        "environment": {"MINE": "a b"},
        "working_directory": "/",
        "application": "inner",
        "limits": {"seconds": 60, "memory_mb": 512, "output_mb": 8},
    });
    let table = Table::with(script, "guest", &more);
    let said = table.check(&["a.xodr", "--bundles-d", "bundles.d"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&table.cli));
    let wrong = [
        (
            serde_json::json!({"limits": {"secnds": 1}}),
            "limits.secnds",
        ),
        (
            serde_json::json!({"limits": {"seconds": 0}}),
            "limits.seconds",
        ),
        (serde_json::json!({"kinds": ["pdf"]}), "kinds"),
        (
            serde_json::json!({"environment": {"A": 1}}),
            "environment.A",
        ),
        (
            serde_json::json!({"working_directory": "here"}),
            "working_directory",
        ),
    ];
    for (more, key) in wrong {
        let table = Table::with("polite", "guest", &more);
        let said = table.check(&["a.xodr", "--bundles-d", "bundles.d"]);
        assert_eq!(said.code, Some(2), "{key}");
        assert!(said.stderr.contains(key), "{key}: {}", said.stderr);
    }
}

/// Creates a farm with a guest beside it. The guest's private directories are there, too.
fn farm_with(script: &str) -> (Farm, PathBuf, Broker) {
    let farm = Farm::new();
    let program = farm.base().join("guest");
    install(&program, script);
    std::fs::create_dir(farm.base().join("tmp")).unwrap();
    let mut command = farm.serve_command();
    command.env("TMPDIR", farm.base().join("tmp"));
    let broker = Broker::start(&mut command, &farm.log_path());
    until_or("it answers", || farm.status().map(drop), || farm.log());
    (farm, program, broker)
}

fn add(farm: &Farm, name: &str, program: &Path) -> (Option<i32>, String) {
    let command = format!("{} -c $ASAM_QC_FRAMEWORK_CONFIG_FILE", program.display());
    told(&farm.qcbus(&["bundle", "add", name, "--asam", &command]))
}

#[test]
fn command_is_split_as_by_a_shell() {
    let (farm, program, _broker) = farm_with(FINDS);
    let spaced = farm.base().join("a dir");
    std::fs::create_dir(&spaced).unwrap();
    std::fs::rename(program, spaced.join("guest")).unwrap();
    let base = farm.base().display();
    let add = |program: &str| {
        let command = format!("{program} -c \"$ASAM_QC_FRAMEWORK_CONFIG_FILE\"");
        told(&farm.qcbus(&["bundle", "add", "guest", "--asam", &command]))
    };
    for written in [
        format!("'{base}/a dir/guest'"),
        format!("\"{base}/a dir\"/guest"),
        format!("{base}/a\\ dir/guest"),
    ] {
        let (code, text) = add(&written);
        assert_eq!(code, Some(0), "{written}: {text}\n{}", farm.log());
        assert_eq!(
            farm.qcbus(&["bundle", "remove", "guest"]).status.code(),
            Some(0)
        );
    }
    let (code, text) = add(&format!("'{base}/a dir/guest"));
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("a quote is not closed"), "{text}");
    assert!(!farm.bundles_d().join("guest.json").exists());
}

#[test]
fn module_is_added_upgraded_and_removed_like_any_bundle() {
    let (farm, program, _broker) = farm_with(FINDS);
    let (code, text) = add(&farm, "guest", &program);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("guest: ready, 3 checkers (xodr, xosc)"),
        "{text}"
    );
    farm.write("a.xodr", &Content::Good(1).bytes());
    assert_eq!(
        farm.verdict("a.xodr").verdict,
        Verdict::Rejected,
        "{}",
        farm.log()
    );
    assert_eq!(
        endings(bundle(&farm.result("a.xodr"), "guest")),
        found_one()
    );
    let (_, status) = told(&farm.qcbus(&["status"]));
    assert!(status.contains("guest"), "{status}");
    let (code, rules) = told(&farm.qcbus(&["rule"]));
    assert_eq!(code, Some(0), "{rules}");
    assert!(rules.contains("what two checks"), "{rules}");

    // A replaced program judges again.
    install(&program, "polite");
    until_or(
        "the newer program has judged it again",
        || (farm.verdict("a.xodr").verdict == Verdict::Accepted).then_some(()),
        || farm.log(),
    );
    let (code, text) = told(&farm.qcbus(&["bundle", "remove", "guest"]));
    assert_eq!(code, Some(0), "{text}");
    farm.write("b.xodr", &Content::Good(2).bytes());
    assert_eq!(farm.verdict("b.xodr").verdict, Verdict::Accepted);
    assert!(
        farm.result("b.xodr")
            .bundles
            .iter()
            .all(|it| it.name != "guest")
    );
}

#[test]
fn unlearned_program_judges_no_file() {
    let (farm, program, _broker) = farm_with(FINDS);
    let (code, text) = add(&farm, "guest", &program);
    assert_eq!(code, Some(0), "{text}");
    farm.write("a.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Rejected);
    // The new program cannot be learned and finds nothing any more.
    let fails = MANNERS.replacen("polite; exit 0", "exit 3", 1);
    assert_ne!(fails, MANNERS);
    install_script(&program, &format!("#!/bin/sh\n{fails}\npolite\n"));
    let upgraded = farm.qcbus(&["bundle", "upgrade", "guest"]);
    assert_ne!(upgraded.status.code(), Some(0), "{}", told(&upgraded).1);
    farm.write("b.xodr", &Content::Good(2).bytes());
    let verdict = farm.verdict("b.xodr");
    assert_eq!(
        verdict.verdict,
        Verdict::Undetermined,
        "{verdict:?}\n{}",
        farm.log()
    );
    let health = farm.qcbus(&["status", "--health"]);
    assert_eq!(health.status.code(), Some(1), "{}", told(&health).1);
    // The previous program is back.
    install(&program, FINDS);
    let back = || (farm.verdict("b.xodr").verdict == Verdict::Rejected).then_some(());
    until_or("it judges again", back, || farm.log());
}

#[test]
fn unusable_module_is_removed_after_adding() {
    let (farm, program, _broker) = farm_with("polite");
    std::fs::write(&program, "#!/bin/sh\nexit 0\n").unwrap();
    let (code, text) = add(&farm, "guest", &program);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("it was removed again"), "{text}");
    until_or(
        "the log says why",
        || farm.log().contains("no result").then_some(()),
        || farm.log(),
    );
}

/// Returns the existing private directories.
fn rooms(tmp: &Path) -> Vec<PathBuf> {
    let roots = std::fs::read_dir(tmp).unwrap().flatten();
    let own = roots.filter(|it| it.file_name().to_string_lossy().starts_with("qcbus-asam-"));
    let modules = own
        .filter_map(|it| std::fs::read_dir(it.path()).ok())
        .flatten()
        .flatten();
    let entries = modules.filter_map(|it| std::fs::read_dir(it.path()).ok());
    entries.flatten().flatten().map(|it| it.path()).collect()
}

#[test]
fn killed_adapter_or_runner_leaves_no_process_behind() {
    // A run takes for ever until the file GO exists. Some of its children have left its session.
    let script = r#"[ -e "GO" ] || { setsid sh -c "sleep 86399.MARK & sleep 86399.MARK" & sleep 86399.MARK; }
        polite"#;
    for victim in ["--runner", "asam-adapter"] {
        let (farm, program, _broker) = farm_with("polite");
        let tmp = farm.base().join("tmp");
        let (go, mark) = (farm.base().join("go"), std::process::id().to_string());
        let script = script.replace("GO", &go.to_string_lossy());
        install(&program, &script.replace("MARK", &mark));
        assert_eq!(add(&farm, "guest", &program).0, Some(0));
        farm.write("a.xodr", &Content::Good(1).bytes());
        let sleeper = format!("86399.{mark}");
        let sleepers = || all_with(&sleeper);
        until_or(
            "it runs",
            || (sleepers().len() >= 3).then_some(()),
            || farm.log(),
        );
        std::fs::write(&go, "").unwrap();
        let base = farm.base().to_string_lossy().into_owned();
        for process in all_with(&base) {
            if process.words.iter().any(|word| word == victim) {
                process.signal(rustix::process::Signal::KILL);
            }
        }
        until_or(
            "it is judged",
            || (farm.verdict("a.xodr").verdict == Verdict::Accepted).then_some(()),
            || farm.log(),
        );
        until("nothing of the first run is left", || {
            sleepers().is_empty().then_some(())
        });
        until_or(
            "no directory is left",
            || rooms(&tmp).is_empty().then_some(()),
            || format!("{victim}: {:?}\n{}", rooms(&tmp), farm.log()),
        );
    }
}

#[test]
fn scenario_is_handed_over_with_its_references() {
    let script = r#"case "$input" in */scenarios/deep/a.xosc) ;; *) exit 4;; esac
        cmp "${input%/*}/../../maps/m.xodr" "REAL/maps/m.xodr" || exit 5
        polite"#;
    let more = serde_json::json!({"kinds": ["xosc"]});
    let table = Table::with(script, "guest", &more);
    let real = table.cli.path();
    install(
        &table.program,
        &script.replace("REAL", &real.to_string_lossy()),
    );
    table.cli.write("maps/m.xodr", Content::Good(1).bytes());
    let scenario = include_str!("../../bundles/asam-adapter/src/samples/sample.xosc").replace(
        "<RoadNetwork/>",
        "<RoadNetwork><LogicFile filepath=\"../../maps/m.xodr\"/></RoadNetwork>",
    );
    table.cli.write("scenarios/deep/a.xosc", scenario);
    table.check(&["scenarios/deep/a.xosc", "--bundles-d", "bundles.d"]);
    let out = real.join("out");
    let found = files_below(&out);
    let result = found.iter().find(|it| it.ends_with("a.xosc.xqar"));
    let result = result.unwrap_or_else(|| panic!("{found:?}"));
    let results = read_result(&out.join(result));
    let guest = bundle(&results, "guest");
    for checker in &guest.checkers {
        assert_eq!(
            checker.status,
            Some(Status::Completed),
            "{}",
            checker.summary
        );
    }
}

#[test]
fn shadow_can_be_a_one_shot_module() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let program = farm.base().join("qc_guest");
    install(&program, FINDS);
    // The manifests of ASAM's own modules have such commands.
    let command = format!("cd $ASAM_QC_FRAMEWORK_WORKING_DIR && {}", program.display());
    let said = farm.qcbus(&["bundle", "add", "--shadow", "guest", "--asam", &command]);
    let text = String::from_utf8([said.stdout, said.stderr].concat()).unwrap();
    assert!(
        text.contains("a shadow and does not affect verdicts"),
        "{text}"
    );
    farm.write("a.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    assert!(
        farm.result("a.xodr")
            .bundles
            .iter()
            .all(|it| it.name != "guest")
    );
    until_or(
        "it is tried",
        || {
            let said = farm.qcbus(&["bundle", "trials", "guest"]);
            let text = String::from_utf8(said.stdout).unwrap();
            text.contains("1 of 1 file tried").then_some(())
        },
        || farm.log(),
    );
}

/// A module that reads only plain files must not reject a good file because it is packed.
#[test]
fn packed_map_is_handed_over_unpacked() {
    let script = r#"grep -q "<OpenDRIVE" "$input" || exit 3
        { begin; checker one completed "$(issue 2 "odd in $input")"; checker two completed; end; } > "$result""#;
    let table = Table::with(script, "guest", &serde_json::Value::Null);
    for name in ["b.xodrz", "c.xodr.gz"] {
        let path = table.cli.path().join(name);
        let mut gzip = Command::new("gzip");
        gzip.arg("-c").arg(table.cli.path().join("a.xodr"));
        let packed = gzip.output().unwrap();
        assert!(packed.status.success(), "{packed:?}");
        std::fs::write(&path, packed.stdout).unwrap();
        table.check(&[name, "--bundles-d", "bundles.d"]);
        let results = table.cli.result(&format!("out/{name}.xqar"));
        let guest = bundle(&results, "guest");
        assert_eq!(endings(guest), found_one(), "{name}");
        let issue = &guest.checkers[0].issues[0];
        assert_eq!(issue.description, format!("odd in {}", path.display()));
    }
}

/// Script that counts the issues of a result, and writes one of its parameters to a file.
const REPORTS: &str = r#"config="$ASAM_QC_FRAMEWORK_CONFIG_FILE"
value() { sed -n "s/.*name=\"$1\" value=\"\([^\"]*\)\".*/\1/p" "$config" | head -n 1; }
grep -c "<Issue " "$(value strInputFile)" > "$(value strReportFile)"
mkdir more; echo "$(value lines)" > more/x.txt
"#;

#[test]
fn report_module_follows_every_result_and_removal() {
    let mut farm = Farm::new();
    let config = farm.base().join("config.xml");
    let text = "<Config><CheckerBundle application=\"xodrBundle\"/><ReportModule application=\"guestReport\">\
                <Param name=\"lines\" value=\"many\"/></ReportModule></Config>";
    std::fs::write(&config, text).unwrap();
    farm.arguments
        .extend(["-c".to_owned(), config.display().to_string()]);
    let_report_in(&farm, REPORTS);
    let _broker = farm.serve_ready();
    farm.write("a.xodr", &Content::NoHeader(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Rejected);
    let place = farm.out().join("a.xodr.guestReport");
    let read = |name: &str| std::fs::read_to_string(place.join(name)).ok();
    let issues = until_or("it has reported", || read("Report.txt"), || farm.log());
    assert_eq!(issues, "1\n");
    until_or(
        "all of it",
        || read("more/x.txt").filter(|it| it == "many\n"),
        || farm.log(),
    );
    std::fs::write(farm.root().join("a.xodr"), Content::Good(2).bytes()).unwrap();
    until_or(
        "the newer result has its report",
        || read("Report.txt").filter(|it| it == "0\n"),
        || farm.log(),
    );
    std::fs::remove_file(farm.root().join("a.xodr")).unwrap();
    until_or(
        "it is taken back",
        || (!place.exists()).then_some(()),
        || farm.log(),
    );
    let peers = farm.status().unwrap().peers;
    let peer = peers.iter().find(|it| it.name == "guestReport").unwrap();
    assert_eq!(peer.role, "reporter");
}

#[test]
fn failing_report_module_is_reported_and_delays_no_verdict() {
    let farm = Farm::new();
    let_report_in(&farm, "echo oh no >&2; exit 7");
    let _broker = farm.serve_ready();
    farm.write("a.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    until_or(
        "it is told",
        || {
            let peers = farm.status()?.peers;
            let peer = peers.into_iter().find(|it| it.name == "guestReport")?;
            (peer.note.contains("exit code 7") && peer.note.contains("oh no")).then_some(())
        },
        || farm.log(),
    );
    assert!(!farm.out().join("a.xodr.guestReport").exists());
}

/// Adds a report module that runs this script.
fn let_report_in(farm: &Farm, script: &str) {
    let program = farm.base().join("report");
    install_script(&program, &format!("#!/bin/sh\n{script}\n"));
    let module = serde_json::json!({
        "name": "guestReport",
        "exec_type": "executable",
        "module_type": "report_module",
        "exec_command": program,
    });
    farm.let_in_module("guestReport", &module);
}
