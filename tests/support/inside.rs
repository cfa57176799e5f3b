//! Runs a test in a mount namespace of its own, with small file systems that may be filled.

use std::process::{Command, ExitStatus};

/// Environment variable that is set for a test inside the namespace.
pub const INSIDE: &str = "QCBUS_TEST_INSIDE";

/// Returns whether this process runs inside the namespace.
pub fn is_inside() -> bool {
    std::env::var_os(INSIDE).is_some()
}

/// Returns the reason why nothing can be mounted here, or `None` if mounting works.
pub fn refused() -> Option<String> {
    let output = namespace("mount -t tmpfs -o size=1m tmpfs /dev/shm", &["true"]).output();
    match output {
        Err(error) => Some(format!("`unshare` cannot be run: {error}")),
        Ok(output) if !output.status.success() => {
            let why = String::from_utf8_lossy(&output.stderr).trim().to_owned();
            Some(format!(
                "mounting a tmpfs in a namespace of one's own is not allowed: {why}"
            ))
        }
        Ok(_) => None,
    }
}

/// Runs one test of this executable again inside a namespace, after the shell command `prepare`.
/// `module` is the `module_path!()` of the test. Returns `None` if this is not possible; the reason
/// is printed.
///
/// # Panics
/// Panics if there is no such test, because running no test would succeed.
pub fn run_inside(module: &str, test: &str, prepare: &str) -> Option<ExitStatus> {
    if let Some(why) = refused() {
        skip(test, &why);
        return None;
    }
    let name = match module.split_once("::") {
        Some((_, module)) => format!("{module}::{test}"),
        None => test.to_owned(),
    };
    let itself = std::env::current_exe().unwrap();
    let listed = Command::new(&itself)
        .args(["--list", "--exact", &name])
        .output()
        .unwrap();
    assert!(
        listed.stdout.starts_with(name.as_bytes()),
        "there is no test {name}"
    );
    let arguments = [&itself.to_string_lossy(), "--exact", &name, "--nocapture"];
    let status = namespace(prepare, &arguments)
        .env(INSIDE, "1")
        .status()
        .unwrap();
    Some(status)
}

fn namespace(prepare: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new("unshare");
    command.args(["--mount", "--propagation", "private", "sh", "-c"]);
    command
        .arg(format!("{prepare} && exec \"$@\""))
        .arg("sh")
        .args(arguments);
    command
}

/// Prints that a test is skipped here, with the reason.
#[expect(clippy::print_stderr, reason = "a skipped test must be reported")]
pub fn skip(test: &str, why: &str) {
    eprintln!("skipped: {test}: {why}");
}
