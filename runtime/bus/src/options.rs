//! Options of the broker's end of the bus, and the reasons why it cannot start.

use qcbus_messages::services::{Limits, Services};

use crate::instance::InstanceError;
use crate::memory::SharedMemory;
use crate::memory::fitting_reserve;
use crate::ports::PortError;

/// Options of the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HostOptions {
    /// Maximum number of bundles and reporters at the same time.
    pub max_peers: usize,
    /// Maximum number of documents that running jobs need, in the small class. The broker keeps its
    /// active jobs below it. Otherwise slow peers must request documents again.
    pub active_documents: usize,
    /// The same in the large class.
    pub large_active_documents: usize,
    /// Maximum size of an image of the small class in bytes.
    pub small_class_bytes: usize,
    /// Bytes of /dev/shm that stay free. At most an eighth of /dev/shm is reserved.
    pub shm_reserve_bytes: u64,
    /// Number of expected bundles and reporters. Shared memory for them is reserved from the
    /// beginning.
    pub expected_peers: usize,
    /// Whether a configuration may be larger than 64 KiB. Supporting this takes a megabyte of
    /// private memory, also in every peer.
    pub config_grows: bool,
}

impl Default for HostOptions {
    fn default() -> Self {
        let limits = Limits::default();
        HostOptions {
            max_peers: limits.peers,
            active_documents: limits.small_active,
            large_active_documents: limits.large_active,
            small_class_bytes: limits.small_bytes,
            shm_reserve_bytes: 64 << 20,
            expected_peers: 0,
            config_grows: true,
        }
    }
}

/// Sizes for a process with a limited address space: the maximum image of the small class, and the
/// initial size of the large class.
const FEW_ADDRESSES: [usize; 2] = [128 << 10, 1 << 20];

fn with_few_addresses(limits: Limits) -> Limits {
    let [small_bytes, large_initial_bytes] = FEW_ADDRESSES;
    Limits {
        small_bytes: limits.small_bytes.min(small_bytes),
        large_initial_bytes: limits.large_initial_bytes.min(large_initial_bytes),
        ..limits
    }
}

impl HostOptions {
    /// Returns the bytes of shared memory that a broker takes or keeps free, without documents.
    /// These are its own needs, those of each expected peer, and the reserve.
    pub fn shared_memory_bytes(&self) -> u64 {
        let services = Services::new(&self.limits());
        let peers = self.expected_peers as u64 * services.peer_bytes();
        services.broker_bytes() + peers + fitting_reserve(self.shm_reserve_bytes)
    }

    /// Returns the bytes of address space that a broker needs at least, and for all limits.
    pub fn address_bytes(&self) -> (u64, u64) {
        let all = self.limits();
        let needed = |limits: &Limits| Services::new(limits).address_bytes();
        (needed(&self.least(all)), needed(&all))
    }

    /// Returns the limits of a bus for small images only and for few peers.
    fn least(&self, limits: Limits) -> Limits {
        Limits {
            peers: limits.peers.min(self.expected_peers + 1),
            ..with_few_addresses(limits)
        }
    }

    /// Returns the limits of the bus that fit into a limited address space.
    pub(crate) fn limits_within(&self, space: Option<u64>) -> Result<Limits, StartError> {
        let limits = self.limits();
        let Some(space) = space else {
            return Ok(limits);
        };
        let (less, least) = (with_few_addresses(limits), self.least(limits));
        let needed = |limits: &Limits| Services::new(limits).address_bytes();
        let fits = [limits, less, least]
            .into_iter()
            .find(|it| needed(it) <= space);
        fits.ok_or_else(|| StartError::AddressSpace {
            limit: space,
            needed: needed(&least),
        })
    }

    fn limits(&self) -> Limits {
        let most_held = |active: usize| active + active.div_ceil(2) + 2;
        let small_active = self.active_documents.max(1);
        let large_active = self.large_active_documents.max(1);
        Limits {
            peers: self.max_peers.max(1),
            small_active,
            small_held: most_held(small_active),
            small_bytes: self.small_class_bytes.max(4 << 10),
            large_active,
            large_held: most_held(large_active),
            ..Limits::default()
        }
    }
}

