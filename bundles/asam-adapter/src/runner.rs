//! The process that runs modules: it handles one request after the other.

use std::ffi::OsString;
use std::io;
use std::os::fd::{AsFd as _, OwnedFd};
use std::path::{Path, PathBuf};

use qcbus_confine::Orders;
use qcbus_formats::manifest::May;
use qcbus_messages::Exit;

use crate::channel::{Channel, Message};
use crate::configuration::{Configuration, of_report};
use crate::family;
use crate::fork_server::{ForkServer, Run};
use crate::hosted::Hosted;
use crate::messages::{Answer, MOST, Ran, Request};
use crate::process::{self, Broken};
use crate::program::Programs;
use crate::scratch::{Room, Scratch};
use crate::staging::Staged;
use crate::written;

/// Serves requests until the other end of the socket on stdin is closed.
pub(crate) fn serve(hosted: &Hosted) -> Exit {
    match runner(hosted) {
        Ok(()) => Exit::Accepted,
        Err(error) => {
            tracing::error!(module = hosted.name, %error, "the runner cannot continue");
            Exit::Internal
        }
    }
}

fn runner(hosted: &Hosted) -> io::Result<()> {
    // The duplicate is closed on exec. A run has its own stdin.
    let socket: OwnedFd = io::stdin().as_fd().try_clone_to_owned()?;
    family::adopt()?;
    let may = match Orders::given() {
        Ok(Orders::On(may)) => Some(may),
        Ok(Orders::Off) => None,
        Err(error) => return Err(io::Error::other(error)),
    };
    let mut runner = Runner {
        hosted,
        scratch: Scratch::open(&hosted.scratch)?,
        channel: Channel::from_socket(socket),
        may,
        fork_server: ForkServer::new(hosted.is_cold),
        programs: Programs::new(&hosted.programs),
    };
    while let Some(message) = runner.channel.receive(MOST)? {
        let (answer, result) = match runner.answer(&message) {
            Ok((ran, result)) => (Answer::Ran(ran), result),
            Err(NotRun::Why(why)) => (Answer::Not(why), Vec::new()),
            Err(NotRun::Changed(why)) => (Answer::Changed(why), Vec::new()),
            Err(NotRun::Broken(Broken::Unwanted)) => return Ok(()),
            Err(NotRun::Broken(error @ Broken::Lasts(_))) => return Err(io::Error::other(error)),
            Err(NotRun::Broken(error)) => (Answer::Not(error.to_string()), Vec::new()),
        };
        match runner.channel.send(message.number, &answer, &[&result]) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
            sent => sent?,
        }
    }
    Ok(())
}

/// Reason why a run did not happen.
enum NotRun {
    /// Reason as text for the user.
    Why(String),
    /// The program differs from the learned one.
    Changed(String),
    /// The run was not started, or its end is unknown.
    Broken(Broken),
}

impl From<io::Error> for NotRun {
    fn from(error: io::Error) -> NotRun {
        NotRun::Why(error.to_string())
    }
}

struct Runner<'h> {
    hosted: &'h Hosted,
    scratch: Scratch,
    channel: Channel,
    /// Permissions of runs, or `None` if runs are not confined.
    may: Option<May>,
    fork_server: ForkServer,
    programs: Programs,
}

/// Prepared files and directories of a run.
struct Prepared {
    room: Room,
    directory: PathBuf,
    /// Own directory of the run. It is the working directory, unless the manifest names another
    /// one.
    work: PathBuf,
    config: PathBuf,
    staged: Staged,
    /// Section names, each with its result file.
    sections: Vec<(String, String)>,
}

