//! Exit codes: one list for every way to run, shared with the command line.

pub use qcbus_messages::Exit;
