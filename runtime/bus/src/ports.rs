//! The one place that configures iceoryx2 and creates services and ports.
//!
//! Every service is created from a row of [`qcbus_messages::services`]; there is no other way.

use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::{event, publish_subscribe};
use qcbus_messages::services::{Growth, Topic, Wake};

use crate::memory::Backing;
pub(crate) use crate::private_root::PrivateRoot as Service;
use crate::removal_lock::Inside;

pub(crate) type Pub<T, H> = Publisher<Service, [T], H>;
pub(crate) type Sub<T, H> = Subscriber<Service, [T], H>;
pub(crate) type TopicService<T, H> = publish_subscribe::PortFactory<Service, [T], H>;
pub(crate) type WakeService = event::PortFactory<Service>;
pub(crate) type WakeListener = Listener<Service>;
pub(crate) type WakeNotifier = Notifier<Service>;

/// Version of the linked iceoryx2. Both sides must have the same version.
pub const ICEORYX2_VERSION: &str = "0.10.0";

/// Error of iceoryx2 as text. The error types of iceoryx2 are not exposed: callers can only report
/// them to a person.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {why}")]
pub(crate) struct PortError {
    what: String,
    why: String,
}

impl PortError {
    /// Returns the error for a descriptor that cannot be waited on.
    pub(crate) fn waiting(why: &std::io::Error) -> PortError {
        PortError {
            what: "waiting for the other side".to_owned(),
            why: why.to_string(),
        }
    }

    /// Returns the error for missing shared memory for a topic's slots.
    fn memory(row: &Topic, why: &std::io::Error) -> PortError {
        PortError {
            what: format!("shared memory for {}", row.name),
            why: why.to_string(),
        }
    }

    /// Returns the error for missing shared memory for another peer.
    pub(crate) fn no_room(needed: u64, free: u64) -> PortError {
        PortError {
            what: "joining".to_owned(),
            why: format!(
                "not enough shared memory: {needed} bytes are needed, {free} are free in /dev/shm; make it larger"
            ),
        }
    }
}

fn error(what: impl Into<String>) -> impl FnOnce(Box<dyn Debug>) -> PortError {
    let what = what.into();
    move |why| PortError {
        what,
        why: format!("{why:?}"),
    }
}

/// Adds a description to an error of iceoryx2.
trait Explain<T> {
    fn explain(self, what: impl Into<String>) -> Result<T, PortError>;
}

impl<T, E: Debug + 'static> Explain<T> for Result<T, E> {
    fn explain(self, what: impl Into<String>) -> Result<T, PortError> {
        self.map_err(|why| error(what)(Box::new(why)))
    }
}

/// How a process gets a service: the broker creates it, all others open it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Access {
    Create,
    Open,
}

/// The node of one process in one generation.
pub(crate) struct Hub {
    node: Node<Service>,
    access: Access,
    /// Root directory of the generation.
    root: PathBuf,
}

/// Prefix of the files of iceoryx2. It is short because some of them are sockets. They lie in a
/// directory of their own, so the prefix need not distinguish them from others.
const PREFIX: &[u8] = b"q_";

/// Returns the settings of iceoryx2 for one generation. The global settings are never used, because
/// they come from a file in the working directory.
pub(crate) fn generation_config(root: &Path) -> Result<Config, PortError> {
    let mut config = Config::default();
    let root = iceoryx2::prelude::Path::new(root.as_os_str().as_encoded_bytes())
        .explain("the runtime directory's path")?;
    config.global.set_root_path(&root);
    config.global.prefix = FileName::new(PREFIX).explain("the prefix")?;
    config.global.creation_timeout = Duration::from_millis(500);
    // Only the broker's janitor cleans up dead nodes. Peers must not do so, and the broker's loop
    // cannot spend 20 ms on it.
    config.global.service.cleanup_dead_nodes_on_open = false;
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config
        .defaults
        .publish_subscribe
        .subscriber_expired_connection_buffer = 16;
    Ok(config)
}

impl Hub {
    /// Creates the broker's hub, which creates all services.
    pub(crate) fn create(root: &Path) -> Result<Hub, PortError> {
        Hub::new(root, Access::Create)
    }

    /// Joins a generation. Its memory cannot be removed meanwhile.
    pub(crate) fn join(inside: &Inside) -> Result<Hub, PortError> {
        Hub::new(inside.root(), Access::Open)
    }

