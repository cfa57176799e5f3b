//! I/O watchdog: records which thread waits for which file, and since when.

use std::cell::RefCell;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::mounts;

/// Number of hanging files in one directory from which the directory is no longer accessed.
pub(super) const PER_DIRECTORY: usize = 4;
/// The same limit for one mounted file system.
pub(super) const PER_MOUNT: usize = 4;
/// The same limit in total.
const IN_TOTAL: usize = 256;

/// Detects which of its threads wait for a file for too long. Such a thread is lost until the
/// system answers, and it cannot be stopped. So its work is given up, and other threads avoid the
/// file.
#[derive(Debug, Default)]
pub struct IoWatchdog {
    posts: Mutex<Vec<Arc<Post>>>,
    /// Overdue threads that have not returned, by path.
    lost: Mutex<HashMap<PathBuf, Lost>>,
    /// Number of these threads, readable without the lock.
    losses: AtomicUsize,
}

/// The threads that hang on one file.
#[derive(Debug)]
struct Lost {
    threads: usize,
    /// Mount point of its file system.
    mount: Option<PathBuf>,
}

/// The activity of one thread.
#[derive(Debug)]
struct Post {
    /// `None` if the work of the thread cannot be given up.
    owner: Option<u64>,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    at: Option<Waiting>,
    /// Whether its work was given up.
    lost: bool,
    /// The first temporary error and its path.
    moment: Option<(PathBuf, String)>,
}

#[derive(Debug)]
struct Waiting {
    path: PathBuf,
    since: Instant,
    /// Whether it counts as lost until the access ends.
    overdue: bool,
}

/// A thread that has waited for too long.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Overdue {
    /// Owner of its work, as given to [`IoWatchdog::attend`]. `None` if it continues to wait, see
    /// [`IoWatchdog::attend_for_good`].
    pub owner: Option<u64>,
    /// The path it waits for.
    pub path: PathBuf,
    /// Time it has waited.
    pub waited: Duration,
}

impl IoWatchdog {
    /// Watches every access of this thread to foreign files. It ends when the result is dropped on
    /// the same thread.
    pub fn attend(self: &Arc<IoWatchdog>, owner: u64) -> Attendance {
        self.post(Some(owner))
    }

    /// Works like [`IoWatchdog::attend`] for a thread that cannot be replaced. If it waits for too
    /// long, other threads avoid the file, and it continues once the system answers.
    pub fn attend_for_good(self: &Arc<IoWatchdog>) -> Attendance {
        self.post(None)
    }

    fn post(self: &Arc<IoWatchdog>, owner: Option<u64>) -> Attendance {
        let post = Arc::new(Post {
            owner,
            state: Mutex::default(),
        });
        lock(&self.posts).push(post.clone());
        let attended = Attended {
            io_watchdog: self.clone(),
            post: post.clone(),
        };
        let before = ATTENDED.with(|it| it.replace(Some(attended)));
        Attendance {
            io_watchdog: self.clone(),
            post,
            before,
        }
    }

    /// Returns the threads that have waited for one file for longer than `limit`, each of them
    /// once. Their work counts as given up from now on, unless they are watched for good.
    pub fn overdue(&self, limit: Duration) -> Vec<Overdue> {
        let posts = lock(&self.posts);
        posts
            .iter()
            .filter_map(|post| self.give_up(post, limit))
            .collect()
    }

    /// Checks as [`IoWatchdog::overdue`] whether the work of a thread of this owner is given up.
    pub fn is_given_up(&self, owner: u64, limit: Duration) -> bool {
        let posts = lock(&self.posts);
        let mut own = posts.iter().filter(|post| post.owner == Some(owner));
        own.any(|post| self.give_up(post, limit).is_some() || lock(&post.state).lost)
    }

    fn give_up(&self, post: &Post, limit: Duration) -> Option<Overdue> {
        let mut state = lock(&post.state);
        let waiting = state.at.as_mut().filter(|it| !it.overdue)?;
        let waited = waiting.since.elapsed();
        if waited < limit {
            return None;
        }
        waiting.overdue = true;
        let path = waiting.path.clone();
        state.lost = post.owner.is_some();
        let lost = || Lost {
            threads: 0,
            mount: mounts::mount_of(&path),
        };
        let mut all = lock(&self.lost);
        all.entry(path.clone()).or_insert_with(lost).threads += 1;
        drop(all);
        self.losses.fetch_add(1, Ordering::AcqRel);
        Some(Overdue {
            owner: post.owner,
            path,
            waited,
        })
    }

    /// Returns the paths on which threads currently hang.
    pub fn hanging(&self) -> Vec<PathBuf> {
        let mut paths: Vec<PathBuf> = lock(&self.lost).keys().cloned().collect();
        paths.sort();
        paths
    }

