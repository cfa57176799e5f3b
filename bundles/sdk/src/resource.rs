//! Files of a user for a rule, such as schemas. The host reads them before any check, so that rules
//! do no I/O.

use std::any::Any;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_ingest::{Limits, Prepared, prepare_bytes};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Catalogue, Digest};

use crate::{Bundle, Param};

/// Additional input of a rule from a directory that the user names.
#[derive(Debug)]
pub struct Resource {
    /// The parameter with the path of the directory. If it is empty, nothing is read. A rule that
    /// declares the resource must declare the parameter, too.
    pub param: Param,
    /// File name extensions of the files to read, in lower case.
    pub endings: &'static [&'static str],
    /// Builds the value that rules get by [`crate::Subject::resource`] from the files. Does no I/O;
    /// the text of an error follows "failed to ".
    pub make: fn(&[ResourceFile]) -> Result<ResourceValue, String>,
}

/// Value built from a user's files.
pub type ResourceValue = Arc<dyn Any + Send + Sync>;

/// One file that was read.
pub struct ResourceFile {
    path: PathBuf,
    below: usize,
    bytes: Vec<u8>,
    prepared: Prepared,
}

/// Reasons why a user's files cannot be used; the text follows "failed to ".
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ResourceError {
    /// A directory or file that cannot be read.
    #[error("read {path}: {why}")]
    Unreadable {
        /// Path of the directory or file.
        path: String,
        /// Error message of the system.
        why: String,
    },
    /// No usable file was found.
    #[error("find a file ending in {endings} in {path}")]
    Nothing {
        /// Path of the search.
        path: String,
        /// Extensions that were searched.
        endings: String,
    },
    /// More files or deeper directories than expected.
    #[error(
        "read {path}: it has more than {most} files, or directories nested deeper than {deepest}; check that it \
         is the right directory"
    )]
    TooMuch {
        /// The directory.
        path: String,
        /// Maximum number of files and directories.
        most: usize,
        /// Maximum nesting depth.
        deepest: usize,
    },
    /// No rule of the bundle takes files.
    #[error("pass files to {0}: none of its rules accepts any")]
    NotTaken(&'static str),
    /// The files were read but cannot be used.
    #[error("{0}")]
    Unusable(String),
}

/// Maximum number of files and directories below the named one.
const MOST: usize = 1_000;
const DEEPEST: usize = 8;

impl ResourceFile {
    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns its path relative to the directory that the user named.
    pub fn below(&self) -> PathBuf {
        self.path.components().skip(self.below).collect()
    }

    /// Checks whether its name has this extension, ignoring case.
    pub fn ends_in(&self, ending: &str) -> bool {
        has_ending(&self.path, &[ending])
    }

    /// Returns its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the SHA-256 of its bytes.
    pub fn digest(&self) -> Digest {
        Digest(self.prepared.digest())
    }

    /// Returns its image, if it is XML.
    pub fn image(&self) -> Vec<u8> {
        self.prepared.build()
    }
}

impl Resource {
    /// Reads a directory (or one file) and builds the value for rules.
    ///
    /// # Errors
    /// [`ResourceError`] if a file cannot be read or used: no file is skipped silently.
    pub fn read(&self, path: &Path) -> Result<ResourceValue, ResourceError> {
        let files = self.files(path)?;
        (self.make)(&files).map_err(ResourceError::Unusable)
    }

    /// Returns the sorted list of files to read. A path that is not a directory counts as a file.
    pub(crate) fn listing(&self, path: &Path) -> Result<Vec<PathBuf>, ResourceError> {
        let mut found = Vec::new();
        if path.is_dir() {
            let mut budget = MOST;
            collect(path, self.endings, (DEEPEST, &mut budget), &mut found)
                .map_err(|error| error.of(path))?;
        } else {
            found.push(path.to_owned());
        }
        found.sort();
        Ok(found)
    }

    fn files(&self, path: &Path) -> Result<Vec<ResourceFile>, ResourceError> {
        let found = self.listing(path)?;
        if found.is_empty() {
            let endings: Vec<String> = self.endings.iter().map(|end| format!(".{end}")).collect();
            return Err(ResourceError::Nothing {
                path: to_text(path),
                endings: endings.join(" or "),
            });
        }
        let whole = path.components().count();
        let below = if path.is_dir() {
            whole
        } else {
            whole.saturating_sub(1)
        };
        found
            .into_iter()
            .map(|file| read_file(file, below))
            .collect()
    }
}