    fn new(root: &Path, access: Access) -> Result<Hub, PortError> {
        // iceoryx2 reports errors as values, so its own output is disabled.
        set_log_level_from_env_or(LogLevel::Fatal);
        let config = generation_config(root)?;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .explain("the node")?;
        let root = root.to_path_buf();
        Ok(Hub { node, access, root })
    }

    /// Creates a publisher of a stream, with the memory that its slots need.
    pub(crate) fn stream_publisher<H>(
        &self,
        service: &TopicService<u8, H>,
        row: &Topic,
    ) -> Result<(Pub<u8, H>, Backing), PortError>
    where
        H: Debug + ZeroCopySend + 'static,
    {
        let publisher = publisher(service, row, row.loans)?;
        let backing = Backing::of(&self.root, publisher.id().value());
        let backing = backing.map_err(|why| PortError::memory(row, &why))?;
        Ok((publisher, backing))
    }

    /// Creates a publisher with few and small slots. All their memory is allocated at once.
    pub(crate) fn small_publisher<H>(
        &self,
        service: &TopicService<u8, H>,
        row: &Topic,
    ) -> Result<Pub<u8, H>, PortError>
    where
        H: Debug + ZeroCopySend + 'static,
    {
        let publisher = publisher(service, row, row.loans)?;
        Backing::whole(&self.root, publisher.id().value())
            .map_err(|why| PortError::memory(row, &why))?;
        Ok(publisher)
    }

    /// Creates or opens a publish-subscribe service; the only constructor of these. `key`
    /// distinguishes the services of one session. It is empty for shared ones.
    pub(crate) fn topic<T, H>(
        &self,
        row: &Topic,
        key: &str,
    ) -> Result<TopicService<T, H>, PortError>
    where
        T: Debug + ZeroCopySend + 'static,
        H: Debug + ZeroCopySend + 'static,
    {
        debug_assert_eq!(size_of::<T>(), row.element, "{}", row.name);
        let name = service_name(row.name, key)?;
        let builder = self
            .node
            .service_builder(&name)
            .publish_subscribe::<[T]>()
            .user_header::<H>()
            .enable_safe_overflow(row.overflow)
            .max_publishers(row.publishers)
            .max_subscribers(row.subscribers)
            .max_nodes(row.nodes)
            .history_size(row.history)
            .subscriber_max_buffer_size(row.buffer)
            .subscriber_max_borrowed_samples(row.borrowed);
        match self.access {
            Access::Create => builder.create().explain(format!("creating {name}")),
            Access::Open => builder.open().explain(format!("opening {name}")),
        }
    }

    /// Creates or opens an event service; the only constructor of these.
    pub(crate) fn wake(&self, row: &Wake, key: &str) -> Result<WakeService, PortError> {
        let name = service_name(row.name, key)?;
        let builder = self
            .node
            .service_builder(&name)
            .event()
            .max_notifiers(row.notifiers)
            .max_listeners(row.listeners)
            .max_nodes(row.nodes)
            .event_id_max_value(row.max_event_id);
        match self.access {
            Access::Create => builder
                .disable_deadline()
                .disable_notifier_created_event()
                .disable_notifier_dropped_event()
                .disable_notifier_dead_event()
                .create()
                .explain(format!("creating {name}")),
            Access::Open => builder.open().explain(format!("opening {name}")),
        }
    }
}

fn service_name(name: &str, key: &str) -> Result<ServiceName, PortError> {
    let full = if key.is_empty() {
        name.to_owned()
    } else {
        format!("{name}/{key}")
    };
    ServiceName::new(&full).explain(full)
}

/// Creates a publisher with the settings of its row. The number of slots lent at once is that of
/// the row, or all if the caller counts them itself.
pub(crate) fn publisher<T, H>(
    service: &TopicService<T, H>,
    row: &Topic,
    loans: usize,
) -> Result<Pub<T, H>, PortError>
where
    T: Debug + ZeroCopySend + 'static,
    H: Debug + ZeroCopySend + 'static,
{
    let slots = row.slots();
    service
        .publisher_builder()
        .initial_max_slice_len(row.elements)
        .allocation_strategy(match row.growth {
            Growth::Fixed => AllocationStrategy::Static,
            Growth::PowerOfTwo => AllocationStrategy::PowerOfTwo,
        })
        .max_loaned_samples(loans)
        .override_sample_preallocation(move |_| slots)
        // No sender on this bus ever blocks. It learns that a frame was not taken and keeps it.
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .explain(format!("a publisher of {}", row.name))
}

