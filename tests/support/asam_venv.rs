//! Installs ASAM's published modules in a virtual environment below `target`.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rustix::fs::{FlockOperation, flock};

/// The published packages.
const PACKAGES: [&str; 2] = ["asam-qc-opendrive", "asam-qc-openscenarioxml"];

/// Returns the directory of their programs, and creates it if it is missing.
///
/// # Errors
/// If it cannot be created: no Python, or no network.
pub fn programs() -> Result<PathBuf, String> {
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target");
    let target = target.canonicalize().map_err(|error| error.to_string())?;
    let venv = target.join("asam-venv");
    // Several tests may need the directory at the same time.
    let lock = File::create(target.join("asam-venv.lock")).map_err(|error| error.to_string())?;
    flock(&lock, FlockOperation::LockExclusive).map_err(|error| error.to_string())?;
    let ready = venv.join("ready");
    if !ready.exists() {
        run(Command::new("python3")
            .args(["-m", "venv", "--clear"])
            .arg(&venv))?;
        let mut pip = Command::new(venv.join("bin/python"));
        run(pip.args(["-m", "pip", "install", "--quiet"]).args(PACKAGES))?;
        std::fs::write(ready, "").map_err(|error| error.to_string())?;
    }
    Ok(venv.join("bin"))
}

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said
        .trim()
        .lines()
        .next_back()
        .unwrap_or_default()
        .to_owned();
    Err(format!("{command:?}: {last}"))
}
