//! Opens everything in shared memory for writing and overwrites it: images and messages that others
//! read. It also tries ways around a refusal: other permissions, and another name for an open file.

use std::fs::OpenOptions;
use std::os::unix::fs::{FileExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::complain;
use crate::harness::{Animal, GOOD, Manners, Mood, answer};

pub(super) const ANIMAL: Animal = Animal {
    name: "scribbles_on_others",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Bytes that overwrite the existing content.
const SCRIBBLE: [u8; 4096] = [0xA5; 4096];

fn job(peer: &mut Peer, job: &Job) -> Mood {
    let segments = segments(Path::new("/dev/shm"));
    let opened = segments.iter().filter(|it| scribble(it)).count();
    let again = segments_at_hand().iter().filter(|it| scribble(it)).count();
    complain(&format!(
        "it saw {}, opened {} for writing",
        segments.len(),
        opened + again
    ));
    answer(peer, job.job);
    Mood::GoOn
}

/// Returns the data segments that it has mapped for reading. Its broker and other processes of its
/// instance publish them. It leaves segments of other instances alone, because other tests run at
/// the same time.
fn segments(directory: &Path) -> Vec<PathBuf> {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let mapped = maps
        .lines()
        .filter_map(|line| line.split_whitespace().nth(5));
    let mut data: Vec<_> = mapped
        .map(PathBuf::from)
        .filter(|path| path.starts_with(directory) && is_data(path))
        .collect();
    data.sort();
    data.dedup();
    data
}

fn is_data(path: &Path) -> bool {
    path.extension().is_some_and(|it| it == "data")
}

/// Returns the segments that it has already opened, as paths of their descriptors.
fn segments_at_hand() -> Vec<PathBuf> {
    let open = std::fs::read_dir("/proc/self/fd")
        .into_iter()
        .flatten()
        .flatten();
    let is_segment = |path: &PathBuf| std::fs::read_link(path).is_ok_and(|it| is_data(&it));
    open.map(|entry| entry.path()).filter(is_segment).collect()
}

fn scribble(segment: &Path) -> bool {
    let _ = std::fs::set_permissions(segment, std::fs::Permissions::from_mode(0o666));
    let Ok(file) = OpenOptions::new().read(true).write(true).open(segment) else {
        return false;
    };
    // Large segments are mostly holes, which must not be filled.
    let len = file.metadata().map_or(0, |it| it.len()).min(8 << 20);
    for at in (0..len).step_by(SCRIBBLE.len()) {
        let mut there = SCRIBBLE;
        let is_written =
            file.read_at(&mut there, at).is_ok() && there.iter().any(|byte| *byte != 0);
        if is_written && file.write_at(&SCRIBBLE, at).is_err() {
            break;
        }
    }
    true
}
