//! Errors on the way to a published image, and their effect on the root.

use std::path::Path;

use qcbus_bus::LoanError;
use qcbus_ingest::{BuildError, IngestError, Prepared};
use qcbus_messages::Absence;
use qcbus_messages::path_text::to_text;
use qcbus_types::PrepareFailure;
use qcbus_watch::stamp::stamp_of;

/// Reason why a file is not on the bus.
#[derive(Debug)]
pub(super) enum Failure {
    /// The file could not be read.
    Ingest(IngestError),
    /// No image could be built from the file.
    Build(String),
    /// The image exists, but the bus did not accept it.
    Publish(String),
    /// The bus has no room for the image.
    Loan(LoanError),
}

impl Failure {
    /// Returns the effect of the failure on a file that a root refers to. Either the file is
    /// absent, or the whole job must be tried again.
    pub fn of_linked(self, path: &Path) -> Result<Absence, PrepareFailure> {
        match self {
            Failure::Loan(LoanError::TooLarge(_)) => Ok(Absence::TooLarge {
                why: "it is too large for the bus".to_owned(),
            }),
            Failure::Loan(LoanError::Busy) => Err(PrepareFailure::Busy),
            Failure::Loan(
                error @ (LoanError::NeverFits { .. } | LoanError::AddressSpace { .. }),
            ) => Ok(Absence::TooLarge {
                why: error.to_string(),
            }),
            Failure::Loan(error) => Err(unpublished(path, &error)),
            Failure::Publish(error) => Err(unpublished(path, &error)),
            // The file is being written right now. The whole job is read again shortly.
            Failure::Ingest(error @ IngestError::Unsettled { .. }) => {
                Err(PrepareFailure::NoRoom(error.to_string()))
            }
            Failure::Ingest(error) => Ok(error.to_absence()),
            Failure::Build(why) => Ok(Absence::Unreadable { why }),
        }
    }
}

impl From<IngestError> for Failure {
    fn from(error: IngestError) -> Self {
        Failure::Ingest(error)
    }
}

impl From<LoanError> for Failure {
    fn from(error: LoanError) -> Self {
        Failure::Loan(error)
    }
}

/// Returns the effect of the failure on the root.
pub(super) fn explained(failure: Failure, path: &Path) -> PrepareFailure {
    match failure {
        Failure::Ingest(IngestError::Missing { .. } | IngestError::Unsettled { .. }) => {
            match stamp_of(path) {
                Ok(None) => PrepareFailure::Vanished,
                // The file is being written right now. It is read again shortly.
                _ => PrepareFailure::NoRoom(format!(
                    "{} changed while it was being read",
                    to_text(path)
                )),
            }
        }
        Failure::Ingest(error) => unreadable(path, error.to_string()),
        Failure::Build(error) => unreadable(path, error),
        Failure::Loan(LoanError::TooLarge(_)) => {
            unreadable(path, format!("{} is too large for the bus", to_text(path)))
        }
        Failure::Loan(LoanError::Busy) => PrepareFailure::Busy,
        // Waiting does not help until the shared memory is enlarged. The file is tried again like an unreadable file.
        Failure::Loan(error @ (LoanError::NeverFits { .. } | LoanError::AddressSpace { .. })) => {
            unreadable(path, format!("cannot publish {}: {error}", to_text(path)))
        }
        Failure::Loan(error) => unpublished(path, &error),
        Failure::Publish(error) => unpublished(path, &error),
    }
}

/// Returns a temporary failure: the bus has no room or could not accept the image. The file is not the cause.
fn unpublished(path: &Path, error: &dyn std::fmt::Display) -> PrepareFailure {
    PrepareFailure::NoRoom(format!("cannot publish {}: {error}", to_text(path)))
}

fn unreadable(path: &Path, reason: String) -> PrepareFailure {
    match stamp_of(path) {
        Ok(None) => PrepareFailure::Vanished,
        // A file without a readable stamp may exist.
        _ => PrepareFailure::Unreadable(reason),
    }
}

/// Returns the exact size of an image if it may make a difference for this error.
pub(super) fn exact(prepared: &Prepared, error: &LoanError) -> Option<usize> {
    if !matches!(
        error,
        LoanError::NoSpace { .. } | LoanError::NeverFits { .. }
    ) {
        return None;
    }
    match prepared.build_into(&mut []) {
        Err(BuildError::SmallBuffer { needed, .. }) => Some(needed),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failure_of_linked_file_never_removes_the_root() {
        let path = Path::new("/farm/map.xodr");
        let of = |failure: Failure| failure.of_linked(path);
        let unsettled = IngestError::Unsettled {
            path: path.to_owned(),
            what: "was removed",
        };
        let again = of(unsettled.into());
        assert!(matches!(again, Err(PrepareFailure::NoRoom(_))), "{again:?}");
        let missing = IngestError::Missing {
            path: path.to_owned(),
        };
        assert_eq!(of(missing.into()), Ok(Absence::NotThere));
        let large = of(LoanError::TooLarge(1).into());
        assert!(matches!(large, Ok(Absence::TooLarge { .. })), "{large:?}");
    }

    #[test]
    fn file_that_never_fits_is_not_retried() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
        let never = || {
            Failure::Loan(LoanError::NeverFits {
                needed: 70 << 20,
                size: 64 << 20,
                kept: 9 << 20,
                advised: 158,
            })
        };
        let linked = never().of_linked(path);
        let says_size = |why: &str| why.contains("--shm-size=158m");
        assert!(
            matches!(&linked, Ok(Absence::TooLarge { why }) if says_size(why)),
            "{linked:?}"
        );
        let root = explained(never(), path);
        assert!(
            matches!(&root, PrepareFailure::Unreadable(why) if says_size(why)),
            "{root:?}"
        );
    }

    #[test]
    fn refusal_by_bus_is_retried() {
        let path = Path::new("/farm/map.xodr");
        let refused = || Failure::Publish("no subscriber slot".to_owned());
        let linked = refused().of_linked(path);
        assert!(
            matches!(linked, Err(PrepareFailure::NoRoom(_))),
            "{linked:?}"
        );
        let root = explained(refused(), path);
        assert!(matches!(root, PrepareFailure::NoRoom(_)), "{root:?}");
    }
}
