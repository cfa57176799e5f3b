//! Conversion of file paths to URIs.

use std::os::unix::ffi::OsStrExt as _;
use std::path::{Component, Path, PathBuf};

use qcbus_messages::ResultMessage;
use qcbus_messages::path_text::from_text;

use crate::log::{ArtifactLocation, ROOT};

/// Base directories for the relative paths of a result.
pub(crate) struct Paths {
    input: PathBuf,
    display: PathBuf,
    /// Directory that precedes the display path.
    root: Option<PathBuf>,
}

impl Paths {
    pub(crate) fn of(result: &ResultMessage) -> Paths {
        // The result file of another tool may lack the path of the checked file.
        let input = match result.input.as_str() {
            "" => from_text(&result.xqar),
            input => from_text(input),
        };
        let display = from_text(&result.display_path);
        let root = root(&input, &display);
        Paths {
            input,
            display,
            root,
        }
    }

    /// Returns the location of the checked file. If its display path leaves the directory, the
    /// absolute path is used. Hosts interpret a relative path from the root of the repository.
    pub(crate) fn checked(&self) -> ArtifactLocation {
        if stays_inside(&self.display) {
            relative(&self.display)
        } else {
            absolute(&self.input)
        }
    }

    /// Returns the location of another file, relative if it is below the checked file's base.
    pub(crate) fn other(&self, path: &str) -> ArtifactLocation {
        let path = from_text(path);
        let root = self.root.as_ref();
        let below = root.and_then(|root| path.strip_prefix(root).ok());
        match below {
            Some(below) if stays_inside(below) => relative(below),
            _ if path.is_absolute() => absolute(&path),
            _ => relative(&path),
        }
    }
}

fn root(input: &Path, display: &Path) -> Option<PathBuf> {
    if !stays_inside(display) || !input.ends_with(display) {
        return None;
    }
    let levels = display.components().count();
    input.ancestors().nth(levels).map(Path::to_owned)
}

fn stays_inside(path: &Path) -> bool {
    let is_name = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    path.components().all(is_name) && path.components().next().is_some()
}

fn relative(path: &Path) -> ArtifactLocation {
    let parts = path.components().filter(|part| *part != Component::CurDir);
    let clean: PathBuf = parts.collect();
    ArtifactLocation {
        uri: encoded(&clean),
        uri_base_id: Some(ROOT.to_owned()),
        index: None,
    }
}

fn absolute(path: &Path) -> ArtifactLocation {
    ArtifactLocation {
        uri: format!("file://{}", encoded(path)),
        uri_base_id: None,
        index: None,
    }
}

/// Encodes the bytes of a path. Only unreserved characters (RFC 3986, 2.3) and slashes stay. A
/// colon in the first name would otherwise end a scheme.
fn encoded(path: &Path) -> String {
    let mut uri = String::new();
    for &byte in path.as_os_str().as_bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(input: &str, display: &str) -> Paths {
        let (input, display) = (from_text(input), from_text(display));
        let root = root(&input, &display);
        Paths {
            input,
            display,
            root,
        }
    }

    fn uri(location: ArtifactLocation) -> (String, bool) {
        (location.uri, location.uri_base_id.is_some())
    }

    #[test]
    fn path_below_root_is_relative() {
        let paths = paths("/farm/maps/a b.xodr", "maps/a b.xodr");
        assert_eq!(uri(paths.checked()), ("maps/a%20b.xodr".into(), true));
        let other = |path| uri(paths.other(path));
        assert_eq!(other("/farm/lib/ü.xodr"), ("lib/%C3%BC.xodr".into(), true));
        assert_eq!(
            other("/farms/b.xodr"),
            ("file:///farms/b.xodr".into(), false)
        );
        assert_eq!(other("/farm/../b"), ("file:///farm/../b".into(), false));
        assert_eq!(
            other("c:d#e?f%.xodr"),
            ("c%3Ad%23e%3Ff%25.xodr".into(), true)
        );
    }

    #[test]
    fn path_outside_root_is_absolute() {
        let absolute = paths("/farm/a.xodr", "/farm/a.xodr");
        assert_eq!(
            uri(absolute.checked()),
            ("file:///farm/a.xodr".into(), false)
        );
        let climbing = paths("/farm/a.xodr", "../farm/a.xodr");
        assert_eq!(
            uri(climbing.checked()),
            ("file:///farm/a.xodr".into(), false)
        );
        let odd = paths("bytes:/farm/%FF.xodr", "bytes:%FF.xodr");
        assert_eq!(uri(odd.checked()), ("%FF.xodr".into(), true));
        assert_eq!(
            uri(paths("/a.xqar", "").checked()),
            ("file:///a.xqar".into(), false)
        );
    }
}
