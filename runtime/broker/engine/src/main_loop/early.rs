//! Early start: children that the broker starts before it is complete itself.

use qcbus_bus::SharedMemory;
use qcbus_configuration::Loaded;

use super::start::{children, shape};
use super::{Inbox, StartError};
use crate::backend::{Backend, Processes};
use crate::descriptors::Descriptors;
use crate::options::Options;

/// The first generation of an unused instance.
const FIRST_GENERATION: u64 = 1;

/// Starts the children early. This is possible if the broker is the only one of its instance, because its children
/// are then known beforehand. Otherwise, and if the early start fails, they are started later. If the bus has no
/// room, no child is started early. The broker then retries until room is free.
pub(super) fn early_children(
    backend: &dyn Backend,
    options: &mut Options,
    loaded: &Loaded,
    descriptors: Descriptors,
    inbox: &Inbox,
) -> Option<Box<dyn Processes>> {
    if options.watch || !options.die_with_broker {
        return None;
    }
    let needed = shape(options, loaded).shared_memory_bytes();
    let memory = SharedMemory::now().ok()?;
    if memory.size > 0 && memory.free < needed {
        return None;
    }
    options.settings.generation = FIRST_GENERATION;
    let mut children = children(backend, options, descriptors, inbox).ok()?;
    children.start_early(&loaded.children);
    Some(children)
}

/// Returns the early children if they belong to this broker, or new ones.
pub(super) fn early_or_now(
    backend: &dyn Backend,
    early: Option<Box<dyn Processes>>,
    options: &Options,
    descriptors: Descriptors,
    inbox: &Inbox,
) -> Result<Box<dyn Processes>, StartError> {
    let own = early.filter(|it| it.are_of(options.settings.generation));
    own.map_or_else(|| children(backend, options, descriptors, inbox), Ok)
}
