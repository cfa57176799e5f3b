//! A farm for tests: a watched directory with everything that a broker needs, in a directory of its
//! own. On drop, all its processes are killed, also after a panic.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use qcbus_control::ask_broker;
use qcbus_formats::xqar::{self, Results};
use qcbus_messages::control::{FileVerdict, Request, Response, Status};
use rustix::process::Signal;
use tempfile::TempDir;

use super::broker::Broker;
use super::processes::{self, Process};
use super::watchdog;

/// A farm for tests.
#[derive(Debug)]
pub struct Farm {
    dir: TempDir,
    /// Additional arguments of `qcbus serve`.
    pub arguments: Vec<String>,
}

impl Farm {
    /// Creates an empty farm.
    pub fn new() -> Farm {
        let dir = TempDir::with_prefix("qcbus-test-").unwrap();
        for name in ["farm", "bundles.d"] {
            std::fs::create_dir(dir.path().join(name)).unwrap();
        }
        Farm {
            dir,
            arguments: Vec::new(),
        }
    }

    /// Creates a farm with additional arguments of `qcbus serve`.
    pub fn with(arguments: &[&str]) -> Farm {
        let mut farm = Farm::new();
        farm.arguments
            .extend(arguments.iter().map(|it| (*it).to_owned()));
        farm
    }

    /// Returns the directory that contains everything.
    pub fn base(&self) -> &Path {
        self.dir.path()
    }

    /// Returns the watched directory.
    pub fn root(&self) -> PathBuf {
        self.dir.path().join("farm")
    }

    /// Returns the results directory.
    pub fn out(&self) -> PathBuf {
        self.dir.path().join("out")
    }

    /// Returns the directory for published files, if the broker has a gate.
    pub fn gate(&self) -> PathBuf {
        self.dir.path().join("gate")
    }

    /// Returns the runtime directory of the instance.
    pub fn instance(&self) -> PathBuf {
        self.dir.path().join("instance")
    }

    /// Returns the directory of the manifests.
    pub fn bundles_d(&self) -> PathBuf {
        self.dir.path().join("bundles.d")
    }

    /// Returns the path of the journal.
    pub fn journal(&self) -> PathBuf {
        self.out().join(".qcbus/journal.sqlite")
    }

    /// Returns the path of the broker's log.
    pub fn log_path(&self) -> PathBuf {
        self.dir.path().join("serve.log")
    }

    /// Returns the log of all brokers so far.
    pub fn log(&self) -> String {
        std::fs::read_to_string(self.log_path()).unwrap_or_default()
    }