/// Reason why the bus cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// Another broker serves this instance.
    #[error("instance `{instance}` is already served{}", .pid.map(|pid| format!(" by process {pid}")).unwrap_or_default())]
    AlreadyRunning {
        /// The instance.
        instance: String,
        /// Process id of the other broker.
        pid: Option<u32>,
    },
    /// The runtime directory cannot be used.
    #[error(transparent)]
    Instance(#[from] InstanceError),
    /// A file in the runtime directory cannot be written.
    #[error("cannot write to the runtime directory: {0}")]
    Io(#[from] std::io::Error),
    /// There is no room for the bus itself. Without this check, the first write raises SIGBUS.
    #[error(
        "not enough shared memory: {free} of {size} bytes are free in /dev/shm, a broker needs {needed} to start; {}", way_out(*size, *free, *needed)
    )]
    NoSharedMemory {
        /// Size of /dev/shm in bytes.
        size: u64,
        /// Free bytes.
        free: u64,
        /// Bytes that must be free.
        needed: u64,
    },
    /// Shared memory cannot be used, for a reason other than its size.
    #[error(
        "cannot use the shared memory in /dev/shm: {source}{}",
        shared_memory_way_out(source)
    )]
    SharedMemory {
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The address space limit of the process is too small for the bus.
    #[error(
        "the address space of this process is limited to {limit} bytes (`ulimit -v`), but a broker for this many \
         bundles needs {needed}; raise it with `ulimit -v unlimited`"
    )]
    AddressSpace {
        /// The limit, in bytes.
        limit: u64,
        /// Sufficient bytes of address space.
        needed: u64,
    },
    /// The bus refuses, with this error text.
    #[error("the bus refused: {0}")]
    Bus(String),
}

impl StartError {
    pub(crate) fn shared_memory(source: std::io::Error) -> StartError {
        StartError::SharedMemory { source }
    }

    /// Returns the error for a failed reservation, although enough bytes were free a moment ago.
    pub(crate) fn no_room(source: std::io::Error, needed: u64) -> StartError {
        let is_full = source.kind() == std::io::ErrorKind::StorageFull;
        match SharedMemory::now() {
            Ok(SharedMemory { size, free }) if is_full && free < needed => {
                StartError::NoSharedMemory { size, free, needed }
            }
            _ => StartError::SharedMemory { source },
        }
    }

    /// Checks whether the error may pass by itself when others release shared memory.
    pub fn may_pass(&self) -> bool {
        match self {
            StartError::NoSharedMemory { size, needed, .. } => needed <= size,
            StartError::SharedMemory { source } => source.kind() == std::io::ErrorKind::StorageFull,
            _ => false,
        }
    }
}

/// Step of recommended sizes in bytes. Round sizes are easy to remember.
const STEP: u64 = 64 << 20;

fn shared_memory_way_out(source: &std::io::Error) -> &'static str {
    match source.kind() {
        std::io::ErrorKind::ReadOnlyFilesystem => {
            "; make it writable: `mount -o remount,rw /dev/shm`"
        }
        std::io::ErrorKind::PermissionDenied => {
            "; let this user create directories there: `chmod 1777 /dev/shm`"
        }
        _ => "",
    }
}

fn way_out(size: u64, free: u64, needed: u64) -> String {
    let taken = size.saturating_sub(free);
    // The size covers the needs of the bus and as much again for documents.
    let wanted = taken.saturating_add(needed.saturating_mul(2));
    let advised = wanted.div_ceil(STEP).saturating_mul(STEP) >> 20;
    let make = format!(
        "make it larger: `mount -o remount,size={advised}M /dev/shm`, for a container `docker run --shm-size={advised}m`"
    );
    match needed <= size {
        true => format!("wait until other processes end, remove what they left there, or {make}"),
        false => make,
    }
}

impl From<PortError> for StartError {
    fn from(error: PortError) -> Self {
        StartError::Bus(error.to_string())
    }
}
