//! Exit codes: one list for all modes, shared with the command line.

pub use qcbus_messages::Exit;
