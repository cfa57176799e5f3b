//! The adapter as a program of its own; `qcbus asam-adapter` is the same.

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = std::env::args_os().skip(1);
    qcbus_asam_adapter::run(&[], arguments, complain).into()
}

fn complain(why: &str) {
    use std::io::Write as _;
    // Where nobody listens there is nobody to be told that.
    let _ = writeln!(std::io::stderr(), "{why}");
}
