//! Actions of the driver on files.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, UNIX_EPOCH};

use super::driver::Driver;
use crate::support::content::{CATALOG, CATALOGS, Content, Mark};
use crate::support::dice::Dice;
use crate::support::watchdog::pause;

/// Maximum number of files at the same time.
const FILES: usize = 80;
/// Offset before and after 1970 of the modification times of some files.
const LONG_AGO: Duration = Duration::from_secs(1_000_000);
/// Maps that scenarios share.
const SHARED_MAPS: &[&str] = &["shared-0.xodr", "shared-1.xodr", "shared-2.xodr"];
/// Parts that maps include. They are not checked themselves.
const SHARED_PARTS: &[&str] = &["part-0.xml", "part-1.xml"];

/// Directory in which a copy tool keeps unfinished files.
pub const HIDDEN: &str = ".~tmp~";

/// A writer that has a file open and has written half of it.
#[derive(Debug)]
pub struct Writer {
    file: File,
    name: String,
    content: Content,
    begun: Duration,
    /// Time at which the rest is written.
    pub until: Instant,
}

fn mark(dice: &mut Dice) -> Mark {
    match dice.below(3) {
        0 => Mark::Marked,
        _ => Mark::Clean,
    }
}

impl Driver {
    /// Writes all shared files.
    pub fn write_shared(&mut self) {
        std::fs::create_dir_all(self.path(CATALOGS)).unwrap();
        for name in SHARED_PARTS.iter().chain(SHARED_MAPS).chain(&[CATALOG]) {
            self.write_one_shared(name);
        }
    }

    fn write_one_shared(&mut self, name: &str) {
        let number = self.dice.roll() >> 8;
        let content = match name {
            CATALOG if self.dice.below(4) == 0 => Content::OtherCatalog(number),
            CATALOG => Content::Catalog(number, mark(&mut self.dice)),
            _ if SHARED_PARTS.contains(&name) => Content::Part(number, mark(&mut self.dice)),
            _ => match self.dice.below(6) {
                0 => Content::Marked(number),
                1 => Content::Elsewhere(number),
                2 | 3 => Content::Including(number, SHARED_PARTS[0].to_owned()),
                _ => Content::Good(number),
            },
        };
        self.put(name, content, "share");
    }

    /// Changes a file that others depend on.
    pub fn share(&mut self) {
        let all = [SHARED_PARTS, SHARED_MAPS, &[CATALOG]].concat();
        if let Some(name) = self.dice.pick(&all).copied() {
            self.write_one_shared(name);
        }
    }

    /// Removes a file that others depend on. The catalog stays, because a scenario refers to the
    /// directory, which may be empty.
    pub fn unshare(&mut self) {
        let all = [SHARED_PARTS, SHARED_MAPS].concat();
        let Some(name) = self.dice.pick(&all).copied() else {
            return;
        };
        let begun = self.ledger.now();
        if std::fs::remove_file(self.path(name)).is_ok() {
            self.ledger.note(name, begun, None);
            self.files.remove(name);
            self.parts.remove(name);
            self.tally.note("unshare", name);
        }
    }

    /// Restores all missing files that others depend on.
    pub fn share_what_has_gone(&mut self) {
        for name in SHARED_PARTS.iter().chain(SHARED_MAPS) {
            if !self.path(name).exists() {
                self.write_one_shared(name);
            }
        }
    }

    /// Replaces a file or a link by a link to a file in an unwatched directory. Later writes to
    /// that path go through the link.
    pub fn link(&mut self) {
        let name = match self.any_file() {
            Some(name) if self.dice.below(2) == 0 => name,
            _ => self.new_name(),
        };
        let content = self.content_for(&name);
        self.next_file += 1;
        let store = self.farm.base().join("store");
        let target = store.join(format!("{}-{name}", self.next_file));
        std::fs::create_dir_all(&store).unwrap();
        std::fs::write(&target, content.bytes()).unwrap();
        self.age(&target);
        let unfinished = self.path(&format!("{name}.part"));
        std::os::unix::fs::symlink(&target, &unfinished).unwrap();
        let begun = self.ledger.now();
        std::fs::rename(&unfinished, self.path(&name)).unwrap();
        self.tally.note("link", &name);
        self.now_holds(&name, begun, content);
    }

