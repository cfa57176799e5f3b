//! Output of children before they join. It goes to the broker's log immediately. The last lines are
//! kept to explain why a bundle is not ready.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{Read as _, Write as _};
use std::os::fd::{AsFd as _, AsRawFd as _, OwnedFd};
use std::process::Stdio;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use qcbus_bus::STDERR;
use qcbus_types::Launch;
use rustix::pipe::{PipeFlags, pipe_with};
use tokio::process::Command;
use tokio::sync::oneshot;

/// Maximum number of lines that are kept of a child, and maximum bytes of each line.
const LINES: usize = 8;
const LINE: usize = 300;
/// Maximum number of children with kept output.
const CHILDREN: usize = 64;
/// Maximum time for reading the remaining output after the end of a child. It is exceeded only if a
/// left-over process holds the other end of the pipe.
const READ_WITHIN: Duration = Duration::from_millis(500);

/// Final output of ended children, by name.
#[derive(Debug, Clone, Default)]
pub struct FinalOutput(Arc<Mutex<Kept>>);

#[derive(Debug, Default)]
struct Kept {
    words: BTreeMap<String, Vec<String>>,
    /// Running children that have joined. Their later output was not read here.
    joined: BTreeSet<Launch>,
}

impl FinalOutput {
    /// Returns the last lines of an ended child of this name.
    pub fn of(&self, name: &str) -> Vec<String> {
        self.kept().words.get(name).cloned().unwrap_or_default()
    }

    /// Records that a process has joined. Its earlier output is no longer of interest.
    pub fn joined(&self, launch: Launch) {
        self.kept().joined.insert(launch);
    }

    /// Deletes the output of the previous process of this name, because the next process did not even start.
    pub fn forget(&self, name: &str) {
        self.kept().words.remove(name);
    }

    /// Stores the output of a child that has just ended.
    pub async fn take_down(&self, launch: Launch, name: String, heard: Option<Heard>) {
        let Some(heard) = heard else {
            self.kept().joined.remove(&launch);
            return;
        };
        // The sender is dropped when all output was read.
        let _ = tokio::time::timeout(READ_WITHIN, heard.read).await;
        let lines = heard
            .tail
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .lines();
        let mut kept = self.kept();
        let has_joined = kept.joined.remove(&launch);
        let words = &mut kept.words;
        if words.len() >= CHILDREN && !words.contains_key(&name) {
            words.pop_first();
        }
        words.insert(name, if has_joined { Vec::new() } else { lines });
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Output that is being read from a child.
#[derive(Debug)]
pub struct Heard {
    tail: Arc<Mutex<Tail>>,
    read: oneshot::Receiver<()>,
}

/// Starts a thread that reads the child's stderr and forwards it to the broker's stderr. The child
/// also receives the broker's stderr. A bundle switches to it after joining, because it may outlive
/// this broker. Returns `None` if no output is read. The child then has the broker's stderr.
#[expect(
    unsafe_code,
    reason = "only the new process itself can keep a descriptor open, between fork and exec"
)]
pub fn listen_to(command: &mut Command) -> Option<Heard> {
    let lasting = std::io::stderr().as_fd().try_clone_to_owned().ok()?;
    let (reader, writer) = pipe_with(PipeFlags::CLOEXEC).ok()?;
    let heard = hear(reader)?;
    command.stderr(Stdio::from(writer));
    let stat = rustix::fs::fstat(&lasting).ok()?;
    let number = lasting.as_raw_fd();
    command.env(STDERR, format!("{number}:{}:{}", stat.st_dev, stat.st_ino));
    // SAFETY: between fork and exec only fcntl is called. The descriptor belongs to the closure,
    // which lives as long as the command.
    unsafe {
        command.pre_exec(
            move || match libc::fcntl(lasting.as_raw_fd(), libc::F_SETFD, 0) {
                -1 => Err(std::io::Error::last_os_error()),
                _ => Ok(()),
            },
        );
    }
    Some(heard)
}

fn hear(reader: OwnedFd) -> Option<Heard> {
    let tail = Arc::<Mutex<Tail>>::default();
    let (done, read) = oneshot::channel::<()>();
    let kept = tail.clone();
    let thread = std::thread::Builder::new().name("listen".to_owned());
    let listen = move || {
        let _done = done;
        let mut reader = std::fs::File::from(reader);
        let mut bytes = [0; 4096];
        while let Ok(count @ 1..) = reader.read(&mut bytes) {
            let said = bytes.get(..count).unwrap_or_default();
            kept.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .add(said);
            // If the log has no reader, the error cannot be reported.
            let _ = std::io::stderr().write_all(said);
        }
    };
    thread.spawn(listen).ok()?;
    Some(Heard { tail, read })
}

/// Last lines of a text of unlimited length.
#[derive(Debug, Default)]
struct Tail {
    lines: VecDeque<Vec<u8>>,
    /// Whether the last line is still incomplete.
    is_open: bool,
}

impl Tail {
    fn add(&mut self, bytes: &[u8]) {
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            if !std::mem::replace(&mut self.is_open, !part.ends_with(b"\n")) {
                self.lines.push_back(Vec::new());
            }
            if let Some(line) = self.lines.back_mut() {
                let room = LINE.saturating_sub(line.len());
                line.extend(part.iter().take(room));
            }
            if self.lines.len() > LINES {
                self.lines.pop_front();
            }
        }
    }

    fn lines(&self) -> Vec<String> {
        let lines = self.lines.iter();
        let lines = lines.map(|it| String::from_utf8_lossy(it).trim_end().to_owned());
        lines.filter(|it| !it.is_empty()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tail_keeps_last_lines_and_start_of_each() {
        let mut tail = Tail::default();
        tail.add(b"fir");
        tail.add(b"st\n\nsec");
        tail.add(b"ond");
        assert_eq!(tail.lines(), ["first", "second"]);
        tail.add(b"\n");
        for number in 0..1_000 {
            tail.add(format!("{number}\n").as_bytes());
        }
        let last: Vec<String> = (992..1_000).map(|it| it.to_string()).collect();
        assert_eq!(tail.lines(), last);
        for _ in 0..100 {
            tail.add(&[b'x'; 4096]);
        }
        tail.add("\u{fffd}\nend".as_bytes());
        let lines = tail.lines();
        assert_eq!(lines.last().unwrap(), "end");
        assert_eq!(lines[lines.len() - 2].len(), LINE);
    }

    #[tokio::test]
    async fn final_output_of_child_that_never_joined_is_kept() {
        let words = FinalOutput::default();
        let run = async |launch: u64| {
            let mut command = Command::new("sh");
            command.args(["-c", "echo early >&2; echo 'no module' >&2; exit 1"]);
            let heard = listen_to(&mut command);
            let mut child = command.spawn().unwrap();
            drop(command);
            child.wait().await.unwrap();
            words
                .take_down(Launch(launch), "mine".to_owned(), heard)
                .await;
        };
        run(1).await;
        assert_eq!(words.of("mine"), ["early", "no module"]);
        assert!(words.of("other").is_empty());
        words.forget("mine");
        assert!(words.of("mine").is_empty());
        words.joined(Launch(3));
        run(2).await;
        assert_eq!(words.of("mine"), ["early", "no module"]);
        run(3).await;
        assert!(words.of("mine").is_empty(), "the process had joined");
    }
}
