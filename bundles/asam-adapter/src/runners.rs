//! The offices of a bus process: as many as it has threads, and each has one job at a time.

use std::ffi::OsString;
use std::io;
use std::os::unix::process::CommandExt as _;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

use crate::channel::Channel;
use crate::hosted::Hosted;
use crate::messages::{Answer, MOST, Ran, Request};

/// All offices.
#[derive(Debug)]
pub(crate) struct Runners {
    free: Mutex<Vec<Channel>>,
    freed: Condvar,
    next: AtomicU64,
}

/// What an office has answered: the run with the result file, or why there was none.
pub(crate) type Answered = Result<(Ran, Vec<u8>), String>;

impl Runners {
    /// Starts them. `program` are the words behind the name of this program that lead to the adapter.
    ///
    /// # Errors
    /// The system's.
    pub fn start(count: usize, hosted: &Hosted, program: &[&str]) -> io::Result<Runners> {
        let channels = (0..count.max(1)).map(|_| start(hosted, program));
        let random = std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), count);
        Ok(Runners {
            free: Mutex::new(channels.collect::<io::Result<_>>()?),
            freed: Condvar::new(),
            // A bus process that follows another one on the same channels numbers otherwise.
            next: AtomicU64::new(random),
        })
    }

    /// Has the module run once, when an office is free.
    ///
    /// # Errors
    /// When the office is gone, or the program is not the one that was learned: nothing more can be run.
    pub fn ask(&self, request: &Request, body: &[&[u8]]) -> io::Result<Answered> {
        let channel = self.take();
        let number = self.next.fetch_add(1, Ordering::Relaxed) ^ process_salt();
        channel.send(number, request, body)?;
        let answered = hear(&channel, number)?;
        self.give_back(channel);
        Ok(answered)
    }

    /// Has the module run over several inputs, as many at a time as there are offices, without any thread.
    ///
    /// # Errors
    /// As [`Runners::ask`].
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

/// Sessions are forked from one process, and must not give the same numbers.
fn process_salt() -> u64 {
    u64::from(std::process::id()) << 32
}

fn hear(channel: &Channel, number: u64) -> io::Result<Answered> {
    loop {
        let message = channel.receive(MOST)?;
        let message = message.ok_or_else(|| io::Error::from(io::ErrorKind::UnexpectedEof))?;
        // What a bus process before this one has asked for is nobody's any more.
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
    // What runs here, whatever lies at its path by now.
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
