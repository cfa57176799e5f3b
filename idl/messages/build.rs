//! Finds the build day for results, automatically and with the same value for everybody who builds
//! the same source. `SOURCE_DATE_EPOCH` comes first, if a packager sets it, then the day of the
//! commit. Without git, `released` in the workspace's `Cargo.toml` is used.
//!
//! A new commit alone does not run this script again. Everything depends on this crate, so one
//! changed line would rebuild all crates. A working copy may therefore show the day of an earlier
//! commit. A build from a fresh clone, such as a release, always shows the correct day.

use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    // Read at run time, because a target directory may move together with its source.
    let here = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default();
    let root = Path::new(&here).join("../..");
    let manifest = root.join("Cargo.toml");
    println!("cargo::rerun-if-env-changed=SOURCE_DATE_EPOCH");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={}", manifest.display());
    let asked = std::env::var("SOURCE_DATE_EPOCH").ok();
    let seconds = asked.or_else(|| time_of_commit(&root));
    let seconds = seconds.and_then(|text| text.trim().parse::<i64>().ok());
    let date = seconds.map(day_of).or_else(|| released(&manifest));
    match date {
        Some(date) => println!("cargo::rustc-env=QCBUS_BUILD_DATE={date}"),
        None => println!(
            "cargo::error=unknown build date: there is no git, and no `released` in {}; set SOURCE_DATE_EPOCH",
            manifest.display()
        ),
    }
}

/// Returns the last commit's time in seconds since 1970; `None` outside of a clone of qcbus.
fn time_of_commit(root: &Path) -> Option<String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git")
            .arg("-C")
            .arg(root)
            .args(arguments)
            .output();
        let output = output.ok().filter(|output| output.status.success())?;
        String::from_utf8(output.stdout).ok()
    };
    let top = PathBuf::from(git(&["rev-parse", "--show-toplevel"])?.trim_end());
    let is_ours = top.canonicalize().ok()? == root.canonicalize().ok()?;
    is_ours.then(|| git(&["log", "-1", "--format=%ct"]))?
}

fn released(manifest: &Path) -> Option<String> {
    let text = std::fs::read_to_string(manifest).ok()?;
    let mut lines = text.lines();
    let value = lines.find_map(|line| line.strip_prefix("released = \""))?;
    value.split_once('"').map(|(date, _)| date.to_owned())
}

/// Returns the UTC day, `YYYY-MM-DD`. Years start in March, so that the leap day is last.
pub(crate) fn day_of(seconds: i64) -> String {
    let days = seconds.div_euclid(86_400) + 719_468;
    let (era, of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = from_march % 12 + if from_march < 10 { 3 } else { -9 };
    let year = year + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}
