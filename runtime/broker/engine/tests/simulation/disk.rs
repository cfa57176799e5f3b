//! The simulated files, their writers, and the kernel's events about them.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use qcbus_ingest::Stat;
use qcbus_messages::Digest;
use qcbus_types::digest_of;

use super::kernel::Telling;

/// The files: two maps, scenarios on them, and the part that the second map includes.
pub const FILES: [&str; 6] = [
    "a.xodr",
    "b.xodr",
    "s.xosc",
    "t.xosc",
    "sub/u.xosc",
    "p.xml",
];
/// Range of the files that get a verdict.
pub const JUDGED: std::ops::Range<usize> = 0..5;
/// Index of the part that the second map includes.
const PART: usize = 5;

/// Returns the map of a scenario.
pub fn map_of(file: usize) -> Option<usize> {
    match file {
        2 | 4 => Some(0),
        3 => Some(1),
        _ => None,
    }
}

/// Defect of a file's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    Good,
    Bad,
    /// For a map: it is sound but not suitable for scenarios.
    Unfit,
}

/// Properties that the writer intended for the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Meant {
    pub mark: Mark,
    /// Whether the bytes are complete.
    pub whole: bool,
    /// Whether the bytes include the part.
    pub includes: bool,
}

/// Digest of the bytes at every path.
pub type Lying = [Option<Digest>; FILES.len()];

/// The simulated files.
pub struct Disk {
    pub root: PathBuf,
    pub lying: Lying,
    /// State before each step that changed something, newest last.
    pub changes: Vec<(usize, Lying)>,
    pub meant: HashMap<Digest, Meant>,
    /// Queue of change events.
    pub telling: Telling,
    /// Files with an unfinished write. They stay open.
    open: Vec<File>,
    /// Simulated modification and change time for each real modification time.
    times: HashMap<i128, (i128, i128)>,
    /// Inode numbers in the order of the first lookup, so that every run gives the same numbers.
    inodes: Mutex<HashMap<u64, u64>>,
    serial: u64,
    texts: u64,
    sub_is_away: bool,
}

impl Disk {
    pub fn new(root: PathBuf) -> Disk {
        Disk {
            root,
            lying: [None; FILES.len()],
            changes: Vec::new(),
            meant: HashMap::new(),
            telling: Telling::default(),
            open: Vec::new(),
            times: HashMap::new(),
            inodes: Mutex::default(),
            serial: 0,
            texts: 0,
            sub_is_away: false,
        }
    }

    pub fn path(&self, file: usize) -> PathBuf {
        self.root.join(FILES[file])
    }

    pub fn file_at(&self, path: &Path) -> Option<usize> {
        FILES.iter().position(|name| self.root.join(name) == path)
    }

    pub fn stat(&self, told: Stat) -> Stat {
        let mut inodes = self.inodes.lock().unwrap();
        let next = inodes.len() as u64 + 1;
        let inode = *inodes.entry(told.inode).or_insert(next);
        match self.times.get(&told.modified_ns) {
            Some((modified_ns, changed_ns)) => Stat {
                inode,
                modified_ns: *modified_ns,
                changed_ns: *changed_ns,
            },
            None => told,
        }
    }

    fn meant_at(&self, lying: &Lying, file: usize) -> Option<Meant> {
        lying[file].and_then(|digest| self.meant.get(&digest).copied())
    }

    /// Checks whether a file must be accepted in this state. `maps`: the bundle that checks maps must judge, too.
    pub fn is_sound(&self, lying: &Lying, file: usize, maps: bool) -> bool {
        let sound = |it: Meant| it.whole && it.mark != Mark::Bad;
        let part = self.meant_at(lying, PART);
        let own = |it: Meant| sound(it) && (!it.includes || part.is_some_and(sound));
        // A scenario is only as good as its map.
        let map = |it: Meant| own(it) && (it.mark != Mark::Unfit || !maps);
        self.meant_at(lying, file).is_some_and(own)
            && map_of(file).is_none_or(|it| self.meant_at(lying, it).is_some_and(map))
    }