    pub fn write_some(&mut self, count: usize) {
        for _ in 0..count {
            self.write_new();
        }
    }

    pub fn write(&mut self) {
        if self.files.len() < FILES {
            self.write_new();
        } else if let Some(name) = self.any_file() {
            let content = self.content_for(&name);
            self.put(&name, content, "write");
        }
    }

    fn write_new(&mut self) {
        let name = self.new_name();
        let content = self.content_for(&name);
        self.put(&name, content, "write");
    }

    /// Returns a possible content for a file of this name.
    fn content_for(&mut self, name: &str) -> Content {
        let number = self.dice.roll() >> 8;
        if name.ends_with(".xosc") {
            let map = self.dice.pick(SHARED_MAPS).unwrap();
            let scenario = Content::Scenario(number, (*map).to_owned());
            return match self.dice.below(6) {
                0 => scenario.torn(&mut self.dice),
                _ => scenario,
            };
        }
        match self.dice.below(8) {
            0 => Content::Marked(number),
            1 | 2 => {
                let part = self.dice.pick(SHARED_PARTS).unwrap();
                Content::Including(number, (*part).to_owned())
            }
            _ => Content::any(&mut self.dice),
        }
    }

    fn put(&mut self, name: &str, content: Content, kind: &'static str) {
        let begun = self.ledger.now();
        self.farm.write(name, &content.bytes());
        let path = self.path(name);
        self.age(&path);
        self.tally.note(kind, name);
        self.now_holds(name, begun, content);
    }

    /// Records a finished change of a file.
    fn now_holds(&mut self, name: &str, begun: Duration, content: Content) {
        self.ledger.note(name, begun, Some(&content));
        let files = match content {
            Content::Part(..) => &mut self.parts,
            _ => &mut self.files,
        };
        files.insert(name.to_owned(), content);
    }

    /// Sets an old modification time on one file in three, as a copy may do. There are only two
    /// such times, and one is before 1970.
    fn age(&mut self, path: &Path) {
        let time = match self.dice.below(6) {
            0 => UNIX_EPOCH - LONG_AGO,
            1 => UNIX_EPOCH + LONG_AGO,
            _ => return,
        };
        let file = File::options().write(true).open(path).unwrap();
        file.set_modified(time).unwrap();
    }

    /// Returns a new file name. One file in four is a scenario.
    fn new_name(&mut self) -> String {
        self.next_file += 1;
        let suffix = match self.dice.below(4) {
            0 => "xosc",
            _ => "xodr",
        };
        format!("{}.{suffix}", self.next_file)
    }

    /// Returns a file that no other file depends on.
    fn any_file(&mut self) -> Option<String> {
        let alone = |name: &&String| name.starts_with(|c: char| c.is_ascii_digit());
        let names: Vec<String> = self.files.keys().filter(alone).cloned().collect();
        self.dice.pick(&names).cloned()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.farm.root().join(name)
    }

    pub fn write_torn(&mut self) {
        let Some(name) = self.any_file() else { return };
        let content = self.content_for(&name);
        let bytes = content.bytes();
        let (first, second) = bytes.split_at(bytes.len() / 2);
        let begun = self.ledger.now();
        let mut file = File::create(self.path(&name)).unwrap();
        file.write_all(first).unwrap();
        let wait = self.dice.millis(400);
        pause(wait);
        file.write_all(second).unwrap();
        self.tally.note("write torn", &name);
        self.now_holds(&name, begun, content);
    }

    /// Writes half of a file. The rest follows seconds later.
    pub fn write_slowly(&mut self) {
        let name = self.new_name();
        let content = self.content_for(&name);
        let bytes = content.bytes();
        let begun = self.ledger.now();
        let mut file = File::create(self.path(&name)).unwrap();
        file.write_all(&bytes[..bytes.len() / 2]).unwrap();
        self.tally.note("write slowly", &name);
        self.writers.push(Writer {
            file,
            name,
            content,
            begun,
            until: Instant::now() + self.dice.millis(6000),
        });
    }

