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
    /// Starts the runners. `program` has the words after the program name that select the adapter.
    ///
    /// # Errors
    /// System errors.
    pub fn start(count: usize, hosted: &Hosted, program: &[&str]) -> io::Result<Runners> {
        let channels = (0..count.max(1)).map(|_| start(hosted, program));
        let random = std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), count);
        Ok(Runners {
            free: Mutex::new(channels.collect::<io::Result<_>>()?),
            freed: Condvar::new(),
            // A later bus process on the same channels must use other numbers.
            next: AtomicU64::new(random),
        })
    }

    /// Runs the module once, as soon as a runner is free.
    ///
    /// # Errors
    /// If the runner has ended or the program differs from the learned one. No more runs are
    /// possible then.
    pub fn ask(&self, request: &Request, body: &[&[u8]]) -> io::Result<Answered> {
        let channel = self.take();
        let number = self.next.fetch_add(1, Ordering::Relaxed) ^ process_salt();
        channel.send(number, request, body)?;
        let answered = hear(&channel, number)?;
        self.give_back(channel);
        Ok(answered)
    }

    /// Runs the module over several inputs without a thread. All runners work at the same time.
    ///
    /// # Errors
    /// As for [`Runners::ask`].
    pub fn ask_all(&self, requests: &[(Request, Vec<u8>)]) -> io::Result<Vec<Answered>> {
        let mut answers = Vec::new();
        let count = self.lock().len().max(1);
        for some in requests.chunks(count) {
            let mut asked = Vec::new();
            for (request, body) in some {
                let channel = self.take();
                let number = self.next.fetch_add(1, Ordering::Relaxed);
                channel.send(number, request, &[body])?;
                asked.push((channel, number));
            }
            for (channel, number) in asked {
                answers.push(hear(&channel, number)?);
                self.give_back(channel);
            }
        }
        Ok(answers)
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

    fn give_back(&self, channel: Channel) {
        self.lock().push(channel);
        self.freed.notify_one();
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Channel>> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns a value that keeps the request numbers of sessions forked from one process distinct.
fn process_salt() -> u64 {
    u64::from(std::process::id()) << 32
}

fn hear(channel: &Channel, number: u64) -> io::Result<Answered> {
    loop {
        let message = channel.receive(MOST)?;
        let message = message.ok_or_else(|| io::Error::from(io::ErrorKind::UnexpectedEof))?;
        // This answer belongs to a request of an earlier bus process.
        if message.number != number {
            continue;
        }
        return Ok(match message.head()? {
            Answer::Ran(ran) => Ok((ran, message.body)),
            Answer::Not(why) => Err(why),
            Answer::Changed(why) => return Err(io::Error::other(why)),
        });
    }
}

fn start(hosted: &Hosted, program: &[&str]) -> io::Result<Channel> {
    let (own, other) = Channel::pair()?;
    let arguments = program.iter().map(OsString::from);
    // This path is the running program, even if the file at its original path was replaced.
    let mut command = Command::new("/proc/self/exe");
    if let Some(name) = std::env::args_os().next() {
        command.arg0(name);
    }
    if let Some(lasting) = qcbus_sdk::run::lasting_stderr() {
        command.stderr(lasting);
    }
    command
        .args(arguments)
        .arg("--runner")
        .args(hosted.arguments())
        .stdin(Stdio::from(other.into_socket()))
        .spawn()?;
    Ok(own)
}
