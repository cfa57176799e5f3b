//! Files that may still be written to: the time of their scan, and their reports until then.

use std::path::Path;
use std::time::Instant;

use qcbus_environment::now;
use qcbus_types::Stamp;

use super::Seen;
use super::open_files::OpenFiles;
use super::scanner::Scanner;
use super::settle::Looked;
use crate::stamp::{is_younger, stamp_of};

impl Scanner {
    /// Reports files that have settled, and files that take longer.
    pub(super) fn look_at_what_may_have_settled(&mut self, now: Instant) {
        let stamp = |path: &Path| stamp_of(path).ok().flatten();
        // Open files are searched once for all due files.
        let (roots, mut open) = (&self.options.roots, None);
        let is_open = |path: &Path| {
            let open = open.get_or_insert_with(|| OpenFiles::look(roots));
            open.contains(path)
        };
        let Looked { settled, waiting } = self.settling.look(now, stamp, is_open);
        for path in settled {
            self.look(&path);
        }
        for (path, stamp, why) in waiting {
            self.is_there(&path);
            (self.tell)(Seen::Unfinished(path.into(), stamp, why));
        }
    }

    /// Reports a file, immediately or when it has settled.
    pub(super) fn look_if_at_rest(&mut self, path: &Path) {
        // The file may have been closed by now.
        self.take_events();
        let stamp = stamp_of(path).ok().flatten();
        let stamp = stamp.filter(|it| self.known.get(path) != Some(it) && self.cares_about(path));
        if let Some(stamp) = stamp.filter(|it| self.may_be_under_way(path, *it)) {
            self.settling.seen(path, stamp, now());
        }
        if self.settling.is_pending(path) {
            self.is_there(path);
        } else {
            self.look(path);
        }
    }

    /// Reports that an unsettled file exists. Otherwise its stored result would be withdrawn after
    /// the first full scan. If the file is removed before it has settled, this is reported, too.
    pub(super) fn is_there(&mut self, path: &Path) {
        if !self.known.contains_key(path) {
            (self.tell)(Seen::Present(path.into()));
            self.known.insert(path.into(), Stamp::default());
        }
    }

    fn may_be_under_way(&self, path: &Path, stamp: Stamp) -> bool {
        is_younger(stamp, self.settling.rest())
            || (is_younger(stamp, self.settling.open_rest())
                && OpenFiles::look(&self.options.roots).contains(path))
    }

    /// Checks whether a file was open for writing at the start. Earlier writes cause no event.
    pub(super) fn was_open(&mut self, path: &Path, stamp: Stamp) -> bool {
        if !is_younger(stamp, self.settling.open_rest()) {
            return false;
        }
        let roots = &self.options.roots;
        let open = self
            .open_at_start
            .get_or_insert_with(|| OpenFiles::look(roots));
        open.contains(path)
    }
}
