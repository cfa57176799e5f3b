//! Filters of system calls, for actions that Landlock does not cover.

use std::collections::BTreeMap;

use qcbus_formats::manifest::May;
use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter,
    SeccompRule, TargetArch, apply_filter, sock_filter,
};

use crate::SandboxError;

/// First number of the second set of system calls on x86-64, for programs with short pointers. No
/// library uses them, and most kernels do not have them.
const SHORT_POINTERS: u32 = 0x4000_0000;

/// Changes to files without an open descriptor: names, rights, owners, times, attributes. Landlock
/// leaves some of them to the owner, and all segments have the same owner.
const FILES: &[i64] = &[
    libc::SYS_fchmod,
    libc::SYS_fchmodat,
    SYS_FCHMODAT2,
    libc::SYS_fchown,
    libc::SYS_fchownat,
    libc::SYS_utimensat,
    libc::SYS_setxattr,
    libc::SYS_lsetxattr,
    libc::SYS_fsetxattr,
    libc::SYS_removexattr,
    libc::SYS_lremovexattr,
    libc::SYS_fremovexattr,
    // A lock on a file opened read-only also affects others.
    libc::SYS_flock,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_chmod,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_chown,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_lchown,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_utime,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_utimes,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_futimesat,
];

/// Calls that affect other processes or bypass a filter, and those for administrators.
const OTHERS: &[i64] = &[
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_process_madvise,
    libc::SYS_pidfd_getfd,
    libc::SYS_kcmp,
    libc::SYS_move_pages,
    libc::SYS_migrate_pages,
    libc::SYS_setpriority,
    libc::SYS_ioprio_set,
    libc::SYS_sched_setparam,
    libc::SYS_sched_setscheduler,
    libc::SYS_sched_setattr,
    libc::SYS_io_uring_setup,
    libc::SYS_io_uring_enter,
    libc::SYS_io_uring_register,
    libc::SYS_bpf,
    libc::SYS_perf_event_open,
    libc::SYS_userfaultfd,
    libc::SYS_keyctl,
    libc::SYS_add_key,
    libc::SYS_request_key,
    libc::SYS_unshare,
    libc::SYS_setns,
    libc::SYS_mount,
    libc::SYS_umount2,
    libc::SYS_chroot,
    libc::SYS_pivot_root,
    libc::SYS_open_by_handle_at,
    libc::SYS_quotactl,
    libc::SYS_swapon,
    libc::SYS_swapoff,
    libc::SYS_reboot,
    libc::SYS_acct,
    libc::SYS_settimeofday,
    libc::SYS_clock_settime,
    libc::SYS_adjtimex,
    libc::SYS_clock_adjtime,
    libc::SYS_sethostname,
    libc::SYS_setdomainname,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_delete_module,
    libc::SYS_kexec_load,
    libc::SYS_mq_open,
    libc::SYS_mq_unlink,
    libc::SYS_shmget,
    libc::SYS_shmat,
    libc::SYS_shmctl,
    libc::SYS_semget,
    libc::SYS_semctl,
    libc::SYS_msgget,
    libc::SYS_msgctl,
];

/// Sockets of every family, because Landlock covers two kinds only. Existing sockets are connected
/// and stay so.
const SOCKETS: &[i64] = &[
    libc::SYS_socket,
    libc::SYS_connect,
    libc::SYS_bind,
    libc::SYS_listen,
    libc::SYS_accept,
    libc::SYS_accept4,
    // These calls name the receiver in memory, which a filter cannot read.
    libc::SYS_sendmsg,
    libc::SYS_sendmmsg,
];

/// Calls that start programs. Threads use the same calls as processes, see [`fresh_processes`].
const PROGRAMS: &[i64] = &[
    libc::SYS_execve,
    libc::SYS_execveat,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_fork,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_vfork,
];

/// Number of a call that some versions of the C library's headers lack.
const SYS_FCHMODAT2: i64 = 452;

type Calls = BTreeMap<i64, Vec<SeccompRule>>;

/// Returns the filters for a program before it starts. Because it must still join, it may do more
/// than [`forbid`] allows: change its own files, and use sockets of this host.
pub(crate) fn beforehand(may: &May) -> Result<[BpfProgram; 2], SandboxError> {
    let refused = refused_beforehand(may).map_err(|why| SandboxError::kernel("seccomp", why))?;
    Ok([second_calls(), program(refused, libc::EPERM)?])
}