    /// Writes the rest for some writers. A half-written file is never checked, also by a broker
    /// that started in between.
    pub(super) fn end_writers(&mut self, is_over: impl Fn(&Writer) -> bool) {
        let (over, rest) = std::mem::take(&mut self.writers)
            .into_iter()
            .partition(is_over);
        self.writers = rest;
        let over: Vec<Writer> = over;
        for mut writer in over {
            let name = writer.name;
            let result = self.farm.out().join(format!("{name}.xqar"));
            assert!(
                !result.exists(),
                "{name} was judged before it was complete\n{}",
                self.tally.last_lines()
            );
            let bytes = writer.content.bytes();
            writer.file.write_all(&bytes[bytes.len() / 2..]).unwrap();
            drop(writer.file);
            self.tally.note("write the rest", &name);
            self.now_holds(&name, writer.begun, writer.content);
        }
    }

    /// Writes a file in the hidden directory of a copy tool, and may move it from there into place.
    pub fn hide(&mut self) {
        let name = self.new_name();
        let content = self.content_for(&name);
        let hidden = self.path(HIDDEN);
        std::fs::create_dir_all(&hidden).unwrap();
        let unfinished = hidden.join(&name);
        std::fs::write(&unfinished, content.bytes()).unwrap();
        self.tally.note("hide", &name);
        if self.files.len() < FILES && self.dice.below(2) == 0 {
            let wait = self.dice.millis(200);
            pause(wait);
            let begun = self.ledger.now();
            std::fs::rename(&unfinished, self.path(&name)).unwrap();
            self.tally.note("move from hidden", &name);
            self.now_holds(&name, begun, content);
        }
    }

    pub fn rename_into_place(&mut self) {
        let name = match self.any_file() {
            Some(name) if self.dice.below(2) == 0 => name,
            _ => self.new_name(),
        };
        let content = self.content_for(&name);
        let unfinished = self.path(&format!("{name}.part"));
        std::fs::write(&unfinished, content.bytes()).unwrap();
        self.age(&unfinished);
        let begun = self.ledger.now();
        std::fs::rename(&unfinished, self.path(&name)).unwrap();
        self.tally.note("rename into place", &name);
        self.now_holds(&name, begun, content);
    }

    pub fn move_file(&mut self) {
        let Some(from) = self.any_file() else { return };
        let to = match from.rsplit_once('.') {
            Some((_, suffix)) => format!("{}.{suffix}", self.next_file + 1),
            None => return,
        };
        self.next_file += 1;
        let begun = self.ledger.now();
        std::fs::rename(self.path(&from), self.path(&to)).unwrap();
        self.ledger.note(&from, begun, None);
        if let Some(content) = self.files.remove(&from) {
            self.now_holds(&to, begun, content);
        }
        self.tally.note("move", &format!("{from} {to}"));
    }

    pub fn truncate(&mut self) {
        let Some(name) = self.any_file() else { return };
        let Some(torn) = self
            .files
            .get(&name)
            .cloned()
            .map(|it| it.torn(&mut self.dice))
        else {
            return;
        };
        let begun = self.ledger.now();
        let mut options = std::fs::OpenOptions::new();
        let file = options.write(true).open(self.path(&name)).unwrap();
        file.set_len(u64::try_from(torn.bytes().len()).unwrap())
            .unwrap();
        self.tally.note("truncate", &name);
        self.now_holds(&name, begun, torn);
    }

    pub fn delete(&mut self) {
        let Some(name) = self.any_file() else { return };
        let begun = self.ledger.now();
        std::fs::remove_file(self.path(&name)).unwrap();
        self.ledger.note(&name, begun, None);
        self.files.remove(&name);
        self.tally.note("delete", &name);
    }

    pub fn rewrite(&mut self) {
        let Some(name) = self.any_file() else { return };
        for _ in 0..self.dice.below(6) + 2 {
            let content = self.content_for(&name);
            self.put(&name, content, "rewrite");
            let wait = self.dice.millis(30);
            pause(wait);
        }
    }
}
