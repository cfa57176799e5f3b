//! Start of a run: plainly in a shell, or as a fork of an interpreter that has already loaded the
//! module.
//!
//! A forked run gives the same results as a plain run, but starts faster ([`crate::warm`]). If this
//! is not certain, the run is plain.

use std::ffi::OsString;
use std::io::{self, PipeWriter};
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use qcbus_confine::Outer;
use qcbus_formats::manifest::May;
use rustix::process::{Pid, PidfdFlags, Resource, Rlimit, getrlimit, pidfd_open, setrlimit};

use crate::hosted::Limits;
use crate::warm::{self, Server, SpawnError, WhyCold, die_with, recognise};

/// Variables that are hidden from modules. They identify qcbus' own bundles.
const OURS: [&str; 2] = ["QCBUS_LAUNCH", "QCBUS_SANDBOX"];
/// Time limit for loading a module.
const PATIENCE: Duration = Duration::from_secs(60);

/// Command of a run with its environment and limits.
pub(crate) struct Run<'r> {
    /// Shell command.
    pub command: &'r str,
    /// Variables in addition to those of this process.
    pub environment: &'r [(OsString, OsString)],
    /// Working directory.
    pub directory: &'r Path,
    pub limits: Limits,
    /// Permissions besides writing in its private directory, or `None` if the run is not confined.
    pub may: Option<May>,
}

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
    /// A child, with a descriptor that becomes readable at its end. Older kernels have none.
    Cold(Child, Option<OwnedFd>),
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
        let child = start(run, writer)?;
        let ends = pidfd_open(Pid::from_child(&child), PidfdFlags::empty()).ok();
        Ok(Started::Cold(child, ends))
    }

    fn warm(&mut self, run: &Run<'_>, writer: &PipeWriter) -> Result<u32, SpawnError> {
        let environment = environment(run);
        let nothing = std::fs::File::open("/dev/null")?;
        let limits = warm::Limits {
            memory: Some(at_most(Resource::Data, run.limits.memory)),
            file_size: Some(at_most(Resource::Fsize, run.limits.output)),
        };
        let server = match self.server.take() {
            Some(server) => server,
            None => {
                // The result is the same for every job, and each attempt costs the time of an import.
                let started = load(run, &environment, &limits);
                started.inspect_err(|_| self.is_cold = true)?
            }
        };
        self.server.insert(server).spawn(&warm::Run {
            environment: &environment,
            cwd: run.directory,
            limits,
            stdin: nothing.as_fd(),
            stdout: writer.as_fd(),
            stderr: writer.as_fd(),
        })
    }

    /// Returns the exit status of a run, or `None` if the run has not ended.
    ///
    /// # Errors
    /// System errors; for a forked run also that its interpreter has ended.
    pub fn ended(&mut self, started: &mut Started) -> io::Result<Option<ExitStatus>> {
        match started {
            Started::Cold(child, _) => child.try_wait(),
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

    /// Returns a descriptor that becomes readable when a run ends, if there is one.
    pub fn heard<'s>(&'s self, started: &'s Started) -> Option<BorrowedFd<'s>> {
        match started {
            Started::Cold(_, ends) => ends.as_ref().map(|it| it.as_fd()),
            Started::Warm(_) => self.server.as_ref().map(|it| it.as_fd()),
        }
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

/// Starts an interpreter that has loaded the program of a run.
fn load(
    run: &Run<'_>,
    environment: &[(OsString, OsString)],
    limits: &warm::Limits,
) -> Result<Server, WhyCold> {
    let path = environment.iter().find(|(name, _)| name == "PATH");
    let path = path.map(|(_, path)| path.clone()).unwrap_or_default();
    let command = without_going_where_it_is(run.command, run.directory);
    let entry = recognise(command, &path)?;
    Server::start(&entry, environment, limits, PATIENCE)
}

/// Returns all variables of a run except the working directory.
fn environment(run: &Run<'_>) -> Vec<(OsString, OsString)> {
    let is_given = |name: &OsString| run.environment.iter().any(|(other, _)| other == name);
    let inherited = std::env::vars_os();
    inherited
        .filter(|(name, _)| !OURS.iter().any(|it| name == it) && !is_given(name))
        .chain(run.environment.iter().cloned())
        .collect()
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
            die_with(runner)
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
    for (resource, bytes) in [
        (Resource::Core, 0),
        (Resource::Fsize, limits.output),
        (Resource::Data, limits.memory),
    ] {
        let most = Some(at_most(resource, bytes));
        let (current, maximum) = (most, most);
        setrlimit(resource, Rlimit { current, maximum })?;
    }
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
