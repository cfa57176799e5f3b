//! Is what a verdict rests on still what was read?

use std::sync::Arc;

use qcbus_messages::Digest;

use crate::core::{FinishedJob, Input, Reading};
use crate::stamp::stamp_through_links;

/// Whether everything that the verdict depends on is what it was when it was read. Stamps that
/// moved although the bytes are the same (another link to the file, other rights) are taken over.
pub(super) fn refresh(job: &mut FinishedJob) -> bool {
    let Some(prepared) = &mut job.prepared else {
        return true;
    };
    let inputs = &prepared.inputs;
    let now: Option<Vec<Input>> = inputs.iter().map(as_it_is).collect();
    let Some(now) = now else {
        return false;
    };
    if now != *inputs {
        let prepared = Arc::make_mut(prepared);
        prepared.inputs = now;
        // They moved a moment ago, and may move again without telling.
        prepared.racy = true;
    }
    true
}

/// The input with its present stamp, if it still has the bytes that were read.
pub(super) fn as_it_is(input: &Input) -> Option<Input> {
    let now = stamp_through_links(&input.path);
    let Some((read, digest)) = input.content.read() else {
        return (now == input.content.stamp()).then(|| input.clone());
    };
    let now = now?;
    let same = now == read
        || (now.differs_in_ctime_only(&read)
            && std::fs::read(&input.path).is_ok_and(|bytes| digest_of(&bytes) == digest));
    same.then(|| Input {
        path: input.path.clone(),
        content: Reading::Read(now, digest),
    })
}

pub fn digest_of(bytes: &[u8]) -> Digest {
    use sha2::{Digest as _, Sha256};
    Digest(Sha256::digest(bytes).into())
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;
    use crate::stamp::tests::put;

    fn rewrite(path: &Path, bytes: &[u8]) {
        // Before 1970, for good measure.
        put(path, bytes, UNIX_EPOCH - Duration::from_secs(1));
    }

    #[test]
    fn what_was_read_is_told_from_what_is_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodr");
        rewrite(&path, b"one");
        let stamp = || stamp_through_links(&path);
        let read = stamp().unwrap();
        let input = Input {
            path: path.as_path().into(),
            content: Reading::Read(read, digest_of(b"one")),
        };
        assert_eq!(as_it_is(&input), Some(input.clone()));

        // Another link: the same bytes under a new stamp.
        let link = dir.path().join("link");
        let linked = std::iter::repeat_with(|| {
            let _ = std::fs::remove_file(&link);
            std::fs::hard_link(&path, &link).unwrap();
            stamp().unwrap()
        });
        let linked = { linked }.find(|it| *it != read).unwrap();
        let now = as_it_is(&input).unwrap();
        assert_eq!(now.content, Reading::Read(linked, digest_of(b"one")));

        // Other bytes of the same size, with the time put back.
        rewrite(&path, b"two");
        assert_eq!(stamp().map(|it| it.mtime_ns), Some(read.mtime_ns));
        assert_eq!(as_it_is(&input), None);

        std::fs::remove_file(&path).unwrap();
        assert_eq!(as_it_is(&input), None);
        let absent = Input {
            content: Reading::Absent,
            ..input
        };
        assert_eq!(as_it_is(&absent), Some(absent.clone()));
        rewrite(&path, b"two");
        assert_eq!(as_it_is(&absent), None);
    }
}
