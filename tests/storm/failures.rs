//! Which troubles there are, and how often each comes.

use crate::support::dice::Dice;

/// The configuration under which everything is judged in the end.
pub const CALM: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\"/>\n  \
    <CheckerBundle application=\"xoscBundle\"/>\n  \
    <CheckerBundle application=\"judges_strictly\"/>\n</Config>\n";

/// A configuration that demands animals, too, whether they are there or not.
pub const WILD: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\"/>\n  \
    <CheckerBundle application=\"xoscBundle\"/>\n  \
    <CheckerBundle application=\"judges_strictly\"/>\n  \
    <CheckerBundle application=\"dies_on_every_job\"/>\n  \
    <CheckerBundle application=\"sends_garbage\"/>\n  \
    <CheckerBundle application=\"lies_about_job_id\"/>\n  \
    <CheckerBundle application=\"slow\"/>\n  \
    <CheckerBundle application=\"qc_polite\"/>\n  \
    <CheckerBundle application=\"floods_issues\"/>\n</Config>\n";

/// What cannot be used and must change nothing.
pub const BROKEN: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\">\n";

/// Animals that come and go.
pub const ANIMALS: &[&str] = &[
    "hangs_after_hello",
    "floods_issues",
    "dies_on_every_job",
    "lies_about_job_id",
    "never_acknowledges",
    "sends_garbage",
    "stops_reading",
    "allocates_forever",
    "slow",
    "polite",
    "hangs_in_a_job",
    "reporter_never_acknowledges",
];

/// One-shot modules of ASAM's framework that come and go like animals: what each does after it has written a polite
/// result. What they leave behind has their own name in its command line.
pub const GUESTS: &[(&str, &str)] = &[
    ("qc_polite", ""),
    ("qc_crashes", "kill -SEGV $$"),
    ("qc_stops", "kill -STOP $$"),
    ("qc_floods", "yes"),
    ("qc_leaks", "x=xxxxxxxxxxxxxxxx; while :; do x=$x$x; done"),
    (
        "qc_forks",
        "i=0; while [ $i -lt 10 ]; do setsid sh -c 'sleep 600 & sleep 600' \"$0\" & i=$((i+1)); done",
    ),
];

/// What modules that misbehave may take.
pub const GUEST_LIMITS: (u64, u64, u64) = (2, 128, 4);

/// Something to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// Kill the broker and start another.
    KillBroker,
    /// Kill a standard bundle.
    KillBundle,
    /// Kill a reporter.
    KillReporter,
    /// Kill an animal.
    KillAnimal,
    /// Stop any process for a while.
    Stop,
    /// An animal comes or goes.
    Animal,
    /// The configuration changes.
    Configure,
    /// A file is written at once.
    Write,
    /// A file is written in two halves with a pause between.
    WriteTorn,
    /// A file is written under another name and renamed into place.
    Rename,
    /// A file gets another name.
    Move,
    /// A file is cut off.
    Truncate,
    /// A file is deleted.
    Delete,
    /// A file is written again and again while it is checked.
    Rewrite,
    /// Shared memory runs full for a while.
    Fill,
    /// Something that others depend on is written.
    Share,
    /// Something that others depend on goes; it comes back when it is written again.
    Unshare,
    /// A link to a file elsewhere takes the place of a file.
    Link,
    /// The configuration and the manifests are read again.
    Reload,
    /// The bundle of one's own gets another version.
    Upgrade,
    /// The program of the bundle of one's own goes from the disk for a while.
    Vanish,
    /// The manifest of the bundle of one's own goes for a while.
    Remove,
    /// A result, a verdict file or a published file is removed.
    LoseOutput,
    /// A copy tool writes in a hidden directory, and may move the file from there into place.
    Hide,
    /// A file is open for writing for seconds, half-written.
    WriteSlowly,
    /// The program on the disk is replaced by another one.
    Replace,
}

/// Every trouble with its share.
const SHARES: &[(u64, Failure)] = &[
    (6, Failure::KillBroker),
    (26, Failure::KillBundle),
    (10, Failure::KillReporter),
    (8, Failure::KillAnimal),
    (4, Failure::Stop),
    (4, Failure::Animal),
    (2, Failure::Configure),
    (16, Failure::Write),
    (8, Failure::WriteTorn),
    (8, Failure::Rename),
    (4, Failure::Move),
    (5, Failure::Truncate),
    (6, Failure::Delete),
    (6, Failure::Rewrite),
    (2, Failure::Fill),
    (10, Failure::Share),
    (2, Failure::Unshare),
    (5, Failure::Link),
    (4, Failure::Reload),
    (2, Failure::Upgrade),
    (2, Failure::Vanish),
    (2, Failure::Remove),
    (6, Failure::LoseOutput),
    (6, Failure::Hide),
    (6, Failure::WriteSlowly),
    (2, Failure::Replace),
];

/// What comes next.
pub fn any(dice: &mut Dice) -> Failure {
    let total: u64 = SHARES.iter().map(|(share, _)| share).sum();
    let mut at = dice.below(total);
    for (share, failure) in SHARES {
        if at < *share {
            return *failure;
        }
        at -= share;
    }
    Failure::Write
}
