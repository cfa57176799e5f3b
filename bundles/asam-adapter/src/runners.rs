//! The runners of a bus process: one for each thread. Each runner has one job at a time.

use std::ffi::OsString;
use std::io;
use std::os::unix::process::CommandExt as _;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

use crate::channel::Channel;
use crate::hosted::Hosted;
use crate::messages::{Answer, MOST, Ran, Request};

/// All runners of a bus process.
#[derive(Debug)]
pub(crate) struct Runners {
    free: Mutex<Vec<Channel>>,
    freed: Condvar,
    next: AtomicU64,
}

/// Answer of a runner: the run with its result file, or the reason why the module did not run.
pub(crate) type Answered = Result<(Ran, Vec<u8>), String>;

impl Runners {
    /// Starts the runners. `program` has the words after the program name that select the adapter,
    /// and `arguments` are those of this process.
    ///
    /// # Errors
    /// System errors.
    pub fn start(
        count: usize,
        hosted: &Hosted,
        program: &[&str],
        arguments: &[OsString],
    ) -> io::Result<Runners> {
        let channels = (0..count.max(1)).map(|_| start(hosted, program, arguments));
        Ok(Runners {
            free: Mutex::new(channels.collect::<io::Result<_>>()?),
            freed: Condvar::new(),
            next: AtomicU64::new(0),
        })
    }

    /// Runs the module once, as soon as a runner is free.
    ///
    /// # Errors
    /// If the runner has ended or the program differs from the learned one. No more runs are
    /// possible then.
    pub fn ask(&self, request: &Request, body: &[&[u8]]) -> io::Result<Answered> {
        self.hear(self.send(request, body)?)
    }

    /// Runs the module over several inputs without a thread. All runners work at the same time.
    ///
    /// # Errors
    /// As for [`Runners::ask`].
    pub fn ask_all(&self, requests: &[(Request, Vec<u8>)]) -> io::Result<Vec<Answered>> {
        let mut answers = Vec::new();
        let count = self.lock().len().max(1);
        for some in requests.chunks(count) {
            let asked = some
                .iter()
                .map(|(request, body)| self.send(request, &[body]));
            for asked in asked.collect::<io::Result<Vec<_>>>()? {
                answers.push(self.hear(asked)?);
            }
        }
        Ok(answers)
    }

    fn send(&self, request: &Request, body: &[&[u8]]) -> io::Result<(Channel, u64)> {
        let channel = self.take();
        // Sessions forked from one process use the same channels, so their numbers must differ.
        let session = u64::from(std::process::id()) << 32;
        let number = session ^ self.next.fetch_add(1, Ordering::Relaxed);
        channel.send(number, request, body)?;
        Ok((channel, number))
    }

    fn hear(&self, (channel, number): (Channel, u64)) -> io::Result<Answered> {
        let message = loop {
            let message = channel.receive(MOST)?;
            let message = message.ok_or_else(|| io::Error::from(io::ErrorKind::UnexpectedEof))?;
            // Other answers belong to requests of an earlier bus process.
            if message.number == number {
                break message;
            }
        };
        let answered = match message.head()? {
            Answer::Ran(ran) => Ok((ran, message.body)),
            Answer::Not(why) => Err(why),
            Answer::Changed(why) => return Err(io::Error::other(why)),
        };
        self.lock().push(channel);
        self.freed.notify_one();
        Ok(answered)
    }

    fn take(&self) -> Channel {
        let mut free = self.lock();
        loop {
            if let Some(channel) = free.pop() {
                return channel;
            }
            free = self
                .freed
                .wait(free)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Channel>> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn start(hosted: &Hosted, program: &[&str], arguments: &[OsString]) -> io::Result<Channel> {
    let (own, other) = Channel::pair()?;
    // This path is the running program, even if the file at its original path was replaced.
    let mut command = Command::new("/proc/self/exe");
    if let Some(name) = std::env::args_os().next() {
        command.arg0(name);
    }
    if let Some(lasting) = qcbus_sdk::run::lasting_stderr() {
        command.stderr(lasting);
    }
    command.args(program).args(arguments).arg("--runner");
    for program in &hosted.programs {
        let digest = program.digest.map(|it| it.to_string());
        command
            .arg("--digest")
            .arg(digest.as_deref().unwrap_or("-"));
    }
    command.stdin(Stdio::from(other.into_socket())).spawn()?;
    Ok(own)
}
