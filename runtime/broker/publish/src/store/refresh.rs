//! Checks whether the inputs of a verdict are unchanged since they were read.

use qcbus_disk::foreign;
use qcbus_types::{Input, Reading, digest_of};
use qcbus_watch::stamp::stamp_through_links;

/// Checks whether inputs still have the bytes that were read. Returns `None` if one has changed.
/// Otherwise returns the inputs with their current stamps if a stamp differs.
pub(super) fn refreshed(inputs: &[Input]) -> Option<Option<Vec<Input>>> {
    let now: Vec<Input> = inputs.iter().map(as_it_is).collect::<Option<_>>()?;
    Some((now != *inputs).then_some(now))
}

/// Returns the input with its current stamp, if it still has the bytes that were read.
pub(super) fn as_it_is(input: &Input) -> Option<Input> {
    let now = stamp_through_links(&input.path);
    let Some((read, digest)) = input.content.read() else {
        return (now == input.content.stamp()).then(|| input.clone());
    };
    let now = now?;
    let same = now == read
        || (now.differs_in_ctime_only(&read)
            && foreign::read(&input.path, now.size).is_ok_and(|it| digest_of(&it) == digest));
    same.then(|| Input {
        path: input.path.clone(),
        content: Reading::Read(now, digest),
    })
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::Write as _;
    use std::path::Path;
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;

    /// Writes a file in place, so that it keeps its inode.
    fn rewrite(path: &Path, bytes: &[u8]) {
        let mut options = File::options();
        let mut file = options
            .create(true)
            .write(true)
            .truncate(false)
            .open(path)
            .unwrap();
        file.write_all(bytes).unwrap();
        // A time before 1970 is covered as well.
        file.set_modified(UNIX_EPOCH - Duration::from_secs(1))
            .unwrap();
    }

    #[test]
    fn input_is_refreshed_only_if_bytes_are_unchanged() {
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

        // Another link gives the same bytes a new stamp.
        let link = dir.path().join("link");
        let linked = std::iter::repeat_with(|| {
            let _ = std::fs::remove_file(&link);
            std::fs::hard_link(&path, &link).unwrap();
            stamp().unwrap()
        });
        let linked = { linked }.find(|it| *it != read).unwrap();
        let now = as_it_is(&input).unwrap();
        assert_eq!(now.content, Reading::Read(linked, digest_of(b"one")));

        // Other bytes of the same size get the old modification time.
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
