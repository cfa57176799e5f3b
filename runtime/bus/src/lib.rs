//! The bus between one broker and its bundles and reporters, over iceoryx2.
//!
//! [`Host`] is the broker's end, [`Peer`] everybody else's. Messages travel as reliable, ordered
//! streams, one per peer and direction; document images are published once and read in place by
//! everyone ([`Documents`], [`Held`]). Nothing here ever blocks: whoever does not read holds up
//! nobody but himself.
//!
//! This is the only crate that names iceoryx2. How it is made:
//!
//! * `enclosed`: where iceoryx2 puts its memory; `ports`: its configuration, and the only
//!   constructor of services and ports;
//! * `stream`, `link`: the streams, first as arithmetic, then on the bus;
//! * `instance`, `generation`, `presence`, `process`, `janitor`: finding each other, noticing deaths, leaving
//!   nothing behind; `door`: nobody makes files in memory that is removed; `entrance`: who is at the other end;
//! * `memory`: how shared memory is had before it is written to;
//! * `host` with `options`, `session`, `turn`, `documents`; `peer` with `membership`, `library`; `held`; `wake`.

mod documents;
mod door;
mod enclosed;
mod entrance;
#[doc(hidden)]
pub mod fuzzing;
mod generation;
mod held;
mod host;
mod instance;
mod janitor;
mod library;
mod link;
mod membership;
mod memory;
mod options;
mod pages;
mod peer;
mod ports;
mod presence;
mod private;
mod process;
mod session;
mod stream;
mod turn;
mod voice;
mod wake;

pub use documents::{Documents, Loan, LoanError, PublishError};
pub use entrance::LAUNCH;
pub use held::Held;
pub use host::{Host, HostEvent, PeerId};
pub use instance::{Instance, InstanceError};
pub use memory::SharedMemory;
pub use options::{HostOptions, StartError};
#[doc(hidden)]
pub use peer::Claims;
pub use peer::{JoinError, Peer, PeerEvent, PeerOptions};
pub use ports::ICEORYX2_VERSION;
pub use private::{PRIVATE_PREFIX, sweep_private_instances};
pub use process::Process;
pub use voice::{STDERR, Voice, lasting_stderr};
