//! Python modules run in a fork server, and this does not change the result.

use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Stdio};

/// A module that states in its result which process started it. For a real file, it executes the
/// inserted code.
const MODULE: &str = r#"#!PYTHON
import os, re, signal, sys

NUMBER = [0]

def main():
    with open(sys.argv[2]) as file:
        config = file.read()
    value = lambda name: re.search('name="%s" value="([^"]*)"' % name, config).group(1)
    path = value("InputFile")
    NUMBER[0] += 1
    with open("/proc/%d/cmdline" % os.getppid(), "rb") as file:
        warm = b"python" in file.read().split(b"\0")[0]
    issue = ""
    if not path.endswith("sample.xodr"):
        DEED
        text = "%s, job %d of this process" % ("warm" if warm else "plain", NUMBER[0])
        issue = '<Issue issueId="0" level="2" ruleUID="a.example:xodr:1.0.0:b" description="%s"/>' % text
    with open(value("resultFile"), "w") as file:
        file.write('<CheckerResults version="1"><CheckerBundle name="g" version="1" build_date="" description="" '
                   'summary=""><Checker checkerId="one" status="completed" description="" summary="">%s</Checker>'
                   '</CheckerBundle></CheckerResults>' % issue)

if __name__ == "__main__":
    main()
"#;

/// Returns the output of a module that executes this code for a real file, or `None` if there is no
/// Python.
fn says(deed: &str, more: &[&str]) -> Option<String> {
    // The path must be the interpreter itself, not a script that finds it.
    let asked = Command::new("python3")
        .args(["-c", "import sys; print(sys.executable, end='')"])
        .output();
    let Some(python) = asked.ok().filter(|it| it.status.success()) else {
        eprintln!("skipped: there is no python3 on the PATH");
        return None;
    };
    let dir = tempfile::tempdir().unwrap();
    let program = dir.path().join("module");
    let python = String::from_utf8(python.stdout).unwrap();
    let text = MODULE.replace("PYTHON", &python).replace("DEED", deed);
    std::fs::write(&program, text).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let file = dir.path().join("real.xodr");
    std::fs::write(&file, include_str!("../../src/samples/sample.xodr")).unwrap();
    let command = format!("{} -c $ASAM_QC_FRAMEWORK_CONFIG_FILE", program.display());
    let scratch = dir.path().join("scratch");
    let output = Command::new(env!("CARGO_BIN_EXE_qcbus-asam-adapter"))
        .args(["--name", "guest", "--kind", "xodr", "--exec", &command])
        .arg("--scratch")
        .arg(&scratch)
        .args(more)
        .arg(&file)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    assert_eq!(std::fs::read_dir(scratch).unwrap().count(), 0, "{said}");
    Some(said)
}

#[test]
fn module_runs_on_fork_server_unless_disabled() {
    let Some(warm) = says("pass", &[]) else {
        return;
    };
    assert!(warm.contains("warm, job 1 of this process"), "{warm}");
    let plain = says("pass", &["--cold"]).unwrap();
    assert!(plain.contains("plain, job 1 of this process"), "{plain}");
}

#[test]
fn run_that_kills_its_fork_server_is_repeated_plainly() {
    let deed = "if warm: os.kill(os.getppid(), signal.SIGKILL); signal.pause()";
    let Some(said) = says(deed, &[]) else { return };
    assert!(said.contains("plain, job 1 of this process"), "{said}");
    let stopped = "if warm: os.kill(os.getppid(), signal.SIGSTOP); os._exit(0)";
    let said = says(stopped, &["--seconds", "2"]).unwrap();
    assert!(
        said.contains("one failed") || said.contains("plain"),
        "{said}"
    );
}

#[test]
fn fork_server_run_is_held_to_its_limits() {
    for (deed, why) in [
        ("while True: pass", "did not finish within 2 s"),
        ("os._exit(3)", "exit code 3"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", "signal 11"),
        ("raise ValueError('oh no')", "ValueError: oh no"),
        (
            "os.setsid; [os.fork() for _ in range(9)]; signal.pause()",
            "was killed",
        ),
    ] {
        let Some(said) = says(deed, &["--seconds", "2"]) else {
            return;
        };
        assert!(
            said.contains("one failed") && said.contains(why),
            "{deed}: {said}"
        );
    }
}