    /// Checks whether a bundle must have found an error in the file itself.
    pub fn is_faulty(&self, lying: &Lying, file: usize) -> bool {
        let faulty = |it: Meant| !it.whole || it.mark == Mark::Bad;
        self.meant_at(lying, file).is_some_and(faulty)
    }

    /// Checks whether the file includes the part in this state.
    pub fn includes(&self, lying: &Lying, file: usize) -> bool {
        self.meant_at(lying, file).is_some_and(|it| it.includes)
    }

    /// Returns all states that existed at some time since a step.
    pub fn since(&self, step: usize) -> impl Iterator<Item = &Lying> {
        let recent = self.changes.iter().rev();
        let recent = recent.take_while(move |(at, _)| *at >= step);
        std::iter::once(&self.lying).chain(recent.map(|(_, before)| before))
    }

    fn text(&mut self, file: usize, mark: Mark, whole: bool) -> Vec<u8> {
        self.texts += 1;
        let (number, mark) = (
            self.texts % 1_000_000,
            match mark {
                Mark::Good => "good-",
                Mark::Bad => "bad--",
                Mark::Unfit => "unfit",
            },
        );
        let text = match file {
            PART => {
                format!(
                    "<OpenDRIVE><end name=\"PART-{mark} {number:06}\"/><end name=\"PART-WHOLE\"/></OpenDRIVE>"
                )
            }
            0 | 1 => {
                let include = if file == 1 {
                    "<include file=\"p.xml\"/><end name=\"NEEDS-PART\"/>"
                } else {
                    ""
                };
                format!(
                    "<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\" name=\"MARK-{mark} {number:06}\"/>\
                     {include}<end name=\"ALL-THERE\"/></OpenDRIVE>"
                )
            }
            _ => {
                let map = FILES[map_of(file).unwrap_or(0)];
                let up = if FILES[file].contains('/') { "../" } else { "" };
                format!(
                    "<OpenSCENARIO><FileHeader description=\"MARK-{mark} {number:06}\"/><RoadNetwork>\
                     <LogicFile filepath=\"{up}{map}\"/></RoadNetwork><end name=\"ALL-THERE\"/></OpenSCENARIO>"
                )
            }
        };
        let most = if whole {
            text.len()
        } else {
            text.len() * 2 / 3
        };
        text.as_bytes()[..most].to_vec()
    }

    fn lies(&mut self, file: usize, step: usize, digest: Option<Digest>) {
        self.changes.push((step, self.lying));
        self.lying[file] = digest;
    }

