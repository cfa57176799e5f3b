//! Meaning of qcbus's exit codes. Scripts depend on these numbers, so they never change.

use crate::Verdict;

/// The exit codes of every command and of every bundle that runs on its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Exit {
    /// All checked files are accepted, or the command succeeded.
    Accepted = 0,
    /// At least one file is rejected. For `doctor` and `status --health`: something needs
    /// attention.
    Rejected = 1,
    /// Wrong usage or configuration, nothing to check, or a file that is not watched.
    Usage = 2,
    /// No file is rejected and at least one is undetermined, or something could not be accessed. Or
    /// the time limit has expired, also for the reports that `wait --reports` waits for.
    Undetermined = 3,
    /// No broker runs as the requested instance, or it belongs to another user.
    NoBroker = 4,
    /// Internal error of qcbus or the system.
    Internal = 5,
}

impl Exit {
    /// Returns the number.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// Returns the exit code for the verdicts on any number of files; `Usage` when there are none.
    pub fn of_verdicts(verdicts: impl IntoIterator<Item = Verdict>) -> Exit {
        let mut exit = None;
        for verdict in verdicts {
            exit = Some(match (exit, verdict) {
                (Some(Exit::Rejected), _) | (_, Verdict::Rejected) => Exit::Rejected,
                (Some(Exit::Undetermined), _) | (_, Verdict::Undetermined) => Exit::Undetermined,
                _ => Exit::Accepted,
            });
        }
        exit.unwrap_or(Exit::Usage)
    }
}

impl From<Verdict> for Exit {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Accepted => Exit::Accepted,
            Verdict::Rejected => Exit::Rejected,
            Verdict::Undetermined => Exit::Undetermined,
        }
    }
}

impl From<Exit> for std::process::ExitCode {
    fn from(exit: Exit) -> Self {
        std::process::ExitCode::from(exit.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejected_outweighs_undetermined_outweighs_accepted() {
        use Verdict::{Accepted, Rejected, Undetermined};
        let of = |verdicts: &[Verdict]| Exit::of_verdicts(verdicts.iter().copied());
        assert_eq!(of(&[]), Exit::Usage);
        assert_eq!(of(&[Accepted, Accepted]), Exit::Accepted);
        assert_eq!(of(&[Accepted, Undetermined, Accepted]), Exit::Undetermined);
        assert_eq!(of(&[Undetermined, Rejected, Accepted]), Exit::Rejected);
        assert_eq!(of(&[Rejected, Undetermined]), Exit::Rejected);
    }
}
