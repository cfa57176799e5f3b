//! The pages of shared memory behind a slot: allocates them before writing, and releases unneeded
//! ones.

use std::sync::OnceLock;

/// Makes the kernel allocate the pages now. Otherwise the first write to an unavailable page raises
/// SIGBUS; here it is an error. Kernels before 5.14 do not know the request. There the reserve
/// alone must suffice.
///
/// Allocating pages takes as long as parsing the data for them, so several threads allocate many.
pub(crate) fn back_with_memory<T: Send>(blocks: &mut [T]) -> Result<(), ()> {
    let parts = (size_of_val(blocks) / PART).min(cores()).min(MOST_PARTS);
    let done = match parts {
        0 | 1 => populate(blocks),
        _ => populate_by(parts, blocks),
    };
    match done {
        Ok(()) | Err(rustix::io::Errno::INVAL) => Ok(()),
        Err(error) => {
            tracing::debug!(%error, "cannot allocate shared memory");
            give_up(blocks);
            Err(())
        }
    }
}

/// Minimum bytes for each thread that allocates pages, which takes it milliseconds.
const PART: usize = 4 << 20;

/// Maximum number of threads: more would wait for each other in the kernel.
const MOST_PARTS: usize = 4;

fn cores() -> usize {
    static CORES: OnceLock<usize> = OnceLock::new();
    *CORES.get_or_init(|| std::thread::available_parallelism().map_or(1, usize::from))
}

fn populate_by<T: Send>(parts: usize, blocks: &mut [T]) -> Result<(), rustix::io::Errno> {
    let len = blocks.len().div_ceil(parts).max(1);
    let all_asked = std::thread::scope(|scope| {
        let mut parts = blocks.chunks_mut(len);
        let own = parts.next();
        let ask = |part| {
            let thread = std::thread::Builder::new().name("qcbus-pages".to_owned());
            thread.spawn_scoped(scope, || populate(part))
        };
        let others: Vec<_> = parts.map(ask).collect();
        let done = own.map_or(Ok(()), populate);
        others.into_iter().try_fold(done, |done, thread| {
            // If a thread cannot be started, this thread populates all parts.
            let other = thread.ok()?.join().ok()?;
            Some(done.and(other))
        })
    });
    all_asked.unwrap_or_else(|| populate(blocks))
}

fn populate<T>(blocks: &mut [T]) -> Result<(), rustix::io::Errno> {
    let page = rustix::param::page_size();
    let start = blocks.as_mut_ptr().addr();
    let lead = start % page;
    let first: *mut std::ffi::c_void = blocks.as_mut_ptr().cast::<u8>().wrapping_sub(lead).cast();
    let len = (lead + size_of_val(blocks)).next_multiple_of(page);
    #[expect(unsafe_code, reason = "madvise takes raw pointers")]
    // SAFETY: populating pages changes no byte. The range is that of the lent slot, widened to
    // whole pages, which belong to the same mapping.
    unsafe {
        rustix::mm::madvise(first, len, rustix::mm::Advice::LinuxPopulateWrite)
    }
}

/// Releases the allocated memory of a slot that is too large.
fn give_up<T>(blocks: &mut [T]) {
    take_memory_from(blocks.as_mut_ptr().cast(), size_of_val(blocks));
}

/// Makes the kernel release the pages that belong to this slot only. They read as zeroes until they
/// are written again.
pub(crate) fn take_memory_from(start: *mut u8, len: usize) {
    let page = rustix::param::page_size();
    let lead = start.addr().next_multiple_of(page) - start.addr();
    let whole = len.saturating_sub(lead) / page * page;
    if whole == 0 {
        return;
    }
    let first: *mut std::ffi::c_void = start.wrapping_add(lead).cast();
    #[expect(unsafe_code, reason = "madvise takes raw pointers")]
    // SAFETY: the pages lie wholly in a slot that is lent to this process. At least this much of it
    // was requested before. No other code reads or writes it. The kernel zeroes the pages, which is
    // a valid value of every block.
    let done = unsafe { rustix::mm::madvise(first, whole, rustix::mm::Advice::LinuxRemove) };
    if let Err(error) = done {
        tracing::warn!(%error, "cannot release shared memory");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the bytes of this process's resident pages.
    fn resident() -> usize {
        let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
        let pages = statm.split(' ').nth(1).and_then(|it| it.parse().ok());
        pages.unwrap_or(0) * rustix::param::page_size()
    }

    #[test]
    fn every_page_is_populated_by_any_number_of_threads() {
        const LEN: usize = 64 << 20;
        for parts in [1, 2, 3, 7] {
            let mut room: Vec<u8> = Vec::with_capacity(LEN);
            let before = resident();
            assert_eq!(populate_by(parts, room.spare_capacity_mut()), Ok(()));
            let come = resident().saturating_sub(before);
            // Other tests of this process allocate and release some.
            assert!(come > LEN - (8 << 20), "{come} bytes by {parts}");
        }
    }

    #[test]
    fn few_or_no_pages_are_populated() {
        let mut small = [0u8; 16];
        assert_eq!(back_with_memory(&mut small), Ok(()));
        assert_eq!(populate_by(4, &mut small), Ok(()));
        let mut none: [u8; 0] = [];
        assert_eq!(populate_by(2, &mut none), Ok(()));
        assert_eq!(small, [0; 16]);
    }
}