/// Creates a subscriber with the settings of its row.
pub(crate) fn subscriber<T, H>(
    service: &TopicService<T, H>,
    row: &Topic,
) -> Result<Sub<T, H>, PortError>
where
    T: Debug + ZeroCopySend + 'static,
    H: Debug + ZeroCopySend + 'static,
{
    service
        .subscriber_builder()
        .buffer_size(row.buffer)
        .history_request(row.history)
        .create()
        .explain(format!("a subscriber of {}", row.name))
}

/// Creates the port that wakes the other side.
pub(crate) fn notifier(service: &WakeService) -> Result<WakeNotifier, PortError> {
    service
        .notifier_builder()
        .default_event_id(EventId::new(0))
        .create()
        .explain("a notifier")
}

/// Creates the port that is woken by the other side.
pub(crate) fn listener(service: &WakeService) -> Result<WakeListener, PortError> {
    service.listener_builder().create().explain("a listener")
}

/// Removes the remains of dead processes of a generation. It takes 6 to 20 ms per dead process, so
/// it must be called outside the loop.
pub(crate) fn clean_dead_nodes(config: &Config) {
    let mut dead = Vec::new();
    let listed = Node::<Service>::list(config, |state| {
        if let NodeState::Dead(view) = state {
            dead.push(view);
        }
        CallbackProgression::Continue
    });
    if let Err(why) = listed {
        tracing::debug!(?why, "cannot list the nodes of this generation");
    }
    for view in dead {
        if let Err(why) = view.try_remove_stale_resources() {
            tracing::debug!(?why, "cannot clean up a dead node");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use iceoryx2::service::static_config::publish_subscribe::StaticConfig;
    use qcbus_messages::services::{Limits, Services};

    use super::*;
    use crate::mapped_image::{Block, DocumentHeader};

    fn assert_as_written(row: &Topic, made: &StaticConfig) {
        let numbers = (
            made.max_publishers(),
            made.max_subscribers(),
            made.max_nodes(),
            made.subscriber_max_buffer_size(),
            made.subscriber_max_borrowed_samples(),
            made.history_size(),
        );
        let wanted = (
            row.publishers,
            row.subscribers,
            row.nodes,
            row.buffer,
            row.borrowed,
            row.history,
        );
        assert_eq!(numbers, wanted, "{}", row.name);
        assert_eq!(made.has_safe_overflow(), row.overflow, "{}", row.name);
        let payload = &made.message_type_details().payload;
        assert_eq!(
            (payload.size(), payload.alignment()),
            (row.element, row.element)
        );
    }

    #[test]
    fn services_match_the_table() {
        let dir = tempfile::TempDir::new().unwrap();
        let instance = crate::Instance::at(dir.path().to_owned());
        let limits = Limits::default();
        let generation = crate::generation::Generation::begin(&instance, limits).unwrap();
        let hub = Hub::create(&generation.root).unwrap();
        let services = Services::new(&limits);
        for row in services.topics() {
            if row.element == size_of::<Block>() {
                let service = hub.topic::<Block, DocumentHeader>(&row, "").unwrap();
                assert_as_written(&row, service.static_config());
            } else {
                let service = hub.topic::<u8, u64>(&row, "key").unwrap();
                assert_as_written(&row, service.static_config());
            }
        }
        drop(hub);
        crate::generation::sweep(&instance, None);
    }

    #[test]
    fn only_this_module_creates_services_and_ports() {
        let makers = [
            "service_builder(",
            ".publish_subscribe::<",
            ".publisher_builder(",
            ".subscriber_builder(",
            ".notifier_builder(",
            ".listener_builder(",
            "NodeBuilder",
            "open_or_create",
            "global_config()",
        ];
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let folders = ["src", "src/tests"].map(|folder| package.join(folder));
        for entry in folders.iter().flat_map(|it| fs::read_dir(it).unwrap()) {
            let path = entry.unwrap().path();
            if path.is_dir() || path.ends_with("ports.rs") {
                continue;
            }
            let text = fs::read_to_string(&path).unwrap();
            for maker in makers {
                assert!(
                    !text.contains(maker),
                    "{maker} must not be used in {}",
                    path.display()
                );
            }
        }
    }

    #[test]
    fn version_constant_matches_the_linked_version() {
        let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../Cargo.lock");
        let text = fs::read_to_string(lock).unwrap();
        let linked = format!("name = \"iceoryx2\"\nversion = \"{ICEORYX2_VERSION}\"");
        assert!(text.contains(&linked));
    }
}
