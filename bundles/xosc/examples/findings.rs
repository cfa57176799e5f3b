//! Prints every finding of the bundle in the given files: `findings [--checker PART] PATH…`

fn main() -> Result<(), Box<dyn std::error::Error>> {
    qcbus_rule_tests::corpus::print_findings(&qcbus_xosc::BUNDLE, std::env::args().skip(1))
}
