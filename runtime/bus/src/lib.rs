//! The bus between one broker and its bundles and reporters, over iceoryx2.
//!
//! [`Host`] is the broker's end, [`Peer`] the end of all others. Messages travel as reliable,
//! ordered streams, one per peer and direction. Document images are published once and read in
//! place by all peers ([`Documents`], [`MappedImage`]). Nothing here ever blocks: a peer that does
//! not read delays only itself.
//!
//! Only this crate uses iceoryx2. Its structure:
//!
//! * `private_root`: where iceoryx2 puts its memory; `ports`: its configuration, and the only
//!   constructor of services and ports;
//! * `stream`, `link`: the streams, first the pure logic, then on the bus;
//! * `instance`, `generation`, `runtime_files`, `process`, `janitor`: discovery, detection of
//!   deaths, removal of all files; `removal_lock`: the removal lock of the memory; `admission`: the
//!   identity of peers;
//! * `memory`: reserves shared memory before it is written to;
//! * `host` with `options`, `session`, `receive_budget`, `documents`; `peer` with `membership`,
//!   `library`; `mapped_image`; `wake`.

// The helpers that both kinds of tests share name this crate as an integration test does.
#[cfg(test)]
extern crate self as qcbus_bus;

mod admission;
mod documents;
mod generation;
mod host;
mod instance;
mod janitor;
mod library;
mod link;
mod mapped_image;
mod membership;
mod memory;
mod options;
mod pages;
mod peer;
mod ports;
mod private;
mod private_root;
mod process;
mod receive_budget;
mod removal_lock;
mod runtime_files;
mod send_side;
mod session;
mod stream;
#[cfg(test)]
mod tests;
mod wake;

pub use admission::LAUNCH;
pub use documents::{Documents, Loan, LoanError, PublishError};
pub use host::{Host, HostEvent, PeerId};
pub use instance::{Instance, InstanceError};
pub use mapped_image::MappedImage;
pub use memory::SharedMemory;
pub use options::{HostOptions, StartError};
#[doc(hidden)]
pub use peer::Claims;
pub use peer::{JoinError, Peer, PeerEvent, PeerOptions};
pub use ports::ICEORYX2_VERSION;
pub use private::{PRIVATE_PREFIX, sweep_private_instances};
pub use process::Process;
pub use send_side::{STDERR, SendSide, lasting_stderr};
