//! Settings for the heap of the C library: fast handling of many small blocks, and return of memory after a flood of
//! findings.
//!
//! The C library keeps one heap for every few threads and returns a heap's memory only from its end. Many threads
//! read, pool and write results, so the process would keep most of the memory after a flood: 850 MiB after thirty
//! results of 20 MB each. Two heaps keep half of that, and returning the free memory leaves a tenth.

/// Lets all threads share two heaps. Must be called before other threads exist.
pub fn share_heaps() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    set(libc::M_ARENA_MAX, 2);
}

/// Merges free blocks with their neighbours immediately, however small they are. Must be called before other threads
/// exist.
///
/// By default the C library keeps the smallest blocks apart. It merges them all on each large allocation and locks
/// the heap for all other threads. One result frees thousands of them: writers took a tenth more time.
pub fn join_small_pieces() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    set(libc::M_MXFAST, 0);
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn set(parameter: libc::c_int, value: libc::c_int) {
    #[expect(unsafe_code, reason = "the C library has no safe interface for this")]
    // SAFETY: the function takes two numbers, keeps no reference, and does not touch memory of this program.
    let done = unsafe { libc::mallopt(parameter, value) };
    if done == 0 {
        tracing::debug!(parameter, "the C library rejected the heap setting");
    }
}

/// Returns free memory to the system. This takes milliseconds for a large heap.
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        #[expect(unsafe_code, reason = "the C library has no safe interface for this")]
        // SAFETY: the function may be called at any time from any thread. It moves no allocation.
        unsafe {
            libc::malloc_trim(0);
        }
    }
}
