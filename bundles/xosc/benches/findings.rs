//! Prints every finding of the bundle in the given files:
//! `cargo bench -p qcbus-xosc --bench findings -- [--counts] [--checker PART] $PWD/PATH…`

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo adds `--bench`.
    let arguments = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench");
    qcbus_rule_tests::corpus::print_findings(&qcbus_xosc::BUNDLE, arguments)
}
