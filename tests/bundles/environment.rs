//! A broker with its program in a Python environment that is not activated.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::farm::{Farm, tail, zoo};
use crate::support::programs::{copy_program, told, write_script};
use crate::support::watchdog::until_or;

/// Search path of a service or of cron.
const PATH: &str = "/usr/local/bin:/usr/bin:/bin";

/// A farm, and an environment with a program and an "interpreter", which is always a bundle.
struct Service {
    farm: Farm,
    program: PathBuf,
    python: PathBuf,
    broker: Option<Broker>,
}

impl Service {
    fn new() -> Service {
        let farm = Farm::new();
        let environment = farm.base().join("venv");
        let programs = environment.join("bin");
        std::fs::create_dir_all(&programs).unwrap();
        std::fs::write(environment.join("pyvenv.cfg"), "home = /usr/bin\n").unwrap();
        let program = programs.join("qcbus");
        copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), &program);
        let python = programs.join("python3");
        write_script(&python, &as_a_bundle("2.0.0"));
        std::fs::write(farm.base().join("mine.py"), "pass\n").unwrap();
        Service {
            farm,
            program,
            python,
            broker: None,
        }
    }

    fn start(mut self) -> Service {
        let mut command = Command::new(&self.program);
        command.args(self.farm.serve_command().get_args());
        let command = command.arg("--no-standard-bundles").env("PATH", PATH);
        self.broker = Some(Broker::start(command, &self.farm.log_path()));
        let answers = || self.farm.status().map(drop);
        until_or("it answers", answers, || tail(&self.farm.log()));
        self
    }

    /// Adds a script with the program of the environment.
    fn add(&self, program: &Path, more: &[&str]) -> (Option<i32>, String) {
        let mut command = Command::new(program);
        command.args(["bundle", "add", "mine"]).args(more);
        command.arg("--instance-dir").arg(self.farm.instance());
        told(&command.env("PATH", PATH).output().unwrap())
    }

    fn script(&self) -> PathBuf {
        self.farm.base().join("mine.py")
    }

    /// Returns the command in the written manifest.
    fn command(&self) -> String {
        let manifest = std::fs::read(self.farm.bundles_d().join("mine.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
        manifest["module"][0]["exec_command"]
            .as_str()
            .unwrap()
            .to_owned()
    }

    /// Waits until the bundle is ready and returns its version.
    fn version(&self) -> String {
        let ready = || {
            let mut peers = self.farm.status()?.peers.into_iter();
            Some(
                peers
                    .find(|it| it.name == "mine" && it.state == "ready")?
                    .version,
            )
        };
        until_or("it is ready", ready, || tail(&self.farm.log()))
    }

    /// Checks whether the manifest names the interpreter of the environment.
    fn runs_own_python(&self) -> bool {
        self.command().starts_with(self.python.to_str().unwrap())
    }
}

/// Returns an interpreter that ignores the script and runs a bundle of this version.
fn as_a_bundle(version: &str) -> String {
    let zoo = zoo();
    format!(
        "#!/bin/sh\nshift\nexec {} polite --name mine --version {version} \"$@\"\n",
        zoo.display()
    )
}

#[test]
fn script_is_run_by_the_interpreter_beside_the_program() {
    let service = Service::new().start();
    let script = service.script();
    let (code, text) = service.add(&service.program, &[script.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{text}");
    let expected = format!("{} {}", service.python.display(), script.display());
    assert_eq!(service.command(), expected);
    assert_eq!(service.version(), "2.0.0");
}

#[test]
fn link_to_a_program_belongs_to_its_environment() {
    let service = Service::new().start();
    let link = service.farm.base().join("qcbus");
    symlink(&service.program, &link).unwrap();
    let script = service.script();
    let (code, text) = service.add(&link, &[script.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{text}");
    assert!(service.runs_own_python(), "{}", service.command());
}

#[test]
fn first_line_of_a_script_selects_the_interpreter() {
    let service = Service::new().start();
    let (script, other) = (service.script(), service.farm.base().join("other python"));
    write_script(&other, &as_a_bundle("3.0.0"));
    let link = service.farm.base().join("python9");
    symlink(&other, &link).unwrap();
    let add = |first: &str| {
        std::fs::write(&script, format!("{first}\npass\n")).unwrap();
        let (code, text) = service.add(&service.program, &[script.to_str().unwrap()]);
        (code, text)
    };
    let named = format!("#!{}", link.display());
    let cases = [(&*named, "3.0.0"), ("#!/usr/bin/env python3", "2.0.0")];
    for (first, version) in cases {
        let (code, text) = add(first);
        assert_eq!(code, Some(0), "{first}: {text}");
        assert_eq!(service.version(), version, "{first}");
    }
    let (code, text) = add("#!/nowhere/python3");
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("cannot run /nowhere/python3"), "{text}");
    assert!(text.contains("mine.py)"), "{text}");
}

#[test]
fn python_in_a_manifest_means_the_environment() {
    let service = Service::new().start();
    let module = serde_json::json!({
        "name": "mine",
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": format!("python3 {}", service.script().display()),
        "mode": "bus",
    });
    service.farm.let_in_module("mine", &module);
    assert_eq!(service.version(), "2.0.0");
}

#[test]
fn python_of_the_environment_runs_a_one_shot_module() {
    const MANNERS: &str =
        include_str!("../../bundles/asam-adapter/tests/modules/guests/manners.sh");
    let service = Service::new();
    write_script(&service.python, "#!/bin/sh\nexec sh \"$@\"\n");
    let service = service.start();
    std::fs::write(service.script(), MANNERS).unwrap();
    let module = serde_json::json!({
        "name": "mine",
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": format!("python3 {}", service.script().display()),
    });
    service.farm.let_in_module("mine", &module);
    assert_eq!(service.version(), "7.1");
    // The command writes the whole path of the same interpreter.
    let command = format!("python3 {}", service.script().display());
    let (code, text) = service.add(&service.program, &["--asam", &command]);
    assert_eq!(code, Some(0), "{text}");
    assert!(service.runs_own_python(), "{}", service.command());
}

#[test]
fn last_output_of_a_failing_bundle_is_shown() {
    let service = Service::new();
    let said = "Traceback (most recent call last):\n  File \"mine.py\", line 1\n\
                ModuleNotFoundError: No module named 'qcbus'\n\u{1b}[2Kerror: none\n";
    let failing = format!("#!/bin/sh\ncat >&2 <<'X'\n{said}X\nexit 1\n");
    write_script(&service.python, &failing);
    let service = service.start();
    let script = service.script();
    let (code, text) = service.add(&service.program, &[script.to_str().unwrap()]);
    assert_eq!(code, Some(2), "{text}");
    let expected = "last output of `mine` (the full output is in the broker's log):\n  Traceback (most recent call last):\n    File \"mine.py\", line 1\n  ModuleNotFoundError: No module named 'qcbus'\n  \\u{1b}[2Kerror: none\n";
    assert!(text.contains(expected), "{text}");
    assert!(
        text.contains("`mine` is not ready: it ended with exit code 1"),
        "{text}"
    );
    assert!(
        service.farm.log().contains("ModuleNotFoundError"),
        "{}",
        service.farm.log()
    );
}
