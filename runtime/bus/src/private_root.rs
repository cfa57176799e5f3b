//! iceoryx2 within a private root directory.
//!
//! Its standard service creates shared memory by `shm_open`, directly in /dev/shm. There every user
//! sees the names and may take the next ones first. An intermediate segment is writable by
//! everybody, whatever the umask is. Here everything is a file below the generation's root, which
//! only its user may enter. The root lies in /dev/shm, so it is the same memory.

use std::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::internal::ServiceInternal;
use iceoryx2::service::{Service, ipc_threadsafe};
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_lock_free::mpmc::counting_bit_set::RelocatableCountingBitSet;
use iceoryx2_cal::dynamic_storage::file::Storage;
use iceoryx2_cal::event::trigger::State;
use iceoryx2_cal::event::trigger::unix_datagram_socket::GenericUnixDatagramSocketTrigger;
use iceoryx2_cal::resizable_shared_memory::dynamic::DynamicMemory;
use iceoryx2_cal::serialize::postcard::Postcard;
use iceoryx2_cal::shared_memory::file::Memory;
use iceoryx2_cal::shm_allocator::bump_allocator::BumpAllocator;
use iceoryx2_cal::shm_allocator::pool_allocator::PoolAllocator;
use iceoryx2_cal::zero_copy_connection;

type Ipc = ipc_threadsafe::Service;

/// Like [`ipc_threadsafe`], with files instead of `shm_open`.
#[derive(Debug, Clone)]
pub(crate) struct PrivateRoot {}

impl Service for PrivateRoot {
    type ServiceNameHasher = <Ipc as Service>::ServiceNameHasher;
    type StaticStorage = <Ipc as Service>::StaticStorage;
    /// The usual choice is TOML. Its readers were the largest functions of this crate.
    type ConfigSerializer = Postcard;
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Storage<T>;
    type Bag = <Ipc as Service>::Bag;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Storage<T>;
    type SharedMemory = Memory<PoolAllocator>;
    type ResizableSharedMemory = DynamicMemory<PoolAllocator, Memory<PoolAllocator>>;
    type Connection = zero_copy_connection::file::Connection;
    type Event = GenericUnixDatagramSocketTrigger<
        RelocatableCountingBitSet,
        Storage<State<RelocatableCountingBitSet, ()>>,
    >;
    type Monitoring = <Ipc as Service>::Monitoring;
    type Reactor = <Ipc as Service>::Reactor;
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> =
        <Ipc as Service>::ArcThreadSafetyPolicy<T>;
    type BlackboardMgmt<T: Send + Sync + Debug + ZeroCopySend + 'static> = Storage<T>;
    type BlackboardPayload = Memory<BumpAllocator>;
    type UniqueId = <Ipc as Service>::UniqueId;
}

impl ServiceInternal<PrivateRoot> for PrivateRoot {}
