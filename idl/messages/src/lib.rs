//! Messages on the bus and on the control socket: plain data, one file per direction.
//!
//! This crate performs no I/O. The bus carries these types as a reliable, ordered stream per peer
//! and direction (see `qcbus-bus`). Documents and the configuration have topics of their own.

pub mod broker_to_peer;
pub mod catalogue;
pub mod codec;
pub mod control;
mod exit;
pub mod ids;
pub mod missing;
pub mod path_text;
pub mod peer_to_broker;
pub mod services;
pub mod shown;

/// Day of the build, `YYYY-MM-DD`. It is the day of the commit, so that two builds of one source
/// give the same results. See `build.rs`.
pub const BUILD_DATE: &str = env!("QCBUS_BUILD_DATE");

pub use broker_to_peer::{
    IS_STOPPING, Job, JobDocument, Link, PeerReport, ResultMessage, ToPeer, Withdrawn,
};
pub use catalogue::{Catalogue, CheckerInfo, Hello, ParamInfo, Role};
pub use exit::Exit;
pub use ids::{Digest, DocId, DocumentRole, JobId, PROTOCOL_VERSION};
pub use missing::{Absence, MissingDocument, Within};
pub use peer_to_broker::{CheckerEnd, FromPeer};
pub use qcbus_formats::Verdict;

#[cfg(test)]
#[expect(dead_code, reason = "the other functions are used only in the build")]
#[path = "../build.rs"]
mod build;

#[cfg(test)]
mod tests {
    use super::build::day_of;

    #[test]
    fn days_are_counted_by_calendar() {
        let days = [
            (0, "1970-01-01"),
            (-1, "1969-12-31"),
            (86_399, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_709_164_800, "2024-02-29"),
            (4_107_456_000, "2100-02-28"),
            (4_107_542_400, "2100-03-01"),
            (1_795_305_600, "2026-11-22"),
        ];
        for (seconds, day) in days {
            assert_eq!(day_of(seconds), day);
        }
        assert_eq!(super::BUILD_DATE.len(), "1970-01-01".len());
    }
}