    /// Returns the command that serves this farm.
    pub fn serve_command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command
            .arg("serve")
            .arg(self.root())
            .arg("--instance-dir")
            .arg(self.instance())
            .arg("--out")
            .arg(self.out())
            .arg("--bundles-d")
            .arg(self.bundles_d())
            .args(&self.arguments)
            .env("NO_COLOR", "1");
        command
    }

    /// Starts a broker.
    pub fn serve(&self) -> Broker {
        Broker::start(&mut self.serve_command(), &self.log_path())
    }

    /// Starts a broker and waits until it answers and its standard bundles are ready.
    pub fn serve_ready(&self) -> Broker {
        let broker = self.serve();
        watchdog::until_or(
            "the broker and its bundles are ready",
            || self.is_ready(),
            || self.log(),
        );
        broker
    }

    fn is_ready(&self) -> Option<()> {
        let status = self.status()?;
        let standard = status.peers.iter().filter(|it| it.name.ends_with("Bundle"));
        let ready = standard
            .filter(|it| it.state == "ready" || it.state == "busy")
            .count();
        (ready >= 3).then_some(())
    }

    /// Runs a qcbus command on this instance.
    pub fn qcbus(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command
            .args(arguments)
            .arg("--instance-dir")
            .arg(self.instance());
        command.env("NO_COLOR", "1").output().unwrap()
    }

    /// Waits for a verdict that does not come, until the broker reports `why`. A slow broker may
    /// report it late. Each wait must time out, and is twice as long as the last one.
    pub fn wait_in_vain(&self, file: &Path, further: &[&str], why: &str) -> Output {
        let file = file.to_str().unwrap();
        let last = std::cell::RefCell::new(String::new());
        let mut millis = 100_u64;
        let look = || {
            let limit = format!("{millis}ms");
            let wait = ["wait", file, "--timeout", &limit];
            let said = self.qcbus(&[&wait, further].concat());
            millis = millis.saturating_mul(2);
            assert_eq!(said.status.code(), Some(3), "{said:?}");
            last.replace(String::from_utf8_lossy(&said.stderr).into_owned());
            last.borrow().contains(why).then_some(said)
        };
        watchdog::until_or("the broker says why there is no verdict", look, || {
            last.borrow().clone()
        })
    }

    /// Sends a request to the broker. Returns `None` if no broker runs.
    pub fn ask(&self, request: &Request) -> Option<Response> {
        ask_broker(&self.instance(), request).ok()
    }

    /// Returns the broker's status, or `None` if no broker runs.
    pub fn status(&self) -> Option<Status> {
        match self.ask(&Request::Status)? {
            Response::Status(status) => Some(*status),
            _ => None,
        }
    }

    /// Waits for the verdict on a file's current bytes, also if processes die meanwhile.
    pub fn verdict(&self, name: &str) -> FileVerdict {
        let file = self.root().join(name);
        let explain = || format!("{name}\n{:#?}\n{}", self.status(), self.log());
        watchdog::until_or(
            "a verdict",
            || {
                let request = Request::Wait {
                    file: file.clone(),
                    timeout_ms: Some(120_000),
                };
                match self.ask(&request)? {
                    Response::Verdict(verdict) => Some(verdict),
                    _ => None,
                }
            },
            explain,
        )
    }

    /// Waits until all files have their verdict and no work is left.
    pub fn settle(&self, total: usize) -> Status {
        let total = u64::try_from(total).unwrap();
        let settled = |status: &Status| {
            let queue = status.queue;
            let quiet = queue.waiting + queue.background + queue.active == 0;
            quiet && status.files.total == total && status.files.judged == total
        };
        let explain = || format!("{total} files\n{:#?}\n{}", self.status(), tail(&self.log()));
        watchdog::until_or(
            "all files are judged",
            || self.status().filter(settled),
            explain,
        )
    }

    /// Writes a file in one call.
    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.root().join(name), bytes).unwrap();
    }

    /// Reads the result of a file.
    pub fn result(&self, name: &str) -> Results {
        let path = self.out().join(format!("{name}.xqar"));
        let bytes = std::fs::read(&path).unwrap_or_else(|it| panic!("{}: {it}", path.display()));
        xqar::read(&bytes).unwrap()
    }

    /// Reads the verdict file of a file.
    pub fn verdict_file(&self, name: &str) -> serde_json::Value {
        let path = self.out().join(format!("{name}.verdict.json"));
        let bytes = std::fs::read(&path).unwrap_or_else(|it| panic!("{}: {it}", path.display()));
        serde_json::from_slice(&bytes).unwrap()
    }

    /// Adds a misbehaving bundle or reporter of the zoo.
    pub fn let_in(&self, animal: &str, arguments: &str) {
        self.let_in_by(&zoo(), animal, arguments);
    }

    /// Adds a misbehaving bundle as a shadow, without weight in any verdict.
    pub fn let_in_as_shadow(&self, animal: &str, arguments: &str) {
        self.let_in_with(&zoo(), animal, arguments, true);
    }

    /// Adds a misbehaving bundle with another program.
    pub fn let_in_by(&self, program: &Path, animal: &str, arguments: &str) {
        self.let_in_with(program, animal, arguments, false);
    }

    fn let_in_with(&self, program: &Path, animal: &str, arguments: &str, shadow: bool) {
        let module_type = if animal.starts_with("reporter") {
            "report_module"
        } else {
            "checker_bundle"
        };
        let mut module = serde_json::json!({
            "name": animal,
            "exec_type": "executable",
            "module_type": module_type,
            "exec_command": format!("{} {animal} {arguments}", program.display()),
            "mode": "bus",
        });
        if shadow {
            module["shadow"] = true.into();
        }
        self.let_in_module(animal, &module);
    }

    /// Adds a manifest with this module under a name.
    pub fn let_in_module(&self, animal: &str, module: &serde_json::Value) {
        let manifest = serde_json::json!({ "module": [module] });
        let path = self.bundles_d().join(format!("{animal}.json"));
        // The manifest is renamed into place, because a half-written one is refused with a notice.
        let unfinished = self.bundles_d().join(format!(".{animal}"));
        std::fs::write(&unfinished, manifest.to_string()).unwrap();
        std::fs::rename(&unfinished, &path).unwrap();
    }

    /// Removes a misbehaving bundle.
    pub fn send_away(&self, animal: &str) {
        let _ = std::fs::remove_file(self.bundles_d().join(format!("{animal}.json")));
    }

    /// Returns all processes of this instance.
    pub fn processes(&self) -> Vec<Process> {
        processes::of_directory(&self.instance())
    }

    /// Returns the name prefix of this instance's shared memory. A broker must have been started.
    pub fn shm_prefix(&self) -> String {
        let path = self.instance().join("id");
        watchdog::until("the instance has an identity", || {
            std::fs::read_to_string(&path)
                .ok()
                .filter(|it| !it.is_empty())
        })
    }
}

