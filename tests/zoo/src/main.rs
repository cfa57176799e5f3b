//! Program `zoo ANIMAL [--name NAME] [--version TEXT] [--millis N]`, with options for joining the
//! bus.

use std::process::ExitCode;

fn main() -> ExitCode {
    qcbus_zoo::main(std::env::args().skip(1))
}
