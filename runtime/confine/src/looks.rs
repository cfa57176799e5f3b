//! How far a process is confined, as the kernel has it.

use std::path::Path;

/// What the kernel says of a process. It does not tell whether Landlock holds it; that goes along with the filter
/// in whatever is confined by [`crate::confine`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Looks {
    /// Every thread has more filters of system calls than it was given, and can gain no rights.
    Filtered,
    /// Threads, or all of it, have none.
    Open,
    /// There is no such process, or it cannot be looked at.
    Unknown,
}

/// How many filters this process has, and with it whatever it starts: a container may have given it some.
pub fn own_filters() -> usize {
    std::fs::read_to_string("/proc/self/status").map_or(0, |status| filters(&status))
}

/// Looks at a process that was given so many filters.
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
    // Kernels before 5.9 do not count them; they have no Landlock either.
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
    fn filters_count_beyond_those_given_where_no_rights_can_be_gained() {
        let status = |filters, privileges| {
            format!(
                "Name:\tx\nNoNewPrivs:\t{privileges}\nSeccomp:\t2\nSeccomp_filters:\t{filters}\n"
            )
        };
        assert!(is_filtered(&status(2, 1), 0));
        assert!(is_filtered(&status(5, 1), 2));
        assert!(!is_filtered(&status(2, 1), 2), "as it was started");
        assert!(!is_filtered(&status(2, 0), 0));
        assert!(!is_filtered(&status(0, 1), 0));
        assert!(
            is_filtered("NoNewPrivs:\t1\nSeccomp:\t2\n", 0),
            "an old kernel"
        );
        assert!(!is_filtered("", 0));
    }

    #[test]
    fn who_is_not_there_cannot_be_looked_at() {
        assert_ne!(looks(std::process::id(), 0), Looks::Unknown);
        assert_eq!(looks(u32::MAX, 0), Looks::Unknown);
    }
}
