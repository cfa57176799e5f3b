//! The bus between one broker and its bundles and reporters, over iceoryx2.
//!
//! [`Host`] is the broker's end, [`Peer`] everybody else's. Messages travel as reliable, ordered
//! streams, one per peer and direction; document images are published once and read in place by
//! everyone ([`Documents`], [`MappedImage`]). Nothing here ever blocks: whoever does not read holds up
//! nobody but himself.
//!
//! This is the only crate that names iceoryx2. How it is made:
//!
//! * `private_root`: where iceoryx2 puts its memory; `ports`: its configuration, and the only
//!   constructor of services and ports;
//! * `stream`, `link`: the streams, first as arithmetic, then on the bus;
//! * `instance`, `generation`, `runtime_files`, `process`, `janitor`: finding each other, noticing deaths, leaving
//!   nothing behind; `removal_lock`: nobody makes files in memory that is removed; `admission`: who is at the other end;
//! * `memory`: how shared memory is had before it is written to;
//! * `host` with `options`, `session`, `receive_budget`, `documents`; `peer` with `membership`, `library`; `mapped_image`; `wake`.

mod admission;
mod documents;
#[doc(hidden)]
pub mod fuzzing;
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
