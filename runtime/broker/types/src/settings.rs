//! Settings of the state machine.

use std::time::Duration;

/// Numeric settings of the state machine. All have defaults.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Sequence number of this broker's start.
    pub generation: u64,
    /// Upper half of every job and epoch number. It exceeds all numbers in the journal. The
    /// generation alone would repeat with a new runtime directory, for example after a reboot. A
    /// reporter with an old result of the same job number would then not get the new one.
    pub numbers: u64,
    /// Maximum number of jobs between reading and storing.
    pub max_active: usize,
    /// Maximum number of files being read at once.
    pub max_preparing: usize,
    /// Maximum number of results being stored at once.
    pub max_storing: usize,
    /// Maximum number of documents of active jobs on the bus.
    pub max_documents: usize,
    /// Maximum time for a bundle to finish a job.
    pub job_deadline: Duration,
    /// Maximum time without a message from a bundle that has work. After that it counts as dead.
    pub silence_limit: Duration,
    /// Maximum time to wait for a missing demanded bundle.
    pub absence_limit: Duration,
    /// Time after the start to collect hellos before missing children are started.
    pub collect: Duration,
    /// First pause before a child is restarted. It doubles up to `backoff_max`.
    pub backoff: Duration,
    /// Longest pause.
    pub backoff_max: Duration,
    /// Maximum number of restarts within `restart_window`. Beyond it the broker gives up on a child.
    pub max_restarts: u32,
    /// See `max_restarts`.
    pub restart_window: Duration,
    /// Number of registration changes by a bundle itself that are accepted at once.
    pub changes_forgiven: u32,
    /// Pause before the first change beyond them is accepted. It doubles up to `distrust_max`.
    pub distrust: Duration,
    /// Longest such pause.
    pub distrust_max: Duration,
    /// Time without a change after which earlier changes are forgotten.
    pub calm_after: Duration,
    /// Maximum number of issues kept per checker and job.
    pub max_issues: usize,
    /// Maximum bytes of parameters and metadata kept per checker and job.
    pub max_facts: usize,
    /// Maximum bytes of pending findings kept per bundle and job.
    pub max_pending_bytes: usize,
    /// Maximum bytes of findings of all jobs that are not stored yet. Beyond it no further jobs are
    /// sent. It limits the memory that a bundle with far too many findings can occupy.
    pub max_findings_bytes: usize,
    /// Maximum length of any text kept from a bundle, in bytes.
    pub max_text: usize,
    /// Pause before a retry after a failure for lack of room or disk space.
    pub retry_after: Duration,
    /// Maximum time that a file waits for room while no job progresses. After that its verdict is
    /// undetermined, and it is retried like an unreadable file.
    pub room_limit: Duration,
    /// Pause before a file without a place on the bus is retried, unless a place becomes free earlier.
    pub busy_pause: Duration,
    /// First pause before a file is read again after a temporary failure. It doubles up to the
    /// maximum, after which a verdict states the failure.
    pub moment_pause: Duration,
    /// See `moment_pause`.
    pub moment_pause_max: Duration,
    /// Interval of retries of unreadable files without a reported change.
    pub read_again_after: Duration,
    /// Maximum time of draining. After that unfinished work is given up.
    pub drain_limit: Duration,
    /// The verdict on a file ignores the verdicts on the files that it rests on.
    pub own_verdicts: bool,
    /// The broker stops by itself when the scan is complete and every file has a verdict.
    pub once: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            generation: 1,
            numbers: 1,
            max_active: 24,
            max_preparing: 4,
            max_storing: 8,
            max_documents: 48,
            job_deadline: Duration::from_secs(60),
            silence_limit: Duration::from_secs(10),
            absence_limit: Duration::from_secs(20),
            collect: Duration::from_millis(500),
            backoff: Duration::from_millis(100),
            backoff_max: Duration::from_secs(30),
            max_restarts: 20,
            restart_window: Duration::from_secs(60),
            changes_forgiven: 8,
            distrust: Duration::from_secs(2),
            distrust_max: Duration::from_secs(300),
            calm_after: Duration::from_secs(600),
            max_issues: 10_000,
            max_facts: 64 << 10,
            max_pending_bytes: 16 << 20,
            max_findings_bytes: 16 << 20,
            max_text: 8 << 10,
            retry_after: Duration::from_secs(1),
            room_limit: Duration::from_secs(60),
            busy_pause: Duration::from_millis(250),
            moment_pause: Duration::from_millis(125),
            moment_pause_max: Duration::from_secs(4),
            read_again_after: Duration::from_secs(60),
            drain_limit: Duration::from_secs(30),
            own_verdicts: false,
            once: false,
        }
    }
}
