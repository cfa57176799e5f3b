//! Test bench with a cli and a farm: checks run in the cli and ask the broker of the farm.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use qcbus_messages::control::PeerStatus;
use rustix::process::Signal;

use crate::support::cli::{Cli, Said, files_below};
use crate::support::content::{CATALOG, Content, Mark};
use crate::support::farm::{Farm, tail};
use crate::support::processes::signal_pid;
use crate::support::watchdog::until_or;

/// Note under `-v` that a broker made the check.
const WARM: &str = "note: checked by the running broker";
/// Note under `-v` that a broker should have made the check but did not.
const COLD: &str = "note: checked without the running broker";
/// Output directory of checks, relative to the cli.
const OUT: &str = "out";

/// A cli and a farm.
pub struct Bench {
    pub cli: Cli,
    pub farm: Farm,
}

/// How a check was made, according to its own output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Made {
    Warm,
    Cold,
}

/// Everything that a check leaves to a user.
#[derive(Debug, PartialEq, Eq)]
pub struct Outcome {
    code: Option<i32>,
    stdout: String,
    stderr: String,
    /// Content of every written file, escaped as ASCII.
    written: BTreeMap<PathBuf, String>,
}

impl Bench {
    /// Creates a bench with further arguments of `qcbus serve`.
    pub fn with(arguments: &[&str]) -> Bench {
        Bench {
            cli: Cli::new(),
            farm: Farm::with(arguments),
        }
    }

    pub fn new() -> Bench {
        Bench::with(&[])
    }

    /// Returns a `qcbus check` command for the cli.
    pub fn command(&self, words: &[&str]) -> Command {
        self.command_into(OUT, words)
    }

    /// Returns the same command with another output directory.
    pub fn command_into(&self, out: &str, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.arg("check").args(words).args(["--out", out]);
        command.arg("--instance-dir").arg(self.farm.instance());
        command
    }

    /// Returns whether the broker does not check this file now when asked.
    pub fn is_asked_in_vain(&self, file: &str) -> bool {
        let said = self.cli.run(&mut self.command_into("vain", &[file, "-v"]));
        !said.stderr.contains(WARM)
    }

    /// Runs a check after removing the results of other checks.
    pub fn outcome(&self, command: &mut Command) -> Outcome {
        let out = self.cli.path().join(OUT);
        let _ = std::fs::remove_dir_all(&out);
        let Said {
            code,
            stdout,
            stderr,
        } = self.cli.run(command);
        let files = files_below(&out).into_iter();
        let read = |file: &Path| std::fs::read(out.join(file)).unwrap();
        let letters = |file: &Path| read(file).escape_ascii().to_string();
        let written = files.map(|file| (file.clone(), letters(&file)));
        Outcome {
            code,
            stdout,
            stderr,
            written: written.collect(),
        }
    }

    /// Returns the outcome of a check without a broker.
    pub fn cold(&self, words: &[&str]) -> Outcome {
        let words = [words, &["--cold"]].concat();
        self.outcome(&mut self.command(&words))
    }

    /// Compares a check that may ask the broker with one that may not. Returns how the former was
    /// made.
    pub fn compared(&self, words: &[&str]) -> Made {
        let (cold, warm) = (self.cold(words), self.outcome(&mut self.command(words)));
        assert_eq!(cold, warm, "{words:?}\n{}", tail(&self.farm.log()));
        let talkative = [words, &["-v"]].concat();
        let (cold, warm) = (self.cold(&talkative), self.command(&talkative));
        let (made, warm) = self.told(warm);
        assert_eq!(cold, warm, "{talkative:?}\n{}", tail(&self.farm.log()));
        made
    }

    /// Runs a check that prints how it was made. Returns this, and the outcome without that note.
    pub fn told(&self, mut command: Command) -> (Made, Outcome) {
        let outcome = self.outcome(&mut command);
        told(outcome)
    }

    /// Writes a file that the broker does not watch.
    pub fn beside(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        text(&self.cli.write(name, bytes))
    }

    /// Writes a file that the broker watches.
    pub fn watched(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let path = self.farm.root().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        text(&path)
    }

    /// Returns the status of a bundle once `wanted` holds.
    pub fn peer(&self, name: &str, wanted: impl Fn(&PeerStatus) -> bool) -> PeerStatus {
        let found = || {
            let peers = self.farm.status()?.peers.into_iter();
            peers.filter(|it| it.name == name).find(&wanted)
        };
        let explain = || format!("{:#?}\n{}", self.farm.status(), tail(&self.farm.log()));
        until_or(&format!("{name} gets there"), found, explain)
    }

    /// Stops the bundle that checks maps, so that a check of a map stays in progress. Returns its
    /// status.
    pub fn stop_maps(&self) -> PeerStatus {
        let bundle = self.peer("xodrBundle", |it| it.state == "ready");
        signal(&bundle, Signal::STOP);
        bundle
    }

    /// Waits until no job is waiting or active.
    pub fn until_quiet(&self) {
        let is_quiet = || {
            let queue = self.farm.status()?.queue;
            (queue.waiting + queue.background + queue.active == 0).then_some(())
        };
        let explain = || format!("{:#?}\n{}", self.farm.status(), tail(&self.farm.log()));
        until_or("nothing is under way", is_quiet, explain);
    }

    /// Waits until a bundle has received a requested check.
    pub fn until_under_way(&self) {
        self.peer("xodrBundle", |it| it.active > 0);
    }
}

/// Returns how a check was made, and removes that note from its output.
pub fn told(mut outcome: Outcome) -> (Made, Outcome) {
    let made = match outcome.stderr.contains(WARM) {
        true => Made::Warm,
        false => Made::Cold,
    };
    let is_of_it = |line: &&str| line.starts_with(WARM) || line.starts_with(COLD);
    let lines = outcome.stderr.lines().filter(|line| !is_of_it(line));
    outcome.stderr = lines.map(|line| format!("{line}\n")).collect();
    (made, outcome)
}

impl Outcome {
    pub fn code(&self) -> Option<i32> {
        self.code
    }

    pub fn says(&self, words: &str) -> bool {
        self.stdout.contains(words) || self.stderr.contains(words)
    }
}

pub fn signal(peer: &PeerStatus, signal: Signal) {
    signal_pid(i32::try_from(peer.pid).unwrap(), signal);
}

pub fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// Returns a scenario with its map and its catalogs.
pub fn scenario() -> [(&'static str, Vec<u8>); 3] {
    let scenario = Content::Scenario(1, "map.xodr".to_owned());
    [
        ("map.xodr", Content::Good(2).bytes()),
        (CATALOG, Content::Catalog(3, Mark::Clean).bytes()),
        ("scenario.xosc", scenario.bytes()),
    ]
}
