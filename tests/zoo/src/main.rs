//! `zoo ANIMAL [--name NAME] [--version TEXT] [--millis N]` and how to join the bus.

use std::process::ExitCode;

fn main() -> ExitCode {
    qcbus_zoo::main(std::env::args().skip(1))
}
