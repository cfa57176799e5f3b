//! The adapter as a separate program; `qcbus asam-adapter` does the same.

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = std::env::args_os().skip(1);
    qcbus_asam_adapter::run(&[], arguments, complain).into()
}

fn complain(why: &str) {
    use std::io::Write as _;
    // If stderr is closed, the error cannot be reported anywhere.
    let _ = writeln!(std::io::stderr(), "{why}");
}
