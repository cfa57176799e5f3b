//! What the driver does to files.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, UNIX_EPOCH};

use super::driver::Driver;
use crate::support::content::{CATALOG, CATALOGS, Content, Mark};
use crate::support::dice::Dice;
use crate::support::watchdog::pause;

/// Files that there are about.
const FILES: usize = 80;
/// Before and after 1970: times that some files say they are from.
const LONG_AGO: Duration = Duration::from_secs(1_000_000);
/// Maps that scenarios share.
const SHARED_MAPS: &[&str] = &["shared-0.xodr", "shared-1.xodr", "shared-2.xodr"];
/// What maps include. No files to check.
const SHARED_PARTS: &[&str] = &["part-0.xml", "part-1.xml"];

/// Where a copy tool keeps what it has not finished.
pub const HIDDEN: &str = ".~tmp~";

/// Somebody who has a file open and has written half of it.
#[derive(Debug)]
pub struct Writer {
    file: File,
    name: String,
    content: Content,
    begun: Duration,
    /// When the rest comes.
    pub until: Instant,
}

fn mark(dice: &mut Dice) -> Mark {
    match dice.below(3) {
        0 => Mark::Marked,
        _ => Mark::Clean,
    }
}

impl Driver {
    /// Everything that files share.
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

    /// Something that others depend on becomes another.
    pub fn share(&mut self) {
        let all = [SHARED_PARTS, SHARED_MAPS, &[CATALOG]].concat();
        if let Some(name) = self.dice.pick(&all).copied() {
            self.write_one_shared(name);
        }
    }

    /// Something that others depend on goes. Not the catalog: a scenario names the directory, which
    /// may be empty.
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

    /// Whatever others depend on is there again.
    pub fn share_what_has_gone(&mut self) {
        for name in SHARED_PARTS.iter().chain(SHARED_MAPS) {
            if !self.path(name).exists() {
                self.write_one_shared(name);
            }
        }
    }

    /// A link to a file in a directory that nobody watches takes the place of a file, or of a link.
    /// What is written to that place from then on goes through the link.
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

    /// Something that a file of this name may contain.
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

    /// A change of a file is over.
    fn now_holds(&mut self, name: &str, begun: Duration, content: Content) {
        self.ledger.note(name, begun, Some(&content));
        let files = match content {
            Content::Part(..) => &mut self.parts,
            _ => &mut self.files,
        };
        files.insert(name.to_owned(), content);
    }

    /// One file in three says that it was last written to long ago, as a copy may; all these say the
    /// same, some that it was before 1970.
    fn age(&mut self, path: &Path) {
        let time = match self.dice.below(6) {
            0 => UNIX_EPOCH - LONG_AGO,
            1 => UNIX_EPOCH + LONG_AGO,
            _ => return,
        };
        let file = File::options().write(true).open(path).unwrap();
        file.set_modified(time).unwrap();
    }

    /// One file in four is a scenario.
    fn new_name(&mut self) -> String {
        self.next_file += 1;
        let suffix = match self.dice.below(4) {
            0 => "xosc",
            _ => "xodr",
        };
        format!("{}.{suffix}", self.next_file)
    }

    /// A file that no other depends on.
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

    /// Somebody writes half of a file, and the rest seconds later.
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

    /// Some of them write the rest. Half of a file is never judged, also by a broker that began meanwhile.
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
                "{name} was judged before it was whole\n{}",
                self.tally.last_lines()
            );
            let bytes = writer.content.bytes();
            writer.file.write_all(&bytes[bytes.len() / 2..]).unwrap();
            drop(writer.file);
            self.tally.note("write the rest", &name);
            self.now_holds(&name, writer.begun, writer.content);
        }
    }

    /// A copy tool writes in a directory of its own, and may move the file from there into place.
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
