//! Whether what lies at a path is in our hands alone.
//!
//! Who can replace a file decides what is read from it. So everything on the way to it is looked at,
//! component by component and through descriptors, links never followed but read: each must belong to
//! this user or to root, and be writable by nobody else. The last descriptor is the one that is read, so
//! nothing can be exchanged between the look and the use.

use std::collections::VecDeque;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, Read};
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::ffi::OsStringExt;
use std::path::{Component, Path, PathBuf};

use qcbus_messages::path_text::to_text;
use rustix::fs::{FileType, Mode, OFlags, Stat};
use rustix::io::Errno;

/// Links on one way, as many as the kernel follows.
const MAX_LINKS: usize = 40;
/// Who owns what nobody here owns: `nobody`, as the kernel shows it.
const OVERFLOW: u32 = 65_534;

/// Why what lies at a path is not used.
#[derive(Debug, thiserror::Error)]
pub enum TrustError {
    /// Somebody else decides what lies there.
    #[error("{}", explain(asked, at, why))]
    Foreign {
        /// What was to be used.
        asked: PathBuf,
        /// What is wrong on the way to it, or itself.
        at: PathBuf,
        /// What is wrong with that.
        why: Foreign,
    },
    /// It cannot be had.
    #[error("cannot use {}: {source}", to_text(path))]
    Io {
        /// What was to be used.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

impl TrustError {
    /// Whether nothing lies at the path.
    pub fn is_absent(&self) -> bool {
        matches!(self, TrustError::Io { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }
}

/// How somebody else decides what lies at a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foreign {
    /// It belongs to this user, who is neither root nor us.
    Owner(u32),
    /// Everybody may write to it; the mode.
    World(u32),
    /// This group may write to it, which is no private one of ours; the mode.
    Group(u32, u32),
    /// It is no regular file.
    Special,
}

fn explain(asked: &Path, at: &Path, why: &Foreign) -> String {
    let (us, place) = (rustix::process::geteuid().as_raw(), to_text(at));
    let end = match asked == at {
        true => "so others decide what is in it".to_owned(),
        false => format!("so others decide what {} is", to_text(asked)),
    };
    match why {
        Foreign::Owner(OVERFLOW) => format!(
            "{place} belongs to user {OVERFLOW} (nobody) and not to user {us}, who runs this, {end}: that is \
             how files of users show whom this container does not know, and what root writes to NFS with \
             root_squash; run this as the user who owns it, or use a directory on a disk of this machine"
        ),
        Foreign::Owner(them) => format!(
            "{place} belongs to user {them} and not to user {us}, who runs this, {end}: run this as user \
             {them} (`docker run --user {them}`), or make it yours (`chown {us}`) after a look at what is in it"
        ),
        Foreign::World(mode) | Foreign::Group(mode, _) if mode & 0o1000 != 0 => format!(
            "others may write to {place} (mode {mode:04o}; its sticky bit only protects what is there \
             already), {end}: use a directory of your own below it ({}/NAME)",
            place.trim_end_matches('/')
        ),
        Foreign::World(mode) => format!(
            "everybody may write to {place} (mode {mode:04o}), {end}: take that away (`chmod o-w`), or see to \
             it that a directory's entries are their owners' (`chmod +t`) and keep what is yours below it"
        ),
        Foreign::Group(mode, group) => format!(
            "group {group} may write to {place} (mode {mode:04o}), {end}: take that away (`chmod g-w`), or \
             see to it that a directory's entries are their owners' (`chmod +t`); only the private group of \
             the user, of the same number, counts as the user"
        ),
        Foreign::Special => format!("{place} is no regular file, {end}"),
    }
}

/// Reads a file that is in our hands alone.
///
/// # Errors
/// [`TrustError`]; a file of more than `limit` bytes is [`io::ErrorKind::FileTooLarge`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, TrustError> {
    let found = walk(path, None)?;
    let file = found.open(path)?;
    let mut bytes = Vec::new();
    let read = file.take(limit.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|source| failed(path, source))?;
    if bytes.len() as u64 > limit {
        return Err(failed(path, io::ErrorKind::FileTooLarge.into()));
    }
    Ok(bytes)
}

/// Looks whether a file is in our hands alone: a program, say. It stays what it is, because nobody else
/// can replace it or anything on the way to it.
///
/// # Errors
/// [`TrustError`].
pub fn look_at_file(path: &Path) -> Result<(), TrustError> {
    let found = walk(path, None)?;
    found.is_ours_alone(path, found.kind() == FileType::RegularFile)
}

/// Opens a directory that is in our hands alone.
///
/// # Errors
/// [`TrustError`].
pub fn directory(path: &Path) -> Result<OwnedFd, TrustError> {
    open_directory(path, &walk(path, None)?)
}

/// As [`directory`], and makes it where it is missing, with all that is missing on the way to it.
///
/// # Errors
/// [`TrustError`].
pub fn make_directory(path: &Path) -> Result<OwnedFd, TrustError> {
    let mode = Mode::from_raw_mode(0o755);
    open_directory(path, &walk(path, Some(mode))?)
}

/// A directory that only this user can read, made where it is missing. One of ours that others can look
/// into is closed to them; one of somebody else's, root among them, is refused as it is.
///
/// # Errors
/// [`TrustError`].
pub fn make_private_directory(path: &Path) -> Result<OwnedFd, TrustError> {
    let found = walk(path, Some(Mode::RWXU))?;
    let owner = found.stat.st_uid;
    if owner != rustix::process::geteuid().as_raw() {
        return Err(found.foreign(path, Foreign::Owner(owner)));
    }
    let opened = found.reopen(path, OFlags::DIRECTORY)?;
    let stat = rustix::fs::fstat(&opened).map_err(|error| failed(path, error.into()))?;
    if stat.st_mode & 0o077 != 0 {
        let closed = rustix::fs::fchmod(&opened, Mode::RWXU);
        closed.map_err(|error| failed(path, error.into()))?;
    }
    Ok(opened)
}

fn open_directory(path: &Path, found: &Found) -> Result<OwnedFd, TrustError> {
    if found.kind() != FileType::Directory {
        return Err(failed(path, Errno::NOTDIR.into()));
    }
    found.is_ours_alone(path, true)?;
    found.reopen(path, OFlags::DIRECTORY)
}

/// What a way leads to. Everything before it is in our hands alone.
struct Found {
    /// The directory that it lies in, and its name there.
    parent: OwnedFd,
    name: OsString,
    /// Where that is.
    at: PathBuf,
    stat: Stat,
}

impl Found {
    fn kind(&self) -> FileType {
        FileType::from_raw_mode(self.stat.st_mode)
    }

    fn foreign(&self, asked: &Path, why: Foreign) -> TrustError {
        foreign(asked, &self.at, why)
    }

    fn is_ours_alone(&self, asked: &Path, is_kind: bool) -> Result<(), TrustError> {
        if !is_kind {
            return Err(self.foreign(asked, Foreign::Special));
        }
        let writer = other_writer(&self.stat, || has_access_list(&self.parent, &self.name));
        writer.map_or(Ok(()), |why| Err(self.foreign(asked, why)))
    }

    /// Opens it for reading. It still is what it was: nobody else can replace it where it lies.
    fn reopen(&self, asked: &Path, kind: OFlags) -> Result<OwnedFd, TrustError> {
        let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
        let flags = flags | OFlags::CLOEXEC | kind;
        rustix::fs::openat(&self.parent, &self.name, flags, Mode::empty())
            .map_err(|error| failed(asked, error.into()))
    }

    /// Opens a regular file that is ours alone: what counts is the descriptor that is read.
    fn open(mut self, asked: &Path) -> Result<File, TrustError> {
        // Before it is opened: opening a device can do something.
        self.is_ours_alone(asked, self.kind() == FileType::RegularFile)?;
        let opened = self.reopen(asked, OFlags::empty())?;
        self.stat = rustix::fs::fstat(&opened).map_err(|error| failed(asked, error.into()))?;
        self.is_ours_alone(asked, self.kind() == FileType::RegularFile)?;
        Ok(File::from(opened))
    }
}

/// Goes to a path from the root, and says what lies there. `make`: missing directories are made.
fn walk(asked: &Path, make: Option<Mode>) -> Result<Found, TrustError> {
    let io = |error: Errno| failed(asked, error.into());
    let path = std::path::absolute(asked).map_err(|source| failed(asked, source))?;
    let mut ahead: VecDeque<OsString> = parts(&path);
    let mut parent = root(asked)?;
    let mut at = PathBuf::from("/");
    let mut links = 0;
    loop {
        // The root itself is its own parent.
        let name = ahead.pop_front().unwrap_or_else(|| OsString::from("."));
        let found = open_entry(&parent, &name, make).map_err(io)?;
        let stat = rustix::fs::fstat(&found).map_err(io)?;
        let place = at.join(&name);
        let place = match name.to_str() {
            Some(".") => at.clone(),
            Some("..") => at.parent().unwrap_or(&at).to_path_buf(),
            _ => place,
        };
        let is_link = FileType::from_raw_mode(stat.st_mode) == FileType::Symlink;
        let is_last = ahead.is_empty() && !is_link;
        is_of_a_friend(&stat, is_last).map_err(|why| foreign(asked, &place, why))?;
        if is_link {
            links += 1;
            if links > MAX_LINKS {
                return Err(io(Errno::LOOP));
            }
            let target = rustix::fs::readlinkat(&found, "", Vec::new()).map_err(io)?;
            let target = PathBuf::from(OsString::from_vec(target.into_bytes()));
            for part in parts(&target).into_iter().rev() {
                ahead.push_front(part);
            }
            if target.is_absolute() {
                (parent, at) = (root(asked)?, PathBuf::from("/"));
            }
            continue;
        }
        if is_last {
            let at = place;
            return Ok(Found {
                parent,
                name,
                at,
                stat,
            });
        }
        let is_sticky = stat.st_mode & 0o1000 != 0;
        let writer = other_writer(&stat, || has_access_list(&parent, &name));
        if let Some(why) = writer.filter(|_| !is_sticky) {
            return Err(foreign(asked, &place, why));
        }
        (parent, at) = (found, place);
    }
}

fn parts(path: &Path) -> VecDeque<OsString> {
    let part = |part: Component<'_>| match part {
        Component::Normal(name) => Some(name.to_owned()),
        Component::ParentDir => Some(OsString::from("..")),
        Component::RootDir | Component::CurDir | Component::Prefix(_) => None,
    };
    path.components().filter_map(part).collect()
}

fn root(asked: &Path) -> Result<OwnedFd, TrustError> {
    let flags = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
    rustix::fs::open("/", flags, Mode::empty()).map_err(|error| failed(asked, error.into()))
}

fn open_entry(parent: &OwnedFd, name: &OsStr, make: Option<Mode>) -> Result<OwnedFd, Errno> {
    let flags = OFlags::PATH | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let open = || rustix::fs::openat(parent, name, flags, Mode::empty());
    match (open(), make) {
        (Err(Errno::NOENT), Some(mode)) => {
            match rustix::fs::mkdirat(parent, name, mode) {
                // Somebody was faster: what lies there is looked at as anything else.
                Ok(()) | Err(Errno::EXIST) => open(),
                Err(error) => Err(error),
            }
        }
        (opened, _) => opened,
    }
}

/// Root and this user. On the way also whoever owns the root directory: in a namespace that does not
/// know root, that is how the system's directories look.
fn is_of_a_friend(stat: &Stat, is_last: bool) -> Result<(), Foreign> {
    let owner = stat.st_uid;
    let system = || rustix::fs::stat("/").is_ok_and(|root| root.st_uid == owner);
    let known = owner == 0 || owner == rustix::process::geteuid().as_raw();
    match known || (!is_last && system()) {
        true => Ok(()),
        false => Err(Foreign::Owner(owner)),
    }
}

/// Who besides its owner may write to it, as its mode has it.
fn other_writer(stat: &Stat, has_access_list: impl Fn() -> bool) -> Option<Foreign> {
    let mode = stat.st_mode & 0o7777;
    if mode & 0o002 != 0 {
        return Some(Foreign::World(mode));
    }
    if mode & 0o020 == 0 {
        return None;
    }
    // With umask 002 everything of a user is writable for a group that has no other member. Group 0 is
    // root's.
    let (us, group) = (rustix::process::geteuid().as_raw(), stat.st_gid);
    let is_private = group == 0 || (group == us && rustix::process::getegid().as_raw() == us);
    (!is_private || has_access_list()).then_some(Foreign::Group(mode, group))
}

/// Where there is an access list the bits of the group say what anybody on it may do at most.
fn has_access_list(parent: &OwnedFd, name: &OsStr) -> bool {
    let path = PathBuf::from(format!("/proc/self/fd/{}", parent.as_raw_fd())).join(name);
    let list = "system.posix_acl_access";
    rustix::fs::lgetxattr(path, list, &mut [0_u8; 0][..]).is_ok()
}

fn foreign(asked: &Path, at: &Path, why: Foreign) -> TrustError {
    TrustError::Foreign {
        asked: asked.to_path_buf(),
        at: at.to_path_buf(),
        why,
    }
}

fn failed(path: &Path, source: io::Error) -> TrustError {
    TrustError::Io {
        path: path.to_path_buf(),
        source,
    }
}

#[cfg(test)]
mod tests;
