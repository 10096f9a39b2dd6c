// SPDX-License-Identifier: MIT
//! A small C interface over iceoryx2 blackboards: nodes and images.
//!
//! This is the only place that knows iceoryx2. Two kinds of function:
//!
//! * cold (`..._open`, `..._close`, forget): allocate, make system
//!   calls and may panic somewhere upstream. Each runs inside `guard`, so that
//!   a panic becomes -ENOTRECOVERABLE instead of the end of the host process
//!   (which may be LinuxCNC's rtapi_app).
//! * hot (`..._write`, `_loan`, `_commit`, `_read`): a copy and a few atomic
//!   operations on memory that is already mapped. Nothing in them can panic.
//!
//! Handles are used by one thread at a time, except that one thread may use
//! the hot functions of an image while another one uses cold functions of the
//! same node; iceoryx2's handles are made for that (they are `Send`, and hold
//! plain pointers into the mapping).

mod cells;
mod image;
mod layout;
mod mapping;
mod members;
mod node;
mod segment;
mod service;

use std::any::Any;
use std::ffi::{c_char, c_int, CStr};
use std::panic::{catch_unwind, AssertUnwindSafe};

/// What a cold function says besides its -errno: upstream's own word.
#[repr(C)]
pub struct Error {
    text: [u8; 64],
}

impl Error {
    fn say(&mut self, what: &str) {
        let n = what.len().min(self.text.len() - 1);
        self.text[..n].copy_from_slice(&what.as_bytes()[..n]);
        self.text[n] = 0;
    }
}

/// -errno and the word for it.
struct Failure(c_int, String);

type Outcome = Result<c_int, Failure>;

impl Failure {
    fn invalid(what: &str) -> Self {
        Failure(-libc_errno::EINVAL, what.to_string())
    }

    /// Upstream's errors are enums whose Debug form is their name.
    fn from_debug<E: core::fmt::Debug>(error: E) -> Self {
        let name = format!("{error:?}");
        Failure(-errno_of(&name), name)
    }
}

/// The few errno values used here, as on every Linux architecture Debian has.
mod libc_errno {
    use std::ffi::c_int;
    pub const ENOENT: c_int = 2;
    pub const EINTR: c_int = 4;
    pub const EIO: c_int = 5;
    pub const EAGAIN: c_int = 11;
    pub const EACCES: c_int = 13;
    pub const EBUSY: c_int = 16;
    pub const EEXIST: c_int = 17;
    pub const EINVAL: c_int = 22;
    pub const EDEADLK: c_int = 35;
    pub const EPROTO: c_int = 71;
    pub const EBADMSG: c_int = 74;
    pub const EUSERS: c_int = 87;
    pub const EPROTONOSUPPORT: c_int = 93;
    pub const ENOTRECOVERABLE: c_int = 131;
}

fn errno_of(name: &str) -> c_int {
    use libc_errno::*;
    match name {
        "DoesNotExist" => ENOENT,
        "InsufficientPermissions" => EACCES,
        "AlreadyExists" => EEXIST,
        "ExceedsMaxSupportedWriters" => EBUSY,
        "ExceedsMaxSupportedReaders" | "ExceedsMaxNumberOfNodes" => EUSERS,
        "EntryDoesNotExist" | "IncompatibleKeys" | "IncompatibleMessagingPattern" => EPROTO,
        "VersionMismatch" => EPROTONOSUPPORT,
        "HangsInCreation" | "IsMarkedForDestruction" | "IsBeingCreatedByAnotherInstance" => EAGAIN,
        "ServiceInCorruptedState" => EBADMSG,
        "InterruptSignal" => EINTR,
        _ => EIO,
    }
}

fn panic_text(payload: &(dyn Any + Send)) -> String {
    match (
        payload.downcast_ref::<&str>(),
        payload.downcast_ref::<String>(),
    ) {
        (Some(text), _) => format!("panic: {text}"),
        (_, Some(text)) => format!("panic: {text}"),
        _ => "panic".to_string(),
    }
}

/// Run a cold function; nothing may unwind into C.
fn guard<F: FnOnce() -> Outcome>(error: *mut Error, cold: F) -> c_int {
    segment::take_found();
    let (code, text) = match catch_unwind(AssertUnwindSafe(cold)) {
        Ok(Ok(value)) => return value,
        Ok(Err(Failure(code, text))) => (code, text),
        Err(payload) => (-libc_errno::ENOTRECOVERABLE, panic_text(&*payload)),
    };
    let (code, text) = match segment::take_found() {
        Some((errno, found)) => (-errno, found.to_string()),
        None => (code, text),
    };
    if let Some(error) = unsafe { error.as_mut() } {
        error.say(&text);
    }
    code
}

/// # Safety
/// `text` is NULL or a NUL terminated string that outlives the call.
unsafe fn string<'a>(text: *const c_char) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(Failure::invalid("a name is missing"));
    }
    unsafe { CStr::from_ptr(text) }
        .to_str()
        .map_err(|_| Failure::invalid("a name is not UTF-8"))
}

/// For a test of the border: a panic must come out as -ENOTRECOVERABLE.
#[no_mangle]
pub extern "C" fn iox_test_panic(error: *mut Error) -> c_int {
    guard(error, || panic!("test"))
}
