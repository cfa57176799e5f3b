//! Tests of the on-demand check: `qcbus check` asks a running broker. Whatever happens to that
//! broker, the check has the same outcome as without a broker and leaves nothing behind.

mod bench;
mod failures;
mod leftovers;
mod others;
mod same;
