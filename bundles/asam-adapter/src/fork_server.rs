//! Start of a run: plainly in a shell, or as a fork of an interpreter that has already loaded the
//! module.
//!
//! A forked run gives the same results as a plain run, but starts faster ([`crate::warm`]). If this
//! is not certain, the run is plain.

use std::ffi::OsString;
use std::io::{self, PipeWriter};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use qcbus_confine::Outer;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use crate::hosted::Limits;
use crate::process::Run;
use crate::warm::{self, Server, SpawnError, WhyCold, recognise};

/// Variables that are hidden from modules. They identify qcbus' own bundles.
const OURS: [&str; 2] = ["QCBUS_LAUNCH", "QCBUS_SANDBOX"];
/// Time limit for loading a module.
const PATIENCE: Duration = Duration::from_secs(60);

/// Starts runs and holds the fork server that makes them start faster.
#[derive(Debug)]
pub(crate) struct ForkServer {
    server: Option<Server>,
    /// Whether the fork server is disabled for all later runs.
    is_cold: bool,
}

/// First process of a run.
#[derive(Debug)]
pub(crate) enum Started {
    Cold(Child),
    /// A process forked by the fork server.
    Warm(u32),
}

impl ForkServer {
    /// Creates a starter of runs. If `is_cold` is set, all runs are plain.
    pub fn new(is_cold: bool) -> ForkServer {
        ForkServer {
            server: None,
            is_cold,
        }
    }

    /// Starts a run with its output to `writer`. If `plainly` is set, it uses no fork server.
    ///
    /// # Errors
    /// System errors.
    pub fn start(
        &mut self,
        run: &Run<'_>,
        writer: PipeWriter,
        plainly: bool,
    ) -> io::Result<Started> {
        if !plainly && !self.is_cold {
            // If the installation has changed or the interpreter has ended, it is restarted once.
            for _ in 0..2 {
                match self.warm(run, &writer) {
                    Ok(pid) => return Ok(Started::Warm(pid)),
                    Err(SpawnError::Cold(why)) => {
                        tracing::info!(%why, "this run is plain, not forked");
                        break;
                    }
                    Err(error) => {
                        tracing::info!(%error, "the interpreter is restarted");
                        self.server = None;
                    }
                }
            }
        }
        Ok(Started::Cold(start(run, writer)?))
    }

    fn warm(&mut self, run: &Run<'_>, writer: &PipeWriter) -> Result<u32, SpawnError> {
        let environment = environment(run);
        let nothing = std::fs::File::open("/dev/null")?;
        let server = self.server(run, &environment)?;
        let limits = &run.limits;
        server.spawn(&warm::Run {
            environment: &environment,
            cwd: run.directory,
            limits: warm::Limits {
                memory: Some(at_most(Resource::Data, limits.memory)),
                cpu_seconds: None,
                file_size: Some(at_most(Resource::Fsize, limits.output)),
            },
            stdin: nothing.as_fd(),
            stdout: writer.as_fd(),
            stderr: writer.as_fd(),
        })
    }

    fn server(
        &mut self,
        run: &Run<'_>,
        environment: &[(OsString, OsString)],
    ) -> Result<&mut Server, WhyCold> {
        let is_there = self.server.is_some();
        if !is_there {
            let path = environment.iter().find(|(name, _)| name == "PATH");
            let path = path.map(|(_, path)| path.clone()).unwrap_or_default();
            let limits = warm::Limits {
                memory: Some(at_most(Resource::Data, run.limits.memory)),
                ..warm::Limits::default()
            };
            let command = without_going_where_it_is(run.command, run.directory);
            let started = recognise(command, &path, Path::new("/"))
                .and_then(|entry| Server::start(&entry, environment, &limits, PATIENCE));
            // The result is the same for every job, and each attempt costs the time of an import.
            let started = started.inspect_err(|_| self.is_cold = true)?;
            return Ok(self.server.insert(started));
        }
        self.server
            .as_mut()
            .ok_or_else(|| WhyCold::new("its interpreter was stopped"))
    }

    /// Returns the exit status of a run, or `None` if the run has not ended.
    ///
    /// # Errors
    /// System errors; for a forked run also that its interpreter has ended.
    pub fn ended(&mut self, started: &mut Started) -> io::Result<Option<ExitStatus>> {
        match started {
            Started::Cold(child) => child.try_wait(),
            Started::Warm(pid) => {
                let Some(server) = &mut self.server else {
                    return Err(io::ErrorKind::BrokenPipe.into());
                };
                while let Some((ended, status)) = server.ended()? {
                    if ended == *pid {
                        return Ok(Some(status));
                    }
                }
                Ok(None)
            }
        }
    }

    /// Returns a descriptor that becomes readable when a forked run ends.
    pub fn heard(&self) -> Option<BorrowedFd<'_>> {
        self.server.as_ref().map(|server| server.as_fd())
    }

    /// Returns the processes that belong to no run.
    pub fn spared(&self) -> Vec<i32> {
        let server = self.server.as_ref();
        server.map(|it| it.id().cast_signed()).into_iter().collect()
    }

    /// Drops the interpreter, because it has ended or is unreliable.
    pub fn let_go(&mut self) {
        self.server = None;
    }
}