    /// Sets the simulated times of a file: changed now, and modified at the given time or now.
    fn mark_times(&mut self, path: &Path, wall: i128, modified: Option<i128>) {
        self.serial += 1;
        let real = Duration::from_secs(1_000_000) + Duration::from_nanos(self.serial);
        let key = 1_000_000_000_000_000 + i128::from(self.serial);
        let now = wall + i128::from(self.serial);
        self.times.insert(key, (modified.unwrap_or(now), now));
        // The times are set by path, because opening the file would cause further events.
        let set = |time: Duration| rustix::fs::Timespec {
            tv_sec: i64::try_from(time.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: i64::from(time.subsec_nanos()),
        };
        let times = rustix::fs::Timestamps {
            last_access: set(real),
            last_modification: set(real),
        };
        let flags = rustix::fs::AtFlags::empty();
        rustix::fs::utimensat(rustix::fs::CWD, path, &times, flags)
            .expect("the times of the file can be set");
    }

    /// Returns the simulated modification time of an existing file.
    fn modified(&self, path: &Path) -> Option<i128> {
        let data = fs::metadata(path).ok()?;
        Some(self.stat(Stat::of(&data)).modified_ns)
    }

    pub fn write(&mut self, file: usize, at: (usize, i128), mark: Mark, how: How) {
        let (step, wall) = at;
        let path = self.path(file);
        if how.keeps_bytes() && self.lying[file].is_some() {
            return self.touch(file, at, how);
        }
        let bytes = self.text(file, mark, how != How::Torn);
        let digest = digest_of(&bytes);
        let whole = how != How::Torn;
        let meant = Meant {
            mark,
            whole,
            includes: file == 1,
        };
        self.meant.insert(digest, meant);
        let before = self.modified(&path);
        let parent = path
            .parent()
            .expect("the file has a parent directory")
            .to_path_buf();
        if !parent.exists() {
            fs::create_dir_all(&parent).expect("the directory can be created");
            self.sub_is_away = false;
        }
        if how == How::Renamed {
            let aside = self.root.with_extension("aside");
            fs::write(&aside, &bytes).expect("the temporary file can be written");
            self.mark_times(&aside, wall, None);
            fs::rename(&aside, &path).expect("the file can be renamed");
            return self.lies(file, step, Some(digest));
        }
        let mut open = File::create(&path).expect("the file can be created");
        open.write_all(&bytes).expect("the file can be written");
        if how == How::Torn {
            self.open.push(open);
        }
        self.mark_times(&path, wall, before.filter(|_| how == How::TimePutBack));
        self.lies(file, step, Some(digest));
    }

    /// Changes a file without changing its bytes.
    fn touch(&mut self, file: usize, (_, wall): (usize, i128), how: How) {
        let path = self.path(file);
        let before = self.modified(&path).filter(|_| how == How::Touched);
        if how == How::Again {
            let bytes = fs::read(&path).expect("the file can be read");
            fs::write(&path, bytes).expect("the file can be written");
        }
        self.mark_times(&path, wall, before);
    }

    pub fn remove(&mut self, file: usize, step: usize) {
        let path = self.path(file);
        if fs::remove_file(&path).is_ok() {
            self.lies(file, step, None);
        }
    }

    /// Replaces one file by another.
    pub fn rename(&mut self, from: usize, to: usize, (step, wall): (usize, i128)) {
        let (old, new) = (self.path(from), self.path(to));
        let parent_is_there = new.parent().is_some_and(Path::exists);
        let Some(digest) = self.lying[from].filter(|_| from != to && parent_is_there) else {
            return;
        };
        let modified = self.modified(&old);
        fs::rename(&old, &new).expect("the file can be renamed");
        self.mark_times(&new, wall, modified);
        self.lies(from, step, None);
        // Both changes happen in the same step.
        self.lying[to] = Some(digest);
    }

    /// Moves the whole directory away, or back.
    pub fn move_directory(&mut self, step: usize) {
        let (here, away) = (self.root.join("sub"), self.root.with_extension("away"));
        let file = 4;
        if self.sub_is_away && !here.exists() {
            fs::rename(&away, &here).expect("the directory can be moved");
            self.sub_is_away = false;
            let bytes = fs::read(self.path(file)).ok();
            self.lies(file, step, bytes.map(|it| digest_of(&it)));
        } else if here.exists() {
            let _ = fs::remove_dir_all(&away);
            fs::rename(&here, &away).expect("the directory can be moved");
            self.sub_is_away = true;
            self.lies(file, step, None);
        }
    }
}

/// Manner in which a file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    InPlace,
    TimePutBack,
    Renamed,
    /// The write is incomplete: the file stays open.
    Torn,
    /// The same bytes are written again.
    Again,
    /// Only the metadata changes.
    Touched,
}

impl How {
    fn keeps_bytes(self) -> bool {
        matches!(self, How::Again | How::Touched)
    }
}

/// Properties of a file that are visible in its image.
pub struct Found {
    whole: bool,
    bad: bool,
    unfit: bool,
    lacks_part: bool,
    bad_part: bool,
}

impl Found {
    pub fn is_faulty(&self) -> bool {
        !self.whole || self.bad || self.lacks_part || self.bad_part
    }

    pub fn is_unfit(&self) -> bool {
        !self.whole || self.unfit || self.lacks_part
    }
}

/// Searches the bytes of an image without any model.
pub fn found_in(image: &[u8]) -> Found {
    let text = String::from_utf8_lossy(image);
    Found {
        whole: text.contains("ALL-THERE"),
        bad: text.contains("MARK-bad--"),
        unfit: text.contains("MARK-unfit"),
        lacks_part: text.contains("NEEDS-PART") && !text.contains("PART-WHOLE"),
        bad_part: text.contains("PART-bad--"),
    }
}
