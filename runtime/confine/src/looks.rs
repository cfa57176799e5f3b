//! How far a process is confined, as the kernel has it.

use std::path::Path;

/// What the kernel says of a process. It does not tell whether Landlock holds it; that goes along with the filter
/// in whatever is confined by [`crate::confine`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Looks {
    /// Every thread has a filter of system calls and can gain no rights.
    Filtered,
    /// Threads, or all of it, have none.
    Open,
    /// There is no such process, or it cannot be looked at.
    Unknown,
}

/// Looks at a process.
pub fn looks(pid: u32) -> Looks {
    let tasks = Path::new("/proc").join(pid.to_string()).join("task");
    let Ok(threads) = std::fs::read_dir(tasks) else {
        return Looks::Unknown;
    };
    let mut seen = Looks::Unknown;
    for thread in threads.flatten() {
        match std::fs::read_to_string(thread.path().join("status")) {
            Ok(status) if is_filtered(&status) => seen = Looks::Filtered,
            Ok(_) => return Looks::Open,
            // The thread has ended meanwhile.
            Err(_) => {}
        }
    }
    seen
}

fn is_filtered(status: &str) -> bool {
    let is = |key: &str, value: &str| {
        let mut lines = status.lines().filter_map(|line| line.split_once(':'));
        lines.any(|(found, told)| found == key && told.trim() == value)
    };
    is("Seccomp", "2") && is("NoNewPrivs", "1")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_counts_only_where_no_rights_can_be_gained() {
        let status = |seccomp, privileges| {
            format!(
                "Name:\tx\nNoNewPrivs:\t{privileges}\nSeccomp:\t{seccomp}\nSeccomp_filters:\t2\n"
            )
        };
        assert!(is_filtered(&status(2, 1)));
        assert!(!is_filtered(&status(2, 0)));
        assert!(!is_filtered(&status(0, 1)));
        assert!(!is_filtered(""));
    }

    #[test]
    fn who_is_not_there_cannot_be_looked_at() {
        assert_ne!(looks(std::process::id()), Looks::Unknown);
        assert_eq!(looks(u32::MAX), Looks::Unknown);
    }
}