/// Returns all variables of a run, as a shell would set them.
fn environment(run: &Run<'_>) -> Vec<(OsString, OsString)> {
    let is_given = |name: &OsString| run.environment.iter().any(|(other, _)| other == name);
    let inherited = std::env::vars_os()
        .filter(|(name, _)| !OURS.iter().any(|it| name == it) && name != "PWD" && !is_given(name));
    let own = run.environment.iter().cloned();
    let directory = ("PWD".into(), run.directory.as_os_str().to_owned());
    inherited.chain(own).chain([directory]).collect()
}

#[expect(
    unsafe_code,
    reason = "only the new process itself can leave its session and set its limits, between fork and exec"
)]
fn start(run: &Run<'_>, writer: PipeWriter) -> io::Result<Child> {
    let mut command = Command::new("sh");
    command
        .arg("-c")
        .arg(run.command)
        .current_dir(run.directory)
        .stdin(Stdio::null())
        .stdout(writer.try_clone()?)
        .stderr(writer)
        .envs(run.environment.iter().map(|(name, value)| (name, value)));
    for name in OURS {
        command.env_remove(name);
    }
    let limits = run.limits;
    let runner = std::process::id();
    // SAFETY: only system calls are made between fork and exec; nothing is allocated and no lock is
    // taken.
    unsafe {
        command.pre_exec(move || {
            rustix::process::setsid()?;
            restrict(&limits)?;
            // The parent may have ended before `prctl`. Then this process would never be killed.
            let failed = libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) != 0;
            let parent = rustix::process::getppid().map(|it| it.as_raw_nonzero().get());
            if failed || parent != Some(runner.cast_signed()) {
                return Err(io::Error::from_raw_os_error(libc::ESRCH));
            }
            Ok(())
        });
    }
    if let Some(may) = &run.may {
        Outer::new(may)
            .map_err(io::Error::other)?
            .surround(&mut command);
    }
    command.spawn()
}

fn restrict(limits: &Limits) -> io::Result<()> {
    let most = |resource: Resource, bytes: u64| {
        let bytes = Some(at_most(resource, bytes));
        let limit = Rlimit {
            current: bytes,
            maximum: bytes,
        };
        setrlimit(resource, limit)
    };
    most(Resource::Core, 0)?;
    most(Resource::Fsize, limits.output)?;
    most(Resource::Data, limits.memory)?;
    Ok(())
}

/// Limits a value to this process's own hard limit, because it cannot grant more.
fn at_most(resource: Resource, bytes: u64) -> u64 {
    getrlimit(resource)
        .maximum
        .map_or(bytes, |it| it.min(bytes))
}

/// Strips the prefix of [`goes_where_it_is`] from the command, if a shell would treat the rest in
/// the same way.
fn without_going_where_it_is<'c>(command: &'c str, directory: &Path) -> &'c str {
    // A shell splits an unquoted path that has other characters.
    let plain = |it: &u8| it.is_ascii_alphanumeric() || b"/._-".contains(it);
    let is_one_word = directory.as_os_str().as_encoded_bytes().iter().all(plain);
    match goes_where_it_is(command) {
        Some((rest, quoted)) if quoted || is_one_word => rest,
        _ => command,
    }
}

/// Returns the rest of a command that begins with `cd $ASAM_QC_FRAMEWORK_WORKING_DIR &&`, and
/// whether the variable is quoted. The manifests of ASAM's modules begin in this way. A run already
/// starts in that directory and needs no shell for this.
pub fn goes_where_it_is(command: &str) -> Option<(&str, bool)> {
    const NAMES: [(&str, bool); 4] = [
        ("\"$ASAM_QC_FRAMEWORK_WORKING_DIR\"", true),
        ("\"${ASAM_QC_FRAMEWORK_WORKING_DIR}\"", true),
        ("$ASAM_QC_FRAMEWORK_WORKING_DIR", false),
        ("${ASAM_QC_FRAMEWORK_WORKING_DIR}", false),
    ];
    let behind = command.trim_start().strip_prefix("cd ")?.trim_start();
    NAMES.into_iter().find_map(|(name, quoted)| {
        let rest = behind.strip_prefix(name)?.trim_start();
        Some((rest.strip_prefix("&&")?.trim_start(), quoted))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_redundant_change_of_directory_is_removed() {
        let directory = Path::new("/var/a-b_1.c");
        let of = |command: &str| without_going_where_it_is(command, directory).to_owned();
        let rest = "qc_x -c $ASAM_QC_FRAMEWORK_CONFIG_FILE";
        for begin in [
            "cd $ASAM_QC_FRAMEWORK_WORKING_DIR && ",
            "cd ${ASAM_QC_FRAMEWORK_WORKING_DIR}&&",
            " cd  \"$ASAM_QC_FRAMEWORK_WORKING_DIR\"  &&  ",
        ] {
            assert_eq!(of(&format!("{begin}{rest}")), rest, "{begin}");
        }
        for whole in [
            "cd $ASAM_QC_FRAMEWORK_WORKING_DIR/x && qc_x",
            "cd $ASAM_QC_FRAMEWORK_WORKING_DIR; qc_x",
            "cd /tmp && qc_x",
            "cd '$ASAM_QC_FRAMEWORK_WORKING_DIR' && qc_x",
            rest,
        ] {
            assert_eq!(of(whole), whole);
        }
        let bare = "cd $ASAM_QC_FRAMEWORK_WORKING_DIR && qc_x";
        assert_eq!(without_going_where_it_is(bare, Path::new("/a b")), bare);
    }
}
