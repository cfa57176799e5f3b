//! A desk: a directory of one's own in which commands are typed as a person types them.

use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use qcbus_formats::xqar::{self, Checker, Issue, Location, Results};
use tempfile::TempDir;

use super::watchdog;

/// A desk.
#[derive(Debug)]
pub struct Cli {
    dir: TempDir,
}

/// What a command said.
#[derive(Debug)]
pub struct Said {
    /// Its exit code; `None` when a signal ended it.
    pub code: Option<i32>,
    /// Results.
    pub stdout: String,
    /// Talk.
    pub stderr: String,
}

impl Cli {
    /// An empty one.
    pub fn new() -> Cli {
        let dir = TempDir::with_prefix("qcbus-test-").unwrap();
        std::fs::create_dir(dir.path().join(".run")).unwrap();
        Cli { dir }
    }

    /// Where commands are typed.
    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Puts a file there, with the directories on its way.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// What a manifest says is to be run.
    pub fn command_in(&self, manifest: &str) -> String {
        let bytes = std::fs::read(self.path().join(manifest)).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
        let command = &manifest["module"][0]["exec_command"];
        command.as_str().unwrap().to_owned()
    }

    /// Types `qcbus …` and waits for its end.
    pub fn qcbus(&self, arguments: &[&str]) -> Said {
        self.run(Command::new(env!("CARGO_BIN_EXE_qcbus")).args(arguments))
    }

    /// Types `qcbus check …` in another directory; results go into a directory of the desk.
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

    /// A result file, relative to the desk.
    pub fn result(&self, name: &str) -> Results {
        read_result(&self.path().join(name))
    }

    /// What was said, without what differs from desk to desk.
    pub fn tidy(&self, text: &str) -> String {
        text.replace(&*self.path().to_string_lossy(), "[DESK]")
    }
}

impl Said {
    /// All of it, for a snapshot or a failure.
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

/// Ends with the test, also when it panics.
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

/// All checkers of a result.
pub fn checkers(results: &Results) -> impl Iterator<Item = &Checker> {
    results.bundles.iter().flat_map(|bundle| &bundle.checkers)
}

/// All issues of a result with their checkers.
pub fn issues(results: &Results) -> impl Iterator<Item = (&Checker, &Issue)> {
    checkers(results).flat_map(|checker| checker.issues.iter().map(move |issue| (checker, issue)))
}

/// Row and column of every place of an issue.
pub fn places(issue: &Issue) -> Vec<(u64, u64)> {
    let all = issue.locations.iter().flat_map(|it| &it.places);
    all.filter_map(|place| match place {
        Location::File { row, column, .. } => Some((*row, *column)),
        _ => None,
    })
    .collect()
}

/// The sample farm.
pub fn sample_farm() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/farm"))
        .canonicalize()
        .unwrap()
}

/// All files below a directory, relative to it, in order; none, if it is not there.
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
