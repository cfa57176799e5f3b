//! Reads from the kernel how far a process is confined.

use std::path::Path;

/// State of a process according to the kernel. It does not show whether Landlock applies. A process
/// confined by [`crate::confine`] has both the filter and Landlock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Looks {
    /// Every thread has more system call filters than it was given, and cannot gain rights.
    Filtered,
    /// At least one thread has no further filters.
    Open,
    /// The process does not exist or cannot be inspected.
    Unknown,
}

/// Returns the number of filters of this process, which its children inherit. A container may have
/// set some.
pub fn own_filters() -> usize {
    std::fs::read_to_string("/proc/self/status").map_or(0, |status| filters(&status))
}

/// Inspects a process that was given this number of filters.
pub fn looks(pid: u32, given: usize) -> Looks {
    let tasks = Path::new("/proc").join(pid.to_string()).join("task");
    let Ok(threads) = std::fs::read_dir(tasks) else {
        return Looks::Unknown;
    };
    let mut seen = Looks::Unknown;
    for thread in threads.flatten() {
        match std::fs::read_to_string(thread.path().join("status")) {
            Ok(status) if is_filtered(&status, given) => seen = Looks::Filtered,
            Ok(_) => return Looks::Open,
            // The thread has ended meanwhile.
            Err(_) => {}
        }
    }
    seen
}

fn is_filtered(status: &str, given: usize) -> bool {
    value(status, "NoNewPrivs") == Some("1") && filters(status) > given
}

fn filters(status: &str) -> usize {
    // Kernels before 5.9 do not count them. They have no Landlock either.
    let counted = value(status, "Seccomp_filters").and_then(|it| it.parse().ok());
    counted.unwrap_or_else(|| usize::from(value(status, "Seccomp") == Some("2")))
}

fn value<'s>(status: &'s str, key: &str) -> Option<&'s str> {
    let mut lines = status.lines().filter_map(|line| line.split_once(':'));
    lines
        .find(|(found, _)| *found == key)
        .map(|(_, told)| told.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_filters_beyond_the_given_ones_count() {
        let status = |filters, privileges| {
            format!(
                "Name:\tx\nNoNewPrivs:\t{privileges}\nSeccomp:\t2\nSeccomp_filters:\t{filters}\n"
            )
        };
        assert!(is_filtered(&status(2, 1), 0));
        assert!(is_filtered(&status(5, 1), 2));
        assert!(
            !is_filtered(&status(2, 1), 2),
            "no filter was added since the start"
        );
        assert!(!is_filtered(&status(2, 0), 0));
        assert!(!is_filtered(&status(0, 1), 0));
        assert!(
            is_filtered("NoNewPrivs:\t1\nSeccomp:\t2\n", 0),
            "on an old kernel"
        );
        assert!(!is_filtered("", 0));
    }

    #[test]
    fn sandbox_of_a_missing_process_is_unknown() {
        assert_ne!(looks(std::process::id(), 0), Looks::Unknown);
        assert_eq!(looks(u32::MAX, 0), Looks::Unknown);
    }
}
