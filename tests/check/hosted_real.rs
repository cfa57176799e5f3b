//! ASAM's own modules report the same when they are hosted as when they run alone.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::asam_venv;
use crate::support::cli::{Cli, files_below, read_result};
use crate::support::inside::skip;
use qcbus_formats::xqar::{CheckerBundle, Location, Locations, Status};

/// Number of cases that are tried, evenly spread. `QCBUS_ALL_CASES` selects all cases.
const SOME: usize = 13;

/// A module: its program, the name of its section in its code, its kind of files.
struct Module {
    program: PathBuf,
    name: String,
    kind: String,
}

impl Module {
    fn new(program: PathBuf, name: &str, kind: &str) -> Module {
        Module {
            program,
            name: name.to_owned(),
            kind: kind.to_owned(),
        }
    }

    fn takes(&self, file: &Path) -> bool {
        file.extension().is_some_and(|it| *it == *self.kind)
    }

    /// Returns the name under which the module joins.
    fn joined_as(&self) -> String {
        match self.name.as_str() {
            "xodrBundle" | "xoscBundle" => format!("asam.{}", self.name),
            _ => self.name.clone(),
        }
    }
}

/// Variable with one further module, if available: program, name of its section and kind of files,
/// separated by spaces.
const ANOTHER: &str = "QCBUS_ANOTHER_MODULE";

fn modules(programs: &Path) -> Vec<Module> {
    let mut modules = vec![
        Module::new(programs.join("qc_opendrive"), "xodrBundle", "xodr"),
        Module::new(programs.join("qc_openscenario"), "xoscBundle", "xosc"),
    ];
    let Ok(another) = std::env::var(ANOTHER) else {
        skip("another module", &format!("{ANOTHER} is not set"));
        return modules;
    };
    let words: Vec<&str> = another.split(' ').collect();
    let [program, name, kind] = words[..] else {
        panic!("{ANOTHER} must be a program, a name and a kind: {another}");
    };
    modules.push(Module::new(program.into(), name, kind));
    modules
}

/// Number of files in one run: a slow machine can do so many before the watchdog ends it.
const IN_ONE_RUN: usize = 20;

/// Output of a checker: its status and its findings.
type Said = BTreeSet<(String, String, String)>;

/// Returns the output of a bundle, without rows and columns, because pooling adds such places.
fn said(bundle: &CheckerBundle) -> Said {
    let mut all = Said::new();
    for checker in &bundle.checkers {
        let id = checker.id.to_string();
        let status = match checker.status {
            // If the reason of a skip is no answer, pooling reports the same for both.
            Some(Status::Skipped) => "skipped".to_owned(),
            other => format!("{other:?}"),
        };
        all.insert((id.clone(), status, String::new()));
        for issue in &checker.issues {
            let places: Vec<String> = issue.locations.iter().map(place).collect();
            let what = format!("{:?} {} {}", issue.level, issue.rule_uid, issue.description);
            all.insert((id.clone(), what, places.join("; ")));
        }
    }
    all
}

fn place(locations: &Locations) -> String {
    let is_added = |it: &&Location| !matches!(it, Location::File { .. });
    let places: Vec<String> = locations
        .places
        .iter()
        .filter(is_added)
        .map(|it| format!("{it:?}"))
        .collect();
    let description = without_addresses(&locations.description);
    format!("{description} {}", places.join(" "))
}

/// Removes the memory addresses of Python objects, because they differ each time.
fn without_addresses(text: &str) -> String {
    let mut pieces = text.split(" at 0x");
    let mut whole = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        whole.push_str(piece.trim_start_matches(|c: char| c.is_ascii_hexdigit()));
    }
    whole
}

/// Returns the output of a module for a file when it is run by hand, or `None` if it fails.
fn alone(cli: &Cli, module: &Module, file: &Path) -> Option<Said> {
    let directory = cli.path().join("alone");
    std::fs::create_dir_all(&directory).unwrap();
    let config = directory.join("config.xml");
    let text = format!(
        "<Config><Param name=\"InputFile\" value=\"{}\"/><CheckerBundle application=\"{}\">\
         <Param name=\"resultFile\" value=\"own.xqar\"/></CheckerBundle></Config>",
        file.display(),
        module.name
    );
    std::fs::write(&config, text).unwrap();
    let result = directory.join("own.xqar");
    let _ = std::fs::remove_file(&result);
    let mut command = Command::new(&module.program);
    command.arg("-c").arg(&config).current_dir(&directory);
    let output = command.output().unwrap();
    let succeeded = output.status.success();
    succeeded.then(|| said(&read_result(&result).bundles[0]))
}