fn refused_beforehand(may: &May) -> Result<Calls, seccompiler::BackendError> {
    let mut calls = Calls::new();
    let others = |argument| when(vec![is(argument, SeccompCmpOp::Ne, 0)?]);
    // Landlock covers neither limits nor scheduling. The process id is not known yet, and 0 stands
    // for it.
    add(&mut calls, libc::SYS_prlimit64, vec![others(0)?]);
    add(&mut calls, libc::SYS_sched_setaffinity, vec![others(0)?]);
    add(&mut calls, libc::SYS_setpriority, vec![others(1)?]);
    terminals(&mut calls)?;
    if may.write.is_empty() {
        // It may change the mode of its open files, because segments are created this way.
        let named = FILES
            .iter()
            .filter(|it| **it != libc::SYS_fchmod && **it != libc::SYS_flock);
        for call in named {
            add(&mut calls, *call, Vec::new());
        }
    }
    if !may.network {
        let elsewhere = when(vec![is(0, SeccompCmpOp::Ne, libc::AF_UNIX as u64)?])?;
        add(&mut calls, libc::SYS_socket, vec![elsewhere]);
    }
    Ok(calls)
}

/// Forbids these calls to the calling thread and everything that it starts.
pub(crate) fn forbid(may: &May) -> Result<(), SandboxError> {
    let filters = filters(may)?;
    for filter in filters.iter().filter(|filter| !filter.is_empty()) {
        apply_filter(filter).map_err(|why| SandboxError::kernel("seccomp", why))?;
    }
    Ok(())
}

/// Returns two filters for calls that must look unsupported and one for calls that are refused.
fn filters(may: &May) -> Result<[BpfProgram; 3], SandboxError> {
    let mut unknown = BpfProgram::new();
    if !may.programs {
        // The arguments of this call lie in memory, which a filter cannot read. "There is no such
        // call" makes the C library use the older call.
        let mut newer = Calls::new();
        add(&mut newer, libc::SYS_clone3, Vec::new());
        unknown = program(newer, libc::ENOSYS)?;
    }
    let refused = refused(may).map_err(|why| SandboxError::kernel("seccomp", why))?;
    Ok([second_calls(), unknown, program(refused, libc::EPERM)?])
}

/// Returns the hand-written filter for the second set of calls, which would double the other
/// filters. When the kernel loads a filter, it runs it once for each call.
fn second_calls() -> BpfProgram {
    if !cfg!(target_arch = "x86_64") {
        return BpfProgram::new();
    }
    let step = |code: u32, jt, jf, k| sock_filter {
        code: code as u16,
        jt,
        jf,
        k,
    };
    let number = 0;
    vec![
        step(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0, number),
        step(
            libc::BPF_JMP | libc::BPF_JGE | libc::BPF_K,
            0,
            1,
            SHORT_POINTERS,
        ),
        step(
            libc::BPF_RET | libc::BPF_K,
            0,
            0,
            libc::SECCOMP_RET_ERRNO | libc::ENOSYS.unsigned_abs(),
        ),
        step(libc::BPF_RET | libc::BPF_K, 0, 0, libc::SECCOMP_RET_ALLOW),
    ]
}

fn refused(may: &May) -> Result<Calls, seccompiler::BackendError> {
    let mut calls = Calls::new();
    for call in FILES.iter().chain(OTHERS) {
        add(&mut calls, *call, Vec::new());
    }
    signals(&mut calls)?;
    terminals(&mut calls)?;
    if !may.network {
        for call in SOCKETS {
            add(&mut calls, *call, Vec::new());
        }
        addressed(&mut calls)?;
    }
    if !may.programs {
        for call in PROGRAMS {
            add(&mut calls, *call, Vec::new());
        }
        fresh_processes(&mut calls)?;
    }
    Ok(calls)
}

fn program(calls: Calls, errno: i32) -> Result<BpfProgram, SandboxError> {
    let wrong = |why: String| SandboxError::kernel("seccomp", why);
    let arch = TargetArch::try_from(std::env::consts::ARCH).map_err(|it| wrong(it.to_string()))?;
    let refused = SeccompAction::Errno(errno.unsigned_abs());
    let filter = SeccompFilter::new(calls, SeccompAction::Allow, refused, arch);
    let filter = filter.map_err(|it| wrong(it.to_string()))?;
    BpfProgram::try_from(filter).map_err(|it| wrong(it.to_string()))
}

