//! The heap of the C library: quick where there are many small pieces, and what a flood of findings took is
//! given back.
//!
//! The C library keeps one heap for every few threads and returns a heap's memory only from its
//! end. Results are read, pooled and written by many threads, so that after a flood most of what
//! they once took would stay with the process: 850 MiB after thirty results of 20 MB each, where
//! two heaps hold half of it and giving back what lies free leaves a tenth.

/// Lets all threads share two heaps. To be called before there are threads.
pub fn share_heaps() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    set(libc::M_ARENA_MAX, 2);
}

/// Free pieces are joined with their neighbours as they come, however small. To be called before there
/// are threads.
///
/// The C library keeps the smallest apart and joins them all whenever somebody wants a large piece, with the
/// heap locked for all others. One result frees thousands of them: writers took a tenth more time.
pub fn join_small_pieces() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    set(libc::M_MXFAST, 0);
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn set(parameter: libc::c_int, value: libc::c_int) {
    #[expect(unsafe_code, reason = "the C library has no safe interface for this")]
    // SAFETY: it takes two numbers, keeps nothing, and touches no memory of ours.
    let done = unsafe { libc::mallopt(parameter, value) };
    if done == 0 {
        tracing::debug!(parameter, "the C library keeps its heaps as they are");
    }
}

/// Gives free memory back to the system. Takes milliseconds for a large heap.
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        #[expect(unsafe_code, reason = "the C library has no safe interface for this")]
        // SAFETY: it may be called at any time from any thread; no allocation is moved.
        unsafe {
            libc::malloc_trim(0);
        }
    }
}