impl Farm {
    /// Removes shared memory of killed processes. No next broker of the instance does it here.
    fn clear_shared_memory(&self) {
        let Ok(prefix) = std::fs::read_to_string(self.instance().join("id")) else {
            return;
        };
        if prefix.is_empty() {
            return;
        }
        for entry in std::fs::read_dir("/dev/shm")
            .into_iter()
            .flatten()
            .flatten()
        {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with(&prefix) {
                let _ = std::fs::remove_dir_all(entry.path());
            }
        }
    }
}

impl Drop for Farm {
    fn drop(&mut self) {
        // A dying process may just have started another one, so this is repeated.
        for _ in 0..3 {
            for process in self.processes() {
                process.signal(Signal::KILL);
            }
        }
        self.clear_shared_memory();
    }
}

/// Returns the entries of /dev/shm with this prefix.
pub fn shm_segments(prefix: &str) -> Vec<String> {
    let entries = std::fs::read_dir("/dev/shm").unwrap().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| name.starts_with(prefix)).collect()
}

/// Returns the end of a log.
pub fn tail(log: &str) -> String {
    let lines: Vec<&str> = log.lines().collect();
    lines[lines.len().saturating_sub(60)..].join("\n")
}

/// Returns the zoo program, next to the program under test. It is built on first use.
pub fn zoo() -> PathBuf {
    static ZOO: OnceLock<PathBuf> = OnceLock::new();
    ZOO.get_or_init(build_zoo).clone()
}

fn build_zoo() -> PathBuf {
    let beside = Path::new(env!("CARGO_BIN_EXE_qcbus")).with_file_name("zoo");
    if std::env::var_os(super::inside::INSIDE).is_some() && beside.exists() {
        return beside;
    }
    let mut build = Command::new(env!("CARGO"));
    // These are the features of `cargo test --workspace`, so nothing is compiled twice. The program
    // is built together with the test that runs it.
    let words = "test -q --no-run --workspace --test animals --manifest-path";
    build.args(words.split(' '));
    build.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml"));
    // The path is target/PROFILE/zoo.
    if beside.parent().is_some_and(|it| it.ends_with("release")) {
        build.arg("--release");
    }
    if let Some(target) = beside.parent().and_then(Path::parent) {
        build.arg("--target-dir").arg(target);
    }
    assert!(build.status().unwrap().success(), "the zoo cannot be built");
    beside
}
