//! Who is waiting for which file, and since when.

use std::cell::RefCell;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::mounts;

/// Files of one directory that threads may wait for in vain before nobody goes there any more.
pub(super) const PER_DIRECTORY: usize = 4;
/// The same of one file system that is mounted.
pub(super) const PER_MOUNT: usize = 4;
/// And in total.
const IN_TOTAL: usize = 256;

/// Sees which of its threads wait for a file for too long. Such a thread is lost until the system answers,
/// and nothing can end it: so its work is given up, and nobody else goes where it hangs.
#[derive(Debug, Default)]
pub struct IoWatchdog {
    posts: Mutex<Vec<Arc<Post>>>,
    /// By path, threads that were found overdue and have not come back.
    lost: Mutex<HashMap<PathBuf, Lost>>,
    /// How many those are, to be looked at without the lock.
    losses: AtomicUsize,
}

/// The threads that wait in vain for one file.
#[derive(Debug)]
struct Lost {
    threads: usize,
    /// Where its file system is mounted.
    mount: Option<PathBuf>,
}

/// What one thread does.
#[derive(Debug)]
struct Post {
    /// None: its work is nobody else's, so nobody can give it up.
    owner: Option<u64>,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    at: Option<Waiting>,
    /// Its work was given up.
    lost: bool,
    /// The first error of the moment, and where.
    moment: Option<(PathBuf, String)>,
}

#[derive(Debug)]
struct Waiting {
    path: PathBuf,
    since: Instant,
    /// It stands among the lost until it is over.
    overdue: bool,
}

/// A thread that has waited for too long.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Overdue {
    /// Whose work it does, as given to [`IoWatchdog::attend`]. None: it waits on, see [`IoWatchdog::attend_for_good`].
    pub owner: Option<u64>,
    /// What it waits for.
    pub path: PathBuf,
    /// For how long.
    pub waited: Duration,
}

impl IoWatchdog {
    /// From now on everything that this thread does with files of others is seen, until the attendance
    /// is dropped on the same thread.
    pub fn attend(self: &Arc<IoWatchdog>, owner: u64) -> Attendance {
        self.post(Some(owner))
    }

    /// As [`IoWatchdog::attend`] for a thread that nobody can replace: when it waits for too long that is seen, others
    /// do not go there, and it goes on once the system answers.
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

    /// The threads that have waited for one file for longer than `limit`, each of them once. From now on
    /// their work counts as given up, unless they were attended for good.
    pub fn overdue(&self, limit: Duration) -> Vec<Overdue> {
        let posts = lock(&self.posts);
        posts
            .iter()
            .filter_map(|post| self.give_up(post, limit))
            .collect()
    }

    /// As [`IoWatchdog::overdue`] for the threads of one owner.
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

    /// What threads wait for in vain at the moment.
    pub fn hanging(&self) -> Vec<PathBuf> {
        let mut paths: Vec<PathBuf> = lock(&self.lost).keys().cloned().collect();
        paths.sort();
        paths
    }

    /// Whether a thread may go there.
    fn refuses(&self, path: &Path) -> Option<String> {
        if self.losses.load(Ordering::Acquire) == 0 {
            return None;
        }
        let lost = lock(&self.lost);
        if lost.contains_key(path) {
            return Some("it has not answered for too long, and is still waited for".to_owned());
        }
        let beside = |it: &&PathBuf| it.parent() == path.parent();
        if lost.keys().filter(beside).count() >= PER_DIRECTORY {
            return Some("files in its directory have not answered for too long".to_owned());
        }
        let mounts = lost.values().filter_map(|it| it.mount.as_ref());
        if mounts.filter(|it| path.starts_with(it)).count() >= PER_MOUNT {
            return Some("files on its file system have not answered for too long".to_owned());
        }
        (self.losses.load(Ordering::Acquire) >= IN_TOTAL)
            .then(|| format!("{IN_TOTAL} files have not answered for too long"))
    }

    /// The system has answered, be it late.
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

/// A thread is attended as long as this lives.
#[must_use]
#[derive(Debug)]
pub struct Attendance {
    io_watchdog: Arc<IoWatchdog>,
    post: Arc<Post>,
    before: Option<Attended>,
}

impl Attendance {
    /// The first error of the moment that the thread has met, and where: what it read does not count then.
    pub fn moment(&self) -> Option<(PathBuf, String)> {
        lock(&self.post.state).moment.clone()
    }

    #[cfg(test)]
    pub(super) fn waits_since(&self) -> Option<Instant> {
        lock(&self.post.state).at.as_ref().map(|it| it.since)
    }

    /// Whether the thread was found overdue: its work was given up, and nobody waits for it.
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

/// Writes down what went wrong for now.
pub(super) fn note(path: &Path, error: &io::Error) {
    if let Some(attended) = attended() {
        let mut state = lock(&attended.post.state);
        let moment = || (path.to_path_buf(), error.to_string());
        state.moment.get_or_insert_with(moment);
    }
}

/// One thing that the system is asked about a file, perhaps while something else is done with another one.
pub(super) struct Access(Option<Begun>);

struct Begun {
    attended: Attended,
    /// What is gone on with afterwards.
    outer: Option<Waiting>,
}

impl Access {
    /// # Errors
    /// [`io::ErrorKind::TimedOut`] where others wait in vain.
    pub(super) fn begin(path: &Path) -> io::Result<Access> {
        let Some(attended) = attended() else {
            return Ok(Access(None));
        };
        let given_up = lock(&attended.post.state).lost;
        let given_up = given_up.then(|| "it has taken too long".to_owned());
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

    /// Something has come: whoever waits does not wait in vain.
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
