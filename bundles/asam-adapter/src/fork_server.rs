//! How a run begins: plainly, by a shell, or as the fork of an interpreter that has loaded the module already.
//!
//! A warm run is a plain one, only sooner ([`crate::warm`]). Whatever cannot be known to be so is run plainly.

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

/// Variables that no module gets: whoever has these is believed to be a bundle of ours.
const OURS: [&str; 2] = ["QCBUS_LAUNCH", "QCBUS_SANDBOX"];
/// How long a module may take to be loaded.
const PATIENCE: Duration = Duration::from_secs(60);

/// Begins runs, and keeps what makes them begin sooner.
#[derive(Debug)]
pub(crate) struct ForkServer {
    server: Option<Server>,
    /// It is of no use to try again.
    is_cold: bool,
}

/// The first process of a run.
#[derive(Debug)]
pub(crate) enum Started {
    Cold(Child),
    /// A process of the server's.
    Warm(u32),
}

impl ForkServer {
    /// One that begins runs plainly only, when that is wanted.
    pub fn new(is_cold: bool) -> ForkServer {
        ForkServer {
            server: None,
            is_cold,
        }
    }

    /// Begins a run, whose output goes to `writer`. `plainly`: not warm, this time.
    ///
    /// # Errors
    /// The system's.
    pub fn start(
        &mut self,
        run: &Run<'_>,
        writer: PipeWriter,
        plainly: bool,
    ) -> io::Result<Started> {
        if !plainly && !self.is_cold {
            // What is installed may have changed, or the interpreter may have gone: another one, once.
            for _ in 0..2 {
                match self.warm(run, &writer) {
                    Ok(pid) => return Ok(Started::Warm(pid)),
                    Err(SpawnError::Cold(why)) => {
                        tracing::info!(%why, "this run is plain, not warm");
                        break;
                    }
                    Err(error) => {
                        tracing::info!(%error, "the interpreter is started anew");
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
            // It would be the same for every job, and cost the time of an import each time.
            let started = started.inspect_err(|_| self.is_cold = true)?;
            return Ok(self.server.insert(started));
        }
        self.server
            .as_mut()
            .ok_or_else(|| WhyCold::new("it was let go"))
    }

    /// How a run has ended, when it has.
    ///
    /// # Errors
    /// The system's; of a warm one that its interpreter has gone.
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

    /// What is readable when a warm run has ended.
    pub fn heard(&self) -> Option<BorrowedFd<'_>> {
        self.server.as_ref().map(|server| server.as_fd())
    }

    /// Processes that are no part of any run.
    pub fn spared(&self) -> Vec<i32> {
        let server = self.server.as_ref();
        server.map(|it| it.id().cast_signed()).into_iter().collect()
    }

    /// Lets the interpreter go, which has gone or is not to be relied on.
    pub fn let_go(&mut self) {
        self.server = None;
    }
}

/// All variables of a run, as its shell would have them.
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
    // SAFETY: between fork and exec only system calls are made; nothing is allocated and no lock is taken.
    unsafe {
        command.pre_exec(move || {
            rustix::process::setsid()?;
            restrict(&limits)?;
            // It may be gone already, and then nobody would end this.
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

/// What this process may not have itself it cannot give.
fn at_most(resource: Resource, bytes: u64) -> u64 {
    getrlimit(resource)
        .maximum
        .map_or(bytes, |it| it.min(bytes))
}

/// The command without [`goes_where_it_is`]'s beginning, if no shell would make something else of it.
fn without_going_where_it_is<'c>(command: &'c str, directory: &Path) -> &'c str {
    // Without quotes a shell takes other paths apart.
    let plain = |it: &u8| it.is_ascii_alphanumeric() || b"/._-".contains(it);
    let is_one_word = directory.as_os_str().as_encoded_bytes().iter().all(plain);
    match goes_where_it_is(command) {
        Some((rest, quoted)) if quoted || is_one_word => rest,
        _ => command,
    }
}

/// What follows in a command that begins as those in the manifests of ASAM's own modules do, with
/// `cd $ASAM_QC_FRAMEWORK_WORKING_DIR &&`, and whether that is in quotes. A run is in that directory already, and needs
/// no shell to go there.
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
    fn only_what_leads_to_where_it_is_already_is_left_out() {
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