impl Runner<'_> {
    fn answer(&mut self, message: &Message) -> Result<(Ran, Vec<u8>), NotRun> {
        match self.run(message, false) {
            // The run itself may have ended its interpreter. A plain run uses no such interpreter.
            Err(NotRun::Broken(Broken::Unkept(why))) => {
                let module = &self.hosted.name;
                tracing::warn!(module, %why, "it is run again as a plain run");
                self.run(message, true)
            }
            answer => answer,
        }
    }

    fn run(&mut self, message: &Message, plainly: bool) -> Result<(Ran, Vec<u8>), NotRun> {
        let request: Request = message.head()?;
        self.is_as_learned()?;
        let prepared = self.prepare(&request, &message.body)?;
        let environment = self.environment(&prepared);
        let run = Run {
            command: &self.hosted.command,
            environment: &environment,
            directory: &prepared.directory,
            limits: self.hosted.limits,
            may: self.may_in(&prepared.room),
        };
        let ended = process::run(&run, self.channel.as_fd(), &mut self.fork_server, plainly)
            .map_err(NotRun::Broken)?;
        // The program may have been replaced just before it was started.
        self.is_as_learned()?;
        let text = |path: &Path| path.to_string_lossy().into_owned();
        let mut ran = Ran {
            fault: ended.fault,
            said: ended.said,
            application: None,
            input: text(prepared.staged.input()),
            packed: request
                .files
                .first()
                .and_then(|it| it.packed.as_deref().map(text)),
            staged: text(&prepared.staged.directory),
            real: text(&prepared.staged.real),
            room: text(prepared.room.path()),
            reports: Vec::new(),
        };
        let result = match (&ran.fault, &request.report) {
            (Some(_), _) => Vec::new(),
            (None, Some(_)) => {
                let written = written::in_directory(&prepared.work, self.hosted.limits.output);
                let (reports, body) = written.map_err(NotRun::Why)?;
                ran.reports = reports;
                body
            }
            (None, None) => match self.collect(&prepared) {
                Ok((application, result)) => {
                    ran.application = application;
                    result
                }
                Err(fault) => {
                    ran.fault = Some(fault);
                    Vec::new()
                }
            },
        };
        Ok((ran, result))
    }

    fn is_as_learned(&mut self) -> Result<(), NotRun> {
        self.programs
            .changed()
            .map_or(Ok(()), |why| Err(NotRun::Changed(why)))
    }

    fn prepare(&mut self, request: &Request, body: &[u8]) -> Result<Prepared, NotRun> {
        let room = self.scratch.for_a_run()?;
        let staged = Staged::write(&request.files, body, &room.directory("input")?)?;
        let own = room.directory("work")?;
        room.directory("tmp")?;
        let directory = self.hosted.directory.clone().unwrap_or(own.clone());
        let input = staged.input().to_str().ok_or_else(|| {
            let why = "its path is not UTF-8, so a configuration cannot contain it";
            NotRun::Why(why.to_owned())
        })?;
        let is_own = self.hosted.directory.is_none();
        let applications = request.applications.iter().cloned();
        let result = |number: i32| {
            let name = format!("result-{number}.xqar");
            match is_own {
                true => name,
                false => own.join(name).to_string_lossy().into_owned(),
            }
        };
        let sections: Vec<(String, String)> = applications.zip((1..).map(result)).collect();
        let config = room.path().join("config.xml");
        let text = match &request.report {
            Some(params) => of_report(&request.applications, input, params),
            None => Configuration {
                name: &self.hosted.name,
                input,
                config: request.config.as_ref(),
                sections: &sections,
            }
            .text(),
        };
        std::fs::write(&config, text)?;
        Ok(Prepared {
            room,
            directory,
            work: own,
            config,
            staged,
            sections,
        })
    }

    fn environment(&self, prepared: &Prepared) -> Vec<(OsString, OsString)> {
        let own = self.hosted.environment.iter();
        let mut all: Vec<(OsString, OsString)> = own
            .map(|(name, value)| (name.into(), value.into()))
            .collect();
        let mut add = |name: &str, path: &Path| all.push((name.into(), path.into()));
        add("ASAM_QC_FRAMEWORK_CONFIG_FILE", &prepared.config);
        add("ASAM_QC_FRAMEWORK_WORKING_DIR", &prepared.directory);
        add("TMPDIR", &prepared.room.path().join("tmp"));
        all
    }

    /// Returns the permissions of a run: those in the module's manifest, and full access to its own
    /// private directory. The private directories of other runs are not accessible.
    fn may_in(&self, room: &Room) -> Option<May> {
        let mut may = self.may.clone()?;
        may.write.retain(|it| *it != self.hosted.scratch);
        may.write.push(room.path().to_path_buf());
        Some(may)
    }

    /// Reads the result file, and returns it with the name of its section. All processes of the
    /// run have ended, so the file cannot change.
    ///
    /// # Errors
    /// An invalid result is a fault of the run.
    fn collect(&self, prepared: &Prepared) -> Result<(Option<String>, Vec<u8>), String> {
        if let Some(changed) = prepared.staged.changed() {
            let changed = changed.display();
            return Err(format!(
                "changed its copy of {changed}, so it checked other content"
            ));
        }
        for (application, result) in &prepared.sections {
            let path = prepared.directory.join(result);
            if let Some(bytes) = self.read(&path, &prepared.config)? {
                return Ok((Some(application.clone()), bytes));
            }
        }
        Ok((None, Vec::new()))
    }

    fn read(&self, path: &Path, config: &Path) -> Result<Option<Vec<u8>>, String> {
        let unreadable = |error: &io::Error| format!("left a result that cannot be read: {error}");
        let found = match std::fs::symlink_metadata(path) {
            Ok(found) => found,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(unreadable(&error)),
        };
        if !found.is_file() {
            return Err("left a result that is not a file".to_owned());
        }
        let modified = |it: &Path| std::fs::metadata(it).and_then(|it| it.modified());
        // Both files are on the same disk, so their times come from the same clock.
        if let (Ok(config), Ok(result)) = (modified(config), found.modified())
            && result < config
        {
            return Err("left a result that is older than its run".to_owned());
        }
        let bytes = qcbus_disk::foreign::read(path, self.hosted.limits.output);
        bytes.map(Some).map_err(|error| unreadable(&error))
    }
}