/// Files that a user names on the command line (`--schema-dir DIR`). They are read once, when the
/// bundle starts.
#[derive(Clone)]
pub struct UserFiles {
    directory: PathBuf,
    fingerprint: String,
    values: Vec<(&'static Resource, ResourceValue)>,
}

impl UserFiles {
    /// Reads a directory for every rule of the bundle that takes such files.
    ///
    /// # Errors
    /// [`ResourceError`] if the files cannot be used, or no rule takes any.
    pub fn read(bundle: &Bundle, directory: &Path) -> Result<UserFiles, ResourceError> {
        let directory = std::path::absolute(directory).unwrap_or_else(|_| directory.to_owned());
        let mut read = UserFiles {
            fingerprint: String::new(),
            values: Vec::new(),
            directory,
        };
        for resource in resources(bundle) {
            let files = resource.files(&read.directory)?;
            read.fingerprint = fingerprint(&files);
            let value = (resource.make)(&files).map_err(ResourceError::Unusable)?;
            read.values.push((resource, value));
        }
        if read.values.is_empty() {
            return Err(ResourceError::NotTaken(bundle.name));
        }
        Ok(read)
    }

    pub(crate) fn of(&self, resource: &Resource) -> Option<ResourceValue> {
        let found = self
            .values
            .iter()
            .find(|(known, _)| std::ptr::eq(*known, resource));
        found.map(|(_, value)| value.clone())
    }

    /// Returns the directory as text for results and plans.
    pub(crate) fn directory(&self) -> String {
        to_text(&self.directory)
    }

    /// Writes the directory and the digest of its files into the catalogue as new defaults. A
    /// changed digest makes a broker check files again.
    pub(crate) fn tell(&self, catalogue: &mut Catalogue) {
        let names: Vec<&str> = self
            .values
            .iter()
            .map(|(known, _)| known.param.name)
            .collect();
        let params = catalogue
            .checkers
            .iter_mut()
            .flat_map(|checker| &mut checker.params);
        for param in params.filter(|param| names.contains(&param.name.as_str())) {
            param.default = format!("{} (sha256 {})", self.directory(), self.fingerprint);
        }
    }
}

/// Returns the resources of a bundle's rules, each once.
pub(crate) fn resources(bundle: &Bundle) -> Vec<&'static Resource> {
    let mut all: Vec<&'static Resource> = Vec::new();
    for resource in bundle.rules.iter().filter_map(|rule| rule.facts().resource) {
        if !all.iter().any(|known| std::ptr::eq(*known, resource)) {
            all.push(resource);
        }
    }
    all
}

enum ListingError {
    Io(PathBuf, std::io::Error),
    TooMuch,
}

impl ListingError {
    fn of(self, directory: &Path) -> ResourceError {
        match self {
            ListingError::Io(path, error) => unreadable(&path, &error),
            ListingError::TooMuch => ResourceError::TooMuch {
                path: to_text(directory),
                most: MOST,
                deepest: DEEPEST,
            },
        }
    }
}

fn collect(
    directory: &Path,
    endings: &[&str],
    (depth, budget): (usize, &mut usize),
    found: &mut Vec<PathBuf>,
) -> Result<(), ListingError> {
    let io = |error| ListingError::Io(directory.to_owned(), error);
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        *budget = budget.checked_sub(1).ok_or(ListingError::TooMuch)?;
        if path.is_dir() {
            let depth = depth.checked_sub(1).ok_or(ListingError::TooMuch)?;
            collect(&path, endings, (depth, budget), found)?;
        } else if has_ending(&path, endings) {
            found.push(path);
        }
    }
    Ok(())
}

fn read_file(path: PathBuf, below: usize) -> Result<ResourceFile, ResourceError> {
    let limits = Limits::default();
    let read = || {
        let size = std::fs::metadata(&path)?.len();
        if size > limits.max_file {
            return Err(std::io::Error::from(std::io::ErrorKind::FileTooLarge));
        }
        std::fs::read(&path)
    };
    let bytes = read().map_err(|error| unreadable(&path, &error))?;
    let prepared = prepare_bytes(&path, bytes.clone(), &limits);
    Ok(ResourceFile {
        path,
        below,
        bytes,
        prepared,
    })
}

/// Returns a digest of the files: their names below the directory and their contents.
fn fingerprint(files: &[ResourceFile]) -> String {
    let lines = files
        .iter()
        .map(|file| format!("{} {}\n", file.digest(), file.below().display()));
    let all = lines.collect::<String>().into_bytes();
    Digest(prepare_bytes(Path::new(""), all, &Limits::default()).digest()).to_string()
}

fn unreadable(path: &Path, error: &std::io::Error) -> ResourceError {
    ResourceError::Unreadable {
        path: to_text(path),
        why: error.to_string(),
    }
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|have| {
        endings
            .iter()
            .any(|ending| have.eq_ignore_ascii_case(ending))
    })
}
