//! Protocol between a fork server and its parent. A frame has a length and fields separated by zero
//! bytes. Paths, arguments and variables cannot contain zero bytes.

use std::ffi::OsString;
use std::io::{self, IoSlice, Read, Write};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;

use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};

use super::Run;

/// Answer of a fork server.
#[derive(Debug)]
pub(super) enum Answer {
    /// The program is loaded from these files.
    Ready(Vec<PathBuf>),
    /// The program cannot be loaded in advance.
    Cold(String),
    /// The job runs as this process.
    Pid(u32),
    /// The job could not be started.
    Failed(String),
    /// The job has ended with this `waitpid` status.
    End(u32, i32),
}

/// Maximum length of an answer. The paths of a thousand files need about 100 kB.
const LONGEST: usize = 16 << 20;

/// Requests a job.
pub(super) fn ask(socket: &UnixStream, run: &Run<'_>, arguments: &[OsString]) -> io::Result<()> {
    let body = request(run, arguments);
    let length = u32::try_from(body.len())
        .map_err(io::Error::other)?
        .to_le_bytes();
    let fds = [run.stdin, run.stdout, run.stderr];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(3))];
    let mut ancillary = SendAncillaryBuffer::new(&mut space);
    if !ancillary.push(SendAncillaryMessage::ScmRights(&fds)) {
        return Err(io::Error::other("no space for three descriptors"));
    }
    let sent = sendmsg(
        socket.as_fd(),
        &[IoSlice::new(&length)],
        &mut ancillary,
        SendFlags::NOSIGNAL,
    )?;
    let mut socket = socket;
    socket.write_all(&length[sent..])?;
    socket.write_all(&body)
}

fn request(run: &Run<'_>, arguments: &[OsString]) -> Vec<u8> {
    let number = |it: Option<u64>| it.map(|it| it.to_string()).unwrap_or_default().into_bytes();
    let limits = &run.limits;
    let mut fields = vec![run.cwd.as_os_str().as_bytes().to_vec()];
    fields.extend([limits.memory, limits.file_size].map(number));
    fields.push(arguments.len().to_string().into_bytes());
    fields.extend(arguments.iter().map(|it| it.as_bytes().to_vec()));
    // A shell sets this variable in the same way.
    fields.push([b"PWD=", run.cwd.as_os_str().as_bytes()].concat());
    for (name, value) in run.environment.iter().filter(|(name, _)| name != "PWD") {
        fields.push([name.as_bytes(), b"=", value.as_bytes()].concat());
    }
    fields.join(&0)
}

/// Waits for the next answer and reads it.
pub(super) fn answer(mut socket: &UnixStream) -> io::Result<Answer> {
    let mut length = [0; 4];
    socket.read_exact(&mut length)?;
    let length = u32::from_le_bytes(length) as usize;
    if length > LONGEST {
        return Err(io::Error::other("the answer is too long"));
    }
    let mut body = vec![0; length];
    socket.read_exact(&mut body)?;
    let mut fields = body.split(|byte| *byte == 0);
    let kind = fields.next().unwrap_or_default().to_vec();
    let fields: Vec<&[u8]> = fields.collect();
    read(&kind, &fields).ok_or_else(|| io::Error::other("the answer cannot be read"))
}

fn read(kind: &[u8], fields: &[&[u8]]) -> Option<Answer> {
    let text = |at: usize| Some(String::from_utf8_lossy(fields.get(at)?).into_owned());
    let path = |it: &&[u8]| PathBuf::from(OsString::from_vec(it.to_vec()));
    match kind {
        b"ready" => Some(Answer::Ready(fields.iter().map(path).collect())),
        b"cold" => Some(Answer::Cold(text(0)?)),
        b"pid" => Some(Answer::Pid(text(0)?.parse().ok()?)),
        b"failed" => Some(Answer::Failed(text(0)?)),
        b"end" => Some(Answer::End(text(0)?.parse().ok()?, text(1)?.parse().ok()?)),
        _ => None,
    }
}

/// Checks whether data or the end of the stream can be read.
pub(super) fn is_readable(fd: BorrowedFd<'_>) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut fds = [PollFd::from_borrowed_fd(fd, PollFlags::IN)];
    let now = Timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    Ok(poll(&mut fds, Some(&now))? > 0)
}