fn add(calls: &mut Calls, call: i64, rules: Vec<SeccompRule>) {
    calls.insert(call, rules);
}

type Made = Result<(), seccompiler::BackendError>;

/// Creates a rule. It applies if all its conditions hold, and one call may have several rules.
fn when(conditions: Vec<SeccompCondition>) -> Result<SeccompRule, seccompiler::BackendError> {
    SeccompRule::new(conditions)
}

fn is(
    argument: u8,
    operator: SeccompCmpOp,
    value: u64,
) -> Result<SeccompCondition, seccompiler::BackendError> {
    SeccompCondition::new(argument, SeccompCmpArgLen::Dword, operator, value)
}

fn is_long(
    argument: u8,
    operator: SeccompCmpOp,
    value: u64,
) -> Result<SeccompCondition, seccompiler::BackendError> {
    SeccompCondition::new(argument, SeccompCmpArgLen::Qword, operator, value)
}

/// Restricts signals and limits to the process itself. Landlock scopes signals since Linux 6.12
/// only, limits never.
fn signals(calls: &mut Calls) -> Made {
    let own = u64::from(std::process::id());
    let foreign = |argument| when(vec![is(argument, SeccompCmpOp::Ne, own)?]);
    let to_others = [
        libc::SYS_kill,
        libc::SYS_tgkill,
        libc::SYS_rt_sigqueueinfo,
        libc::SYS_rt_tgsigqueueinfo,
    ];
    for call in to_others {
        add(calls, call, vec![foreign(0)?]);
    }
    // A thread id does not show its process, and a descriptor shows even less.
    add(calls, libc::SYS_tkill, Vec::new());
    add(calls, libc::SYS_pidfd_send_signal, Vec::new());
    let others = when(vec![
        is(0, SeccompCmpOp::Ne, own)?,
        is(0, SeccompCmpOp::Ne, 0)?,
    ])?;
    add(calls, libc::SYS_prlimit64, vec![others.clone()]);
    add(calls, libc::SYS_sched_setaffinity, vec![others]);
    // The kernel sends signals to the owner of a descriptor, so the owner must not be changed.
    let owner = |command: i32| when(vec![is(1, SeccompCmpOp::Eq, command as u64)?]);
    let owners = vec![owner(libc::F_SETOWN)?, owner(F_SETOWN_EX)?];
    add(calls, libc::SYS_fcntl, owners);
    Ok(())
}

const F_SETOWN_EX: i32 = 15;

/// Forbids typing into a terminal.
fn terminals(calls: &mut Calls) -> Made {
    const TIOCLINUX: u64 = 0x541C;
    let typing = when(vec![is(1, SeccompCmpOp::Eq, libc::TIOCSTI)?])?;
    let pasting = when(vec![is(1, SeccompCmpOp::Eq, TIOCLINUX)?])?;
    add(calls, libc::SYS_ioctl, vec![typing, pasting]);
    Ok(())
}

/// Forbids sending to an address other than the connected one.
fn addressed(calls: &mut Calls) -> Made {
    let named = when(vec![is_long(4, SeccompCmpOp::Ne, 0)?])?;
    add(calls, libc::SYS_sendto, vec![named]);
    Ok(())
}

/// Forbids starting anything except threads of this process.
fn fresh_processes(calls: &mut Calls) -> Made {
    let thread = libc::CLONE_THREAD as u64;
    let process = when(vec![is(0, SeccompCmpOp::MaskedEq(thread), 0)?])?;
    add(calls, libc::SYS_clone, vec![process]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filter_exists_for_every_declaration() {
        for (network, programs) in [(false, false), (true, false), (false, true), (true, true)] {
            let may = May {
                network,
                programs,
                ..May::default()
            };
            let [second, unknown, refused] = filters(&may).unwrap();
            assert_eq!(second.is_empty(), !cfg!(target_arch = "x86_64"));
            assert!(!refused.is_empty());
            assert_eq!(
                unknown.is_empty(),
                programs,
                "only programs have calls that must seem unknown"
            );
        }
    }
}
