//! A workshop that writes test programs and runs them in both ways.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File};
use std::os::fd::AsFd;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::time::Duration;

use qcbus_asam_adapter::warm::{Limits, Run, Server, WhyCold, recognise};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Timeout against hanging tests.
pub const WATCHDOG: Duration = Duration::from_secs(120);

/// Result of a run.
#[derive(Debug, PartialEq)]
pub struct Outcome {
    pub status: ExitStatus,
    pub stdout: String,
    pub stderr: String,
    pub files: BTreeMap<String, String>,
}

/// A directory with programs (`bin`), modules (`lib`) and a working directory for runs (`run`).
pub struct Workshop {
    root: tempfile::TempDir,
    pub python: PathBuf,
}

impl Workshop {
    /// Creates a workshop. Returns `None` and prints a message if there is no Python that can be
    /// forked.
    pub fn new() -> Option<Workshop> {
        let asks = "import os, sys; os.pidfd_open; assert sys.version_info >= (3, 9); print(sys.executable)";
        let output = Command::new("python3").args(["-c", asks]).output();
        let Ok(output) = output
            .map_err(|error| error.to_string())
            .and_then(|output| {
                let said = String::from_utf8_lossy(&output.stderr).into_owned();
                output.status.success().then_some(output).ok_or(said)
            })
        else {
            println!("SKIPPED: no python3 of 3.9 or later on the PATH");
            return None;
        };
        let python = String::from_utf8(output.stdout).unwrap();
        let shop = Workshop {
            root: tempfile::tempdir().unwrap(),
            python: fs::canonicalize(python.trim()).unwrap(),
        };
        for name in ["bin", "lib", "run"] {
            fs::create_dir(shop.path(name)).unwrap();
        }
        symlink(&shop.python, shop.path("bin/python3")).unwrap();
        Some(shop)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        fs::canonicalize(self.root.path()).unwrap().join(name)
    }

    pub fn module(&self, name: &str, text: &str) {
        fs::write(self.path("lib").join(name), text).unwrap();
    }

    pub fn program(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path("bin").join(name);
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    /// Writes a program in the form that pip generates: a module `NAME_main`, and a script that
    /// calls its `main`.
    pub fn console(&self, name: &str, module: &str) {
        self.module(&format!("{name}_main.py"), module);
        let python = self.python.display();
        let script = format!(
            "#!{python}\n# -*- coding: utf-8 -*-\nimport re\nimport sys\nfrom {name}_main import main\n\
             if __name__ == '__main__':\n    sys.argv[0] = re.sub(r'(-script\\.pyw|\\.exe)?$', '', sys.argv[0])\n    \
             sys.exit(main())\n"
        );
        self.program(name, &script);
    }

    pub fn environment(&self, of_job: &[(&str, &str)]) -> Vec<(OsString, OsString)> {
        let paths = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::iter::once(self.path("bin")).chain(std::env::split_paths(&paths));
        let absolute = paths.filter(|it| it.is_absolute());
        let mut all: Vec<(OsString, OsString)> = vec![
            ("PATH".into(), std::env::join_paths(absolute).unwrap()),
            ("PYTHONPATH".into(), self.path("lib").into()),
            ("LANG".into(), "C.UTF-8".into()),
        ];
        all.extend(
            of_job
                .iter()
                .map(|(name, value)| (name.into(), value.into())),
        );
        all
    }

    pub fn start(&self, command: &str) -> Result<Server, WhyCold> {
        let environment = self.environment(&[]);
        let entry = recognise(command, &environment[0].1)?;
        Server::start(&entry, &environment, &Limits::default(), WATCHDOG)
    }

    pub fn why_cold(&self, command: &str) -> String {
        match self.start(command) {
            Ok(_) => panic!("`{command}` must not have a fork server"),
            Err(why) => why.to_string(),
        }
    }

    pub fn plain(&self, command: &str, environment: &[(OsString, OsString)]) -> Outcome {
        self.within(|stdin, stdout, stderr| {
            let mut run = Command::new("sh");
            // `exec` replaces the shell, which would otherwise print its own message when a signal
            // kills the program.
            run.args(["-c", &format!("exec {command}")])
                .env_clear()
                .envs(environment.iter().cloned());
            run.current_dir(self.path("run"));
            run.stdin(stdin)
                .stdout(stdout)
                .stderr(stderr)
                .status()
                .unwrap()
        })
    }

    pub fn warm(&self, server: &mut Server, environment: &[(OsString, OsString)]) -> Outcome {
        self.within(|stdin, stdout, stderr| {
            let cwd = self.path("run");
            let run = Run {
                environment,
                cwd: &cwd,
                limits: Limits::default(),
                stdin: stdin.as_fd(),
                stdout: stdout.as_fd(),
                stderr: stderr.as_fd(),
            };
            let pid = server.spawn(&run).unwrap();
            let (ended, status) = end_of(server);
            assert_eq!(ended, pid);
            status
        })
    }

    /// Passes streams to a run and collects its output.
    pub fn within(&self, run: impl FnOnce(File, File, File) -> ExitStatus) -> Outcome {
        let directory = self.path("run");
        fs::remove_dir_all(&directory).unwrap();
        fs::create_dir(&directory).unwrap();
        let streams = ["in", "out", "err"].map(|name| self.path(name));
        fs::write(&streams[0], "a line\r\nand another\n").unwrap();
        let (stdin, stdout) = (
            File::open(&streams[0]).unwrap(),
            File::create(&streams[1]).unwrap(),
        );
        let status = run(stdin, stdout, File::create(&streams[2]).unwrap());
        let read = |path: &Path| String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
        let files = fs::read_dir(&directory).unwrap().map(|it| it.unwrap());
        Outcome {
            status,
            stdout: without_addresses(&read(&streams[1])),
            stderr: without_addresses(&read(&streams[2])),
            files: files
                .map(|it| (it.file_name().into_string().unwrap(), read(&it.path())))
                .collect(),
        }
    }

    /// Runs a command plainly and twice in one server. Returns the common outcome of all three
    /// runs.
    pub fn same(&self, command: &str) -> Outcome {
        let environment = self.environment(&[
            ("ASAM_QC_FRAMEWORK_CONFIG_FILE", "/a b/c.xml"),
            ("QCBUS_X", "1"),
        ]);
        let plain = self.plain(command, &environment);
        let mut server = self
            .start(command)
            .unwrap_or_else(|why| panic!("{command}: {why}"));
        for _ in 0..2 {
            assert_eq!(self.warm(&mut server, &environment), plain, "{command}");
        }
        plain
    }
}

/// Removes the random addresses that Python shows for objects.
pub fn without_addresses(text: &str) -> String {
    let mut parts = text.split(" at 0x");
    let mut all = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        all.push_str(" at 0x…");
        all.push_str(part.trim_start_matches(|it: char| it.is_ascii_hexdigit()));
    }
    all
}

pub fn end_of(server: &mut Server) -> (u32, ExitStatus) {
    loop {
        if let Some(end) = server.ended().unwrap() {
            return end;
        }
        wait_for(server);
    }
}

pub fn wait_for(server: &Server) {
    let mut fds = [PollFd::new(server, PollFlags::IN)];
    let limit = Timespec {
        tv_sec: WATCHDOG.as_secs().cast_signed(),
        tv_nsec: 0,
    };
    assert!(
        poll(&mut fds, Some(&limit)).unwrap() > 0,
        "the server must send something"
    );
}