    /// Returns the reason why a thread must not access the path, if any.
    fn refuses(&self, path: &Path) -> Option<String> {
        if self.losses.load(Ordering::Acquire) == 0 {
            return None;
        }
        let lost = lock(&self.lost);
        if lost.contains_key(path) {
            return Some(
                "it has not responded for too long, and the access is still pending".to_owned(),
            );
        }
        let beside = |it: &&PathBuf| it.parent() == path.parent();
        if lost.keys().filter(beside).count() >= PER_DIRECTORY {
            return Some("files in its directory have not responded for too long".to_owned());
        }
        let mounts = lost.values().filter_map(|it| it.mount.as_ref());
        if mounts.filter(|it| path.starts_with(it)).count() >= PER_MOUNT {
            return Some("files on its file system have not responded for too long".to_owned());
        }
        (self.losses.load(Ordering::Acquire) >= IN_TOTAL)
            .then(|| format!("{IN_TOTAL} files have not responded for too long"))
    }

    /// Records that the system has answered, even if late.
    fn answered(&self, waiting: &mut Waiting) {
        if !std::mem::take(&mut waiting.overdue) {
            return;
        }
        let mut lost = lock(&self.lost);
        if let Some(it) = lost.get_mut(&waiting.path) {
            it.threads -= 1;
            if it.threads == 0 {
                lost.remove(&waiting.path);
            }
            self.losses.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

/// Guard: the thread is watched as long as this exists.
#[must_use]
#[derive(Debug)]
pub struct Attendance {
    io_watchdog: Arc<IoWatchdog>,
    post: Arc<Post>,
    before: Option<Attended>,
}

impl Attendance {
    /// Returns the first temporary error of the thread and its path. The data read then does not
    /// count.
    pub fn moment(&self) -> Option<(PathBuf, String)> {
        lock(&self.post.state).moment.clone()
    }

    #[cfg(test)]
    pub(super) fn waits_since(&self) -> Option<Instant> {
        lock(&self.post.state).at.as_ref().map(|it| it.since)
    }

    /// Checks whether the thread was overdue, so that its work was given up.
    pub fn was_given_up(&self) -> bool {
        lock(&self.post.state).lost
    }
}

impl Drop for Attendance {
    fn drop(&mut self) {
        let before = self.before.take();
        ATTENDED.with(|it| *it.borrow_mut() = before);
        lock(&self.io_watchdog.posts).retain(|post| !Arc::ptr_eq(post, &self.post));
    }
}

#[derive(Debug, Clone)]
struct Attended {
    io_watchdog: Arc<IoWatchdog>,
    post: Arc<Post>,
}

thread_local! {
    static ATTENDED: RefCell<Option<Attended>> = const { RefCell::new(None) };
}

fn attended() -> Option<Attended> {
    ATTENDED.with(|it| it.borrow().clone())
}

/// Records a temporary error.
pub(super) fn note(path: &Path, error: &io::Error) {
    if let Some(attended) = attended() {
        let mut state = lock(&attended.post.state);
        let moment = || (path.to_path_buf(), error.to_string());
        state.moment.get_or_insert_with(moment);
    }
}

/// One file access of a thread, possibly within another one.
pub(super) struct Access(Option<Begun>);

struct Begun {
    attended: Attended,
    /// The outer access, which continues afterwards.
    outer: Option<Waiting>,
}

impl Access {
    /// # Errors
    /// Returns [`io::ErrorKind::TimedOut`] if other threads hang there.
    pub(super) fn begin(path: &Path) -> io::Result<Access> {
        let Some(attended) = attended() else {
            return Ok(Access(None));
        };
        let given_up = lock(&attended.post.state).lost;
        let given_up = given_up.then(|| "it took too long".to_owned());
        if let Some(why) = given_up.or_else(|| attended.io_watchdog.refuses(path)) {
            let error = io::Error::new(io::ErrorKind::TimedOut, why);
            note(path, &error);
            return Err(error);
        }
        let waiting = Waiting {
            path: path.to_path_buf(),
            since: Instant::now(),
            overdue: false,
        };
        let mut outer = lock(&attended.post.state).at.replace(waiting);
        if let Some(outer) = &mut outer {
            attended.io_watchdog.answered(outer);
        }
        Ok(Access(Some(Begun { attended, outer })))
    }

    /// Restarts the waiting time, because data has arrived.
    pub(super) fn goes_on(&self) {
        if let Some(Begun { attended, .. }) = &self.0
            && let Some(waiting) = &mut lock(&attended.post.state).at
        {
            waiting.since = Instant::now();
        }
    }
}

impl Drop for Access {
    fn drop(&mut self) {
        let Some(Begun { attended, outer }) = &mut self.0 else {
            return;
        };
        let outer = outer.take().map(|outer| Waiting {
            since: Instant::now(),
            ..outer
        });
        let over = std::mem::replace(&mut lock(&attended.post.state).at, outer);
        if let Some(mut waiting) = over {
            attended.io_watchdog.answered(&mut waiting);
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
