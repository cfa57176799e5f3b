//! Check whether a broker sees the same files as its client.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;

use qcbus_bus::Process;

/// Checks whether another process is the same program, has the same rights and sees the same files
/// at its paths. If a property cannot be read, the processes count as different.
pub(super) fn is_like_us(process: &Process) -> bool {
    let of = |id: &str, what: &str| std::fs::metadata(format!("/proc/{id}/{what}")).ok();
    let file_view = |what: &str, is: fn(&Metadata, &Metadata) -> bool| {
        let id = process.id().to_string();
        let both = of(&id, what).zip(of("self", what));
        both.is_some_and(|(theirs, ours)| is(&theirs, &ours))
    };
    let same_file = |a: &Metadata, b: &Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    may_what_we_may(process)
        && file_view("exe", same_file)
        && file_view("ns/mnt", same_file)
        && file_view("root", same_file)
        // The process id must not have been reused meanwhile.
        && process.is_alive()
}

/// Checks whether another process has the same rights as this one. With other rights it can read
/// other files than this process.
fn may_what_we_may(process: &Process) -> bool {
    let of = |id: &str| std::fs::read_to_string(format!("/proc/{id}/status")).ok();
    let both = of(&process.id().to_string()).zip(of("self"));
    both.is_some_and(|(theirs, ours)| rights(&theirs).eq(rights(&ours)))
}

/// Returns the lines about rights from the `/proc` status of a process.
fn rights(status: &str) -> impl Iterator<Item = &str> {
    let counts = ["Uid:", "Gid:", "Groups:", "CapEff:"];
    let lines = status.lines();
    lines.filter(move |line| counts.iter().any(|it| line.starts_with(it)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn process_of_other_program_is_distinguished_from_own() {
        let own = Process::open(std::process::id(), None).unwrap();
        assert!(is_like_us(&own));
        let mut other = std::process::Command::new("sleep")
            .arg("1000")
            .spawn()
            .unwrap();
        let process = Process::open(other.id(), None).unwrap();
        // Until it executes the other program, the child is still a copy of this program.
        let exe = || std::fs::read_link(format!("/proc/{}/exe", other.id())).unwrap();
        while exe() == std::env::current_exe().unwrap() {
            std::thread::yield_now();
        }
        assert!(!is_like_us(&process));
        other.kill().unwrap();
        other.wait().unwrap();
        assert!(!is_like_us(&process));
    }
}
