//! Outer sandbox: the broker applies it to a bundle before its program begins.

use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::process::CommandExt as _;
use std::process::Command;

use qcbus_formats::manifest::May;
use seccompiler::BpfProgram;

use crate::SandboxError;
use crate::calls;
use crate::rules::{Rules, everything, reading};

/// Paths that a bundle writes to while it joins. The devices are harmless because they store
/// nothing.
const WRITTEN: &[&str] = &[
    "/dev/shm",
    "/dev/null",
    "/dev/zero",
    "/dev/full",
    "/dev/tty",
];

/// An outer sandbox for one process.
#[derive(Debug)]
pub struct Outer {
    /// `None` if this kernel has no Landlock.
    files: Option<OwnedFd>,
    calls: [BpfProgram; 2],
}

impl Outer {
    /// Creates the outer sandbox of a bundle.
    ///
    /// # Errors
    /// Returns [`SandboxError::Kernel`] if the kernel refuses.
    pub fn new(may: &May) -> Result<Outer, SandboxError> {
        let mut rules = Rules::new(may.network)?.allow("/", reading())?;
        for path in WRITTEN {
            rules = rules.allow(path, everything())?;
        }
        for path in &may.write {
            rules = rules.allow(path, everything())?;
        }
        Ok(Outer {
            files: rules.into_descriptor(),
            calls: calls::beforehand(may)?,
        })
    }

    /// Number of system call filters that it adds to a process.
    pub const FILTERS: usize = if cfg!(target_arch = "x86_64") { 2 } else { 1 };

    /// Makes a process start in the sandbox.
    #[expect(
        unsafe_code,
        reason = "only the new process itself can enter the sandbox, between fork and exec"
    )]
    pub fn surround(self, command: &mut Command) {
        // SAFETY: between fork and exec only system calls are made; nothing is allocated and no
        // lock is taken. The descriptor and the filters belong to the closure, which lives as long
        // as the command.
        unsafe {
            command.pre_exec(move || {
                let set = libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
                let failed = || Err(std::io::Error::last_os_error());
                if set != 0 {
                    return failed();
                }
                if let Some(files) = &self.files
                    && libc::syscall(libc::SYS_landlock_restrict_self, files.as_raw_fd(), 0) != 0
                {
                    return failed();
                }
                for filter in self.calls.iter().filter(|it| !it.is_empty()) {
                    // If the kernel refuses a filter, the process counts as open, which is
                    // reported.
                    let _ = seccompiler::apply_filter(filter);
                }
                Ok(())
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    use super::*;
    use crate::{Looks, looks, own_filters};

    /// Runs a shell command in the sandbox, before joining, and returns whether it succeeded.
    fn inside(may: &May, line: &str, file: &Path) -> bool {
        let mut command = Command::new("sh");
        command.args(["-c", line]).arg(file);
        Outer::new(may).unwrap().surround(&mut command);
        command.output().unwrap().status.success()
    }

    #[test]
    fn outer_sandbox_alone_does_not_look_confined() {
        let mut command = Command::new("sleep");
        command.arg("60");
        Outer::new(&May::default()).unwrap().surround(&mut command);
        let mut child = command.spawn().unwrap();
        let given = own_filters() + Outer::FILTERS;
        assert_eq!(looks(child.id(), given), Looks::Open);
        assert_eq!(looks(child.id(), given - 1), Looks::Filtered);
        child.kill().unwrap();
        child.wait().unwrap();
    }

    #[test]
    fn program_cannot_change_other_files_before_joining() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let may = May::default();
        assert!(inside(&may, "cat \"$0\"", file.path()));
        assert!(
            inside(&may, "ulimit -n 20", file.path()),
            "a program may lower its own limits"
        );
        let before = file.as_file().metadata().unwrap().permissions().mode();
        for line in [
            "chmod 777 \"$0\"",
            "touch -d 2000-01-01 \"$0\"",
            "echo x > \"$0\"",
        ] {
            assert!(!inside(&may, line, file.path()), "{line}");
        }
        let after = file.as_file().metadata().unwrap();
        assert_eq!((after.permissions().mode(), after.len()), (before, 0));
        let may = May {
            write: vec![file.path().to_path_buf()],
            ..May::default()
        };
        assert!(
            inside(&may, "chmod 600 \"$0\" && echo x > \"$0\"", file.path()),
            "declared"
        );
    }
}
