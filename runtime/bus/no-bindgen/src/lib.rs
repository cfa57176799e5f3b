//! Empty replacement of bindgen.
//!
//! iceoryx2 declares bindgen as a build dependency on every system, but its build script calls it
//! on QNX only. The real crate brings 14 others and takes 22 s of CPU time, and iceoryx2 waits for
//! it. `[patch.crates-io]` in the workspace puts this crate in its place.
