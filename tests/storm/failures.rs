//! Defines the failures and their frequency.

use crate::support::dice::Dice;

/// Configuration under which all files are judged at the end.
pub const CALM: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\"/>\n  \
    <CheckerBundle application=\"xoscBundle\"/>\n  \
    <CheckerBundle application=\"judges_strictly\"/>\n</Config>\n";

/// Configuration that also requires misbehaving bundles, whether they are registered or not.
pub const WILD: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\"/>\n  \
    <CheckerBundle application=\"xoscBundle\"/>\n  \
    <CheckerBundle application=\"judges_strictly\"/>\n  \
    <CheckerBundle application=\"dies_on_every_job\"/>\n  \
    <CheckerBundle application=\"sends_garbage\"/>\n  \
    <CheckerBundle application=\"lies_about_job_id\"/>\n  \
    <CheckerBundle application=\"slow\"/>\n  \
    <CheckerBundle application=\"qc_polite\"/>\n  \
    <CheckerBundle application=\"floods_issues\"/>\n</Config>\n";

/// Invalid configuration, which must change nothing.
pub const BROKEN: &str = "<Config>\n  <CheckerBundle application=\"xodrBundle\">\n";

/// Misbehaving bundles and reporters that come and go.
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

/// ASAM modules that come and go like misbehaving bundles, with the action of each after it has
/// written a correct result. Their descendants have the name of the module in their command line.
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

/// Limits for misbehaving modules.
pub const GUEST_LIMITS: (u64, u64, u64) = (2, 128, 4);

/// An action of the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// Kills the broker and starts another.
    KillBroker,
    /// Kills a standard bundle.
    KillBundle,
    /// Kills a reporter.
    KillReporter,
    /// Kills a misbehaving bundle.
    KillAnimal,
    /// Stops any process for a while.
    Stop,
    /// Adds or removes a misbehaving bundle.
    Animal,
    /// Changes the configuration.
    Configure,
    /// Writes a file at once.
    Write,
    /// Writes a file in two halves with a pause between.
    WriteTorn,
    /// Writes a file under another name and renames it into place.
    Rename,
    /// Renames a file.
    Move,
    /// Truncates a file.
    Truncate,
    /// Deletes a file.
    Delete,
    /// Writes a file again and again while it is checked.
    Rewrite,
    /// Fills the shared memory for a while.
    Fill,
    /// Writes a file that others depend on.
    Share,
    /// Removes a file that others depend on. It comes back with the next write.
    Unshare,
    /// Replaces a file by a link to a file elsewhere.
    Link,
    /// Reloads the configuration and the manifests.
    Reload,
    /// Gives the custom bundle another version.
    Upgrade,
    /// Removes the program of the custom bundle from the disk for a while.
    Vanish,
    /// Removes the manifest of the custom bundle for a while.
    Remove,
    /// Removes a result, a verdict file or a published file.
    LoseOutput,
    /// Writes in the hidden directory of a copy tool, and may move the file from there into place.
    Hide,
    /// Keeps a half-written file open for writing for seconds.
    WriteSlowly,
    /// Replaces the program on disk by another one.
    Replace,
}

/// Relative frequency of every failure.
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

/// Chooses the next failure.
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