/// Returns the output of a hosted module, without qcbus's own checker.
fn hosted(cli: &Cli, module: &Module, input: &Path) -> Said {
    let result = cli.path().join("out");
    let results = read_result(&result.join(format!("{}.xqar", input.display())));
    let name = module.joined_as();
    let bundle = results.bundles.iter().find(|it| it.name == name);
    let bundle = bundle.unwrap_or_else(|| panic!("{name} must judge {input:?}"));
    let mut said = said(bundle);
    // A missing bundle reports nothing itself, so the broker's text is the only information.
    let absent = bundle
        .checkers
        .iter()
        .filter(|it| &*it.id == "qcbus_bundle_is_there");
    said.extend(absent.map(|it| (it.id.to_string(), "why".to_owned(), it.summary.to_string())));
    said.retain(|(id, ..)| id != "check_qcbus_asam_module_is_known");
    said
}

/// Returns the differences between a hosted module and the same module alone.
fn differences(cli: &Cli, module: &Module, input: &Path) -> Vec<String> {
    let hosted = hosted(cli, module, input);
    let Some(alone) = alone(cli, module, &cli.path().join(input)) else {
        // A module that gives no result alone must not give one here.
        let silent = hosted.iter().all(|(_, what, _)| what == "Some(Error)");
        let differs = (!silent).then(|| format!("{}: it fails alone: {hosted:?}", input.display()));
        return differs.into_iter().collect();
    };
    let mut found = Vec::new();
    for (one, other, what) in [(&hosted, &alone, "hosted"), (&alone, &hosted, "alone")] {
        let only = one.difference(other);
        found.extend(only.map(|it| format!("{}: only {what}: {it:?}", input.display())));
    }
    found
}

#[test]
fn hosted_modules_agree_with_their_standalone_runs() {
    let test = "hosted_modules_agree_with_their_standalone_runs";
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases/asam");
    if !cases.is_dir() {
        return skip(test, "there is no ../shared/cases/asam");
    }
    let programs = match asam_venv::programs() {
        Ok(programs) => programs,
        Err(why) => return skip(test, &format!("ASAM's modules cannot be installed: {why}")),
    };
    let modules = modules(&programs);
    let cli = Cli::new();
    for file in files_below(&cases) {
        let bytes = std::fs::read(cases.join(&file)).unwrap();
        cli.write(&format!("cases/{}", file.display()), bytes);
    }
    let manifests = modules.iter().map(|module| {
        let command = module.program.display();
        serde_json::json!({
            "name": module.name,
            "exec_type": "executable",
            "module_type": "checker_bundle",
            "exec_command": format!("{command} -c $ASAM_QC_FRAMEWORK_CONFIG_FILE"),
        })
    });
    let manifests: Vec<serde_json::Value> = manifests.collect();
    cli.write(
        "bundles.d/asam.json",
        serde_json::json!({ "module": manifests }).to_string(),
    );
    let inputs = inputs(&cli);
    let mut found = Vec::new();
    for some in inputs.chunks(IN_ONE_RUN) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command
            .args(["check", "--all", "--bundles-d", "bundles.d", "--out", "out"])
            .args(some);
        cli.run(&mut command);
        for input in some {
            let theirs = modules.iter().filter(|it| it.takes(input));
            found.extend(theirs.flat_map(|it| differences(&cli, it, input)));
        }
    }
    let (count, inputs) = (found.len(), inputs.len());
    assert!(
        found.is_empty(),
        "{count} differences over {inputs} inputs:\n{}",
        found.join("\n")
    );
}

/// Returns the files that are tried.
fn inputs(cli: &Cli) -> Vec<PathBuf> {
    let root = cli.path().join("cases");
    let mut all: Vec<PathBuf> = files_below(&root)
        .into_iter()
        .map(|it| Path::new("cases").join(it))
        .filter(|it| {
            it.extension()
                .is_some_and(|it| it == "xodr" || it == "xosc")
        })
        .collect();
    all.sort();
    assert!(all.len() > SOME, "{all:?}");
    if std::env::var_os("QCBUS_ALL_CASES").is_some() {
        return all;
    }
    let step = all.len().div_ceil(SOME);
    all.into_iter().step_by(step).collect()
}
