//! Actions of operators other than writing files: they copy and move states, and remove results.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::fs::{CWD, RenameFlags, renameat_with};

use super::driver::Driver;
use crate::support::cli::files_below;
use crate::support::farm::Farm;
use crate::support::programs::copy_program;

impl Driver {
    /// Removes a result, a verdict file or a published file.
    pub fn lose_output(&mut self) {
        let is_output = |name: &str| name.ends_with(".xqar") || name.ends_with(".verdict.json");
        let (out, gate) = (self.farm.out(), self.farm.gate());
        let results = files_below(&out).into_iter();
        let results = results.filter(|it| is_output(&it.to_string_lossy()));
        let results = results.map(|it| out.join(it));
        let hidden = |path: &Path| {
            let name = path.file_name().unwrap_or_default();
            name.as_encoded_bytes().starts_with(b".")
        };
        let published = files_below(&gate).into_iter().filter(|it| !hidden(it));
        let all: Vec<_> = results.chain(published.map(|it| gate.join(it))).collect();
        let Some(output) = self.dice.pick(&all) else {
            return;
        };
        // The broker may already have removed it.
        if std::fs::remove_file(output).is_ok() {
            let name = output.file_name().unwrap_or_default();
            self.tally.note("lose output", &name.to_string_lossy());
        }
    }

    /// Returns the program that brokers are started from, as it was installed.
    pub(super) fn installed(&mut self) -> PathBuf {
        let program = self.farm.base().join("qcbus");
        if std::mem::take(&mut self.is_replaced) {
            let newer = self.farm.base().join("newer");
            copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), &newer);
            std::fs::rename(newer, &program).unwrap();
        }
        program
    }

    /// Replaces the program on disk by a useless one. A broker must still start its children from
    /// its own program.
    pub fn replace_program(&mut self) {
        if self.broker.is_none() {
            return;
        }
        let newer = self.farm.base().join("newer");
        std::fs::write(&newer, "#!/bin/sh\necho another program >&2\nexit 1\n").unwrap();
        std::fs::set_permissions(&newer, std::fs::Permissions::from_mode(0o755)).unwrap();
        std::fs::rename(newer, self.farm.base().join("qcbus")).unwrap();
        self.is_replaced = true;
        self.tally.note("replace the program", "");
    }

    /// Copies or moves the results with their state while no broker runs.
    pub(super) fn handle_state(&mut self) {
        match self.dice.below(6) {
            0 if !self.is_full() => self.serve_copy(),
            1 => self.move_state(),
            _ => {}
        }
    }

    /// Starts a broker on a copy, as in a staging environment. It must remove nothing from the
    /// original, because the judge looks for it at the end.
    fn serve_copy(&mut self) {
        let copy = Farm::new();
        copy_tree(&self.farm.out(), &copy.out());
        let before = files_below(&self.farm.out());
        let mut broker = copy.serve_ready();
        assert_eq!(copy.qcbus(&["down"]).status.code(), Some(0));
        assert!(broker.wait().success());
        // Bundles and reporters of the killed broker may still be writing.
        let after = files_below(&self.farm.out());
        let is_output = |name: &&Path| {
            let name = name.to_string_lossy();
            name.ends_with(".xqar") || name.ends_with(".verdict.json")
        };
        let lost = before.iter().filter(|it| !after.contains(it));
        let lost: Vec<&Path> = lost.map(|it| it.as_path()).filter(is_output).collect();
        assert!(
            lost.is_empty(),
            "the copy must not remove {lost:?}\n{}",
            copy.log()
        );
        self.tally.note("serve a copy", "");
    }

    /// Gives the results and the state new inodes, as after restoring a backup.
    fn move_state(&mut self) {
        let (out, base) = (self.farm.out(), self.farm.base());
        let copy = base.join("copy");
        copy_tree(&out, &copy);
        // The exchange is one step. Otherwise the watchers could find no results, and later take
        // all of them for new ones.
        renameat_with(CWD, &copy, CWD, &out, RenameFlags::EXCHANGE).unwrap();
        std::fs::remove_dir_all(&copy).unwrap();
        self.tally.note("move the state", "");
    }
}

fn copy_tree(from: &Path, to: &Path) {
    if to.exists() {
        std::fs::remove_dir_all(to).unwrap();
    }
    // Processes that outlive the broker may remove half-written files during the copy. The rest is
    // copied.
    let copied = Command::new("cp").arg("-a").arg(from).arg(to).output();
    let copied = copied.unwrap();
    let said = String::from_utf8_lossy(&copied.stderr).into_owned();
    let has_gone = |line: &str| line.ends_with("No such file or directory");
    assert!(
        copied.status.success() || said.lines().all(has_gone),
        "{said}"
    );
}
