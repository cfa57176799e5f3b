//! Numbers that shape the state machine.

use std::time::Duration;

/// Numbers that shape the state machine. All have defaults.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Number of this broker's start.
    pub generation: u64,
    /// The upper half of every number of a job and an epoch: above that of all that the journal knows. The
    /// generation alone would come back with a new runtime directory, as after a restart of the machine,
    /// and whoever has the result of a job of that number would not be given this one's.
    pub numbers: u64,
    /// Jobs between being read and being stored.
    pub max_active: usize,
    /// Files being read at once.
    pub max_preparing: usize,
    /// Results being stored at once.
    pub max_storing: usize,
    /// Documents of active jobs on the bus.
    pub max_documents: usize,
    /// A bundle must end a job within this time.
    pub job_deadline: Duration,
    /// A bundle with work that says nothing for this long is taken for dead.
    pub silence_limit: Duration,
    /// A demanded bundle that is not there is waited for this long.
    pub absence_limit: Duration,
    /// At the start, how long hellos are collected before missing children are started.
    pub collect: Duration,
    /// First pause before a child is started again; doubles up to `backoff_max`.
    pub backoff: Duration,
    /// Longest pause.
    pub backoff_max: Duration,
    /// A child that has run this long is taken for healthy and its pauses start anew.
    pub healthy_after: Duration,
    /// More restarts than this within `restart_window` and the broker gives up on a child.
    pub max_restarts: u32,
    /// See `max_restarts`.
    pub restart_window: Duration,
    /// Changes of what a bundle is or checks, by its own will, that are believed at once.
    pub changes_forgiven: u32,
    /// Pause before the first change beyond them is believed; doubles up to `distrust_max`.
    pub distrust: Duration,
    /// Longest such pause.
    pub distrust_max: Duration,
    /// After this long without a change, earlier ones are forgotten.
    pub calm_after: Duration,
    /// Issues kept per checker and job.
    pub max_issues: usize,
    /// Bytes of parameters and metadata kept per checker and job.
    pub max_facts: usize,
    /// Bytes of all that is kept per bundle and job.
    pub max_pending_bytes: usize,
    /// Bytes of findings of all jobs that are not stored yet, beyond which no further job is given
    /// out: what a bundle that reports far too much can make the broker hold.
    pub max_findings_bytes: usize,
    /// Longest text kept of anything a bundle says, in bytes.
    pub max_text: usize,
    /// Pause before something that failed for want of room or disk is tried again.
    pub retry_after: Duration,
    /// A file for which there is no room is waited for so long without anything moving; then it is
    /// undetermined, and tried again as what cannot be read is.
    pub room_limit: Duration,
    /// Pause before a file is tried again for which the bus had no place, unless a place becomes free before.
    pub busy_pause: Duration,
    /// First pause before a file is read again that something which passes kept from being read; it
    /// doubles up to the pause after which a verdict says so.
    pub moment_pause: Duration,
    /// See `moment_pause`.
    pub moment_pause_max: Duration,
    /// How often what could not be read is tried again though nothing tells of a change.
    pub read_again_after: Duration,
    /// Drain limit after which unfinished work is given up.
    pub drain_limit: Duration,
    /// The verdict on a file is its own, whatever the verdicts on the files are that it rests on.
    pub own_verdicts: bool,
    /// Stop by itself once the scan is complete and everything has a verdict.
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
            healthy_after: Duration::from_secs(10),
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
