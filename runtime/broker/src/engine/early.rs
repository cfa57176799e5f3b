//! What a broker starts before it is there itself.

use qcbus_bus::SharedMemory;

use super::start::{children, shape};
use super::{Inbox, StartError};
use crate::descriptors::Descriptors;
use crate::environment::Children;
use crate::options::Options;
use crate::reload::Loaded;

/// The first generation of an instance that nobody has used.
const FIRST_GENERATION: u64 = 1;

/// Where a broker is the first and the last of its instance, what it is going to start is known beforehand. When it
/// cannot be started yet, or the broker is not the first, it is started later; and nothing is where the bus has no
/// room, which is waited for and tried again and again.
pub(super) fn early_children(
    options: &mut Options,
    loaded: &Loaded,
    descriptors: Descriptors,
    inbox: &Inbox,
) -> Option<Children> {
    if options.watch || !options.die_with_broker {
        return None;
    }
    let needed = shape(options, loaded).shared_memory_bytes();
    let memory = SharedMemory::now().ok()?;
    if memory.size > 0 && memory.free < needed {
        return None;
    }
    options.settings.generation = FIRST_GENERATION;
    let mut children = children(options, descriptors, inbox).ok()?;
    children.start_early(&loaded.children);
    Some(children)
}

/// Those that were started early, if they are this broker's.
pub(super) fn early_or_now(
    early: Option<Children>,
    options: &Options,
    descriptors: Descriptors,
    inbox: &Inbox,
) -> Result<Children, StartError> {
    let own = early.filter(|it| it.are_of(options.settings.generation));
    own.map_or_else(|| children(options, descriptors, inbox), Ok)
}
