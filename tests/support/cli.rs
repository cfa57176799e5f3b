//! A private directory in which tests run commands as a user does.

use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use qcbus_formats::xqar::{self, Checker, Issue, Location, Results};
use tempfile::TempDir;

use super::watchdog;

/// A private directory for commands.
#[derive(Debug)]
pub struct Cli {
    dir: TempDir,
}

/// Output of a command.
#[derive(Debug)]
pub struct Said {
    /// Exit code, or `None` when a signal ended the command.
    pub code: Option<i32>,
    /// Results on stdout.
    pub stdout: String,
    /// Messages on stderr.
    pub stderr: String,
}

impl Cli {
    /// Creates an empty directory.
    pub fn new() -> Cli {
        let dir = TempDir::with_prefix("qcbus-test-").unwrap();
        std::fs::create_dir(dir.path().join(".run")).unwrap();
        Cli { dir }
    }

    /// Returns the directory in which commands run.
    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Writes a file, and creates its parent directories.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// Returns the command in a manifest.
    pub fn command_in(&self, manifest: &str) -> String {
        let bytes = std::fs::read(self.path().join(manifest)).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
        let command = &manifest["module"][0]["exec_command"];
        command.as_str().unwrap().to_owned()
    }

    /// Runs `qcbus …` and waits for its end.
    pub fn qcbus(&self, arguments: &[&str]) -> Said {
        self.run(Command::new(env!("CARGO_BIN_EXE_qcbus")).args(arguments))
    }

    /// Runs `qcbus check …` in another directory. The results go into `out` in this directory.
    pub fn check_in(&self, directory: &Path, paths: &[&str], out: &str) -> Said {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.arg("check").args(paths);
        command.arg("--out").arg(self.path().join(out));
        self.run_in(directory, &mut command)
    }

    /// Runs any program here and waits for its end.
    pub fn run(&self, command: &mut Command) -> Said {
        self.run_in(self.path(), command)
    }

    fn run_in(&self, directory: &Path, command: &mut Command) -> Said {
        let (mut out, mut err) = (tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap());
        command
            .current_dir(directory)
            .env("XDG_RUNTIME_DIR", self.path().join(".run"))
            .env("NO_COLOR", "1")
            .env_remove("COLUMNS")
            .env_remove("QCBUS_LOG")
            .stdin(Stdio::null())
            .stdout(out.try_clone().unwrap())
            .stderr(err.try_clone().unwrap());
        let mut running = Running(command.spawn().unwrap());
        let status = watchdog::until(&format!("{command:?} ends"), || {
            running.0.try_wait().unwrap()
        });
        Said {
            code: status.code(),
            stdout: all_of(&mut out),
            stderr: all_of(&mut err),
        }
    }

    /// Reads a result file, relative to this directory.
    pub fn result(&self, name: &str) -> Results {
        read_result(&self.path().join(name))
    }

    /// Returns an output without the path of this directory, which differs between tests.
    pub fn tidy(&self, text: &str) -> String {
        text.replace(&*self.path().to_string_lossy(), "[DIR]")
    }
}

impl Said {
    /// Returns the whole output, for a snapshot or a failure message.
    pub fn whole(&self, cli: &Cli) -> String {
        let Said {
            code,
            stdout,
            stderr,
        } = self;
        let code = code.map_or("a signal".to_owned(), |code| code.to_string());
        let mut text = cli.tidy(stdout);
        if !stderr.is_empty() {
            text.push_str("--- stderr\n");
            text.push_str(&cli.tidy(stderr));
        }
        text.push_str(&format!("--- exit {code}\n"));
        text
    }
}

/// A child process that is killed at the end of the test, also after a panic.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn all_of(file: &mut File) -> String {
    let mut text = String::new();
    file.rewind().unwrap();
    file.read_to_string(&mut text).unwrap();
    text
}

/// Reads a result file.
pub fn read_result(path: &Path) -> Results {
    let bytes = std::fs::read(path).unwrap_or_else(|it| panic!("{}: {it}", path.display()));
    xqar::read(&bytes).unwrap()
}

/// Returns all checkers of a result.
pub fn checkers(results: &Results) -> impl Iterator<Item = &Checker> {
    results.bundles.iter().flat_map(|bundle| &bundle.checkers)
}

/// Returns all issues of a result with their checkers.
pub fn issues(results: &Results) -> impl Iterator<Item = (&Checker, &Issue)> {
    checkers(results).flat_map(|checker| checker.issues.iter().map(move |issue| (checker, issue)))
}

/// Returns row and column of every place of an issue.
pub fn places(issue: &Issue) -> Vec<(u64, u64)> {
    let all = issue.locations.iter().flat_map(|it| &it.places);
    all.filter_map(|place| match place {
        Location::File { row, column, .. } => Some((*row, *column)),
        _ => None,
    })
    .collect()
}

/// Returns the path of the sample farm.
pub fn sample_farm() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/farm"))
        .canonicalize()
        .unwrap()
}

/// Returns the relative paths of all files below a directory, sorted. None if it is missing.
pub fn files_below(directory: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![directory.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.push(path.strip_prefix(directory).unwrap().to_path_buf());
            }
        }
    }
    found.sort();
    found
}
