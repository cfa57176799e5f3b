//! Files written by a report module.

use std::path::{Path, PathBuf};

use qcbus_disk::foreign;

/// Maximum number of files of one run.
const MOST_FILES: usize = 1000;
/// Maximum depth of nested directories.
const DEEPEST: usize = 8;

/// Names of files with their lengths, and the concatenated bytes of all files.
pub(crate) type Written = (Vec<(String, u64)>, Vec<u8>);

/// Reads all regular files below a directory, sorted by name. Links and other entries are ignored.
///
/// # Errors
/// As text for the user: if a limit is exceeded or a file cannot be read.
pub(crate) fn in_directory(directory: &Path, most: u64) -> Result<Written, String> {
    let mut paths = Vec::new();
    walk(directory, 0, &mut paths)?;
    paths.sort();
    let (mut names, mut bytes) = (Vec::new(), Vec::new());
    for path in paths {
        let inside = path.strip_prefix(directory).ok().and_then(Path::to_str);
        let Some(name) = inside else {
            return Err("it wrote a file whose name is not UTF-8".to_owned());
        };
        let left = most.saturating_sub(bytes.len() as u64);
        let read = foreign::read(&path, left)
            .map_err(|error| format!("the files that it wrote cannot be read: {name}: {error}"))?;
        names.push((name.to_owned(), read.len() as u64));
        bytes.extend_from_slice(&read);
    }
    Ok((names, bytes))
}

fn walk(directory: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), String> {
    let unread = |error: std::io::Error| format!("the files that it wrote cannot be read: {error}");
    if depth > DEEPEST {
        return Err(format!(
            "it wrote files more than {DEEPEST} directories deep"
        ));
    }
    for entry in std::fs::read_dir(directory).map_err(unread)? {
        let entry = entry.map_err(unread)?;
        let kind = entry.file_type().map_err(unread)?;
        if kind.is_dir() {
            walk(&entry.path(), depth + 1, found)?;
        } else if kind.is_file() {
            if found.len() >= MOST_FILES {
                return Err(format!("it wrote more than {MOST_FILES} files"));
            }
            found.push(entry.path());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_files_are_read_in_name_order_without_links() {
        let dir = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        put("b/c.txt", "cc");
        put("a.txt", "a");
        std::os::unix::fs::symlink("/etc/passwd", dir.path().join("link")).unwrap();
        let (names, bytes) = in_directory(dir.path(), 100).unwrap();
        let expected = [("a.txt".to_owned(), 1), ("b/c.txt".to_owned(), 2)];
        assert_eq!((&names[..], &bytes[..]), (&expected[..], &b"acc"[..]));
        assert!(
            in_directory(dir.path(), 2).is_err(),
            "longer than the limit"
        );
    }
}
