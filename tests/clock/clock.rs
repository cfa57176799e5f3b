//! A clock that jumps: a library that is loaded before those of a program. It moves the time of day
//! by the number of seconds in the file that `QCBUS_TEST_CLOCK` names. All other clocks stay
//! unchanged. The test that needs it builds it with the compiler alone.

use std::ffi::{c_char, c_int, c_long};

#[repr(C)]
pub struct Time {
    seconds: i64,
    nanoseconds: c_long,
}

unsafe extern "C" {
    fn syscall(number: c_long, ...) -> c_long;
    fn getenv(name: *const c_char) -> *const c_char;
    fn open(path: *const c_char, flags: c_int, ...) -> c_int;
    fn read(descriptor: c_int, bytes: *mut u8, most: usize) -> isize;
    fn close(descriptor: c_int) -> c_int;
}

#[cfg(target_arch = "x86_64")]
const CLOCK_GETTIME: c_long = 228;
#[cfg(target_arch = "aarch64")]
const CLOCK_GETTIME: c_long = 113;
/// Clock id of the time of day.
const REALTIME: c_int = 0;

/// # Safety
/// `time` must be valid for writing, as `clock_gettime(2)` requires.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clock_gettime(clock: c_int, time: *mut Time) -> c_int {
    // SAFETY: the system gets the caller's request, with the caller's memory.
    let answer = unsafe { syscall(CLOCK_GETTIME, c_long::from(clock), time) };
    if answer == 0 && clock == REALTIME {
        // SAFETY: the system has just written to it.
        unsafe { (*time).seconds += jump().unwrap_or(0) };
    }
    answer as c_int
}

/// Returns the seconds of the jump. It allocates no memory, because it is called from anywhere.
fn jump() -> Option<i64> {
    let mut bytes = [0_u8; 32];
    // SAFETY: the name ends with a zero, the path belongs to the environment, and no more is read
    // than there is room for.
    let read = unsafe {
        let path = getenv(c"QCBUS_TEST_CLOCK".as_ptr());
        if path.is_null() {
            return None;
        }
        let descriptor = open(path, 0);
        if descriptor < 0 {
            return None;
        }
        let read = read(descriptor, bytes.as_mut_ptr(), bytes.len());
        close(descriptor);
        read
    };
    let text = bytes.get(..usize::try_from(read).ok()?)?;
    std::str::from_utf8(text).ok()?.trim().parse().ok()
}
