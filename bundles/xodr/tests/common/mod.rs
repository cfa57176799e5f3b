//! What the tests with recorded results share.

use std::path::Path;

use qcbus_sdk::corpus;

/// Where the recorded results lie, if they are at hand.
pub const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases");

/// Inputs on which a checker differs from what is recorded, all for one reason.
pub struct Deviation {
    /// The checker.
    pub checker: &'static str,
    /// Ends of the inputs' paths.
    pub inputs: &'static [&'static str],
    /// Why ours is right.
    pub reason: &'static str,
}

impl Deviation {
    /// The deviation, input by input.
    pub fn each(&self) -> impl Iterator<Item = corpus::Deviation> + use<> {
        let (checker, reason) = (self.checker, self.reason);
        self.inputs.iter().map(move |input| corpus::Deviation {
            input,
            checker,
            reason,
        })
    }
}

/// Fails the running test when the file does not say this; writes it with `QCBUS_BLESS` set.
pub fn agrees_or_says(path: &Path, text: &str) {
    if std::env::var_os("QCBUS_BLESS").is_some() {
        let written = std::fs::write(path, text);
        assert!(written.is_ok(), "{}: {written:?}", path.display());
        return;
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        written == text,
        "{} is not what the test finds; QCBUS_BLESS=1 writes it, review the difference",
        path.display()
    );
}
