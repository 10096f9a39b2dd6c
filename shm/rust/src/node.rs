// SPDX-License-Identifier: MIT
//! A node: this process's seat in one root folder.

use crate::service::Files;
use crate::{guard, string, Error, Failure};
use iceoryx2::prelude::*;
use std::ffi::{c_char, c_int};
use std::sync::Once;
use std::time::Duration;

pub struct NodeHandle(pub Node<Files>);

/// Once per process: quiet unless something is really wrong, and no panic
/// message of our own making (guard hands the text to the caller).
fn prepare_process() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        set_log_level(LogLevel::Error);
        std::panic::set_hook(Box::new(|_| {}));
    });
}

fn file_name(name: &[u8]) -> Result<FileName, Failure> {
    FileName::new(name).map_err(|_| Failure::invalid("file name"))
}

/// Everything explicit: without this, iceoryx2 looks for configuration files
/// in $PWD, $HOME and /etc.
fn config(root: &str) -> Result<Config, Failure> {
    let mut config = Config::default();
    let root = Path::new(root.as_bytes()).map_err(|_| Failure::invalid("root path"))?;
    config.global.set_root_path(&root);
    // Short, because sockets live below the root and their paths are limited.
    config.global.prefix = file_name(b"p")?;
    config.global.service.event_connection_suffix = file_name(b".e")?;
    // All is made before it is published; what hangs is broken, not slow.
    config.global.creation_timeout = Duration::from_millis(200);
    // Only iox_node_reap cleans up: the daemon must hear of each dead one.
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    Ok(config)
}

/// # Safety
/// Strings are NUL terminated, `out` is valid. Cold.
#[no_mangle]
pub unsafe extern "C" fn iox_node_open(
    root: *const c_char,
    name: *const c_char,
    out: *mut *mut NodeHandle,
    error: *mut Error,
) -> c_int {
    guard(error, || {
        prepare_process();
        let config = config(unsafe { string(root) }?)?;
        let name = NodeName::new(unsafe { string(name) }?).map_err(Failure::from_debug)?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Files>()
            .map_err(Failure::from_debug)?;
        unsafe { *out = Box::into_raw(Box::new(NodeHandle(node))) };
        Ok(0)
    })
}

/// Clean up after dead processes of this root. How many there were. Cold.
///
/// # Safety
/// `node` comes from iox_node_open.
#[no_mangle]
pub unsafe extern "C" fn iox_node_reap(node: *const NodeHandle, error: *mut Error) -> c_int {
    guard(error, || {
        Ok(unsafe { &*node }.0.try_cleanup_dead_nodes().cleanups as c_int)
    })
}

/// # Safety
/// `node` comes from iox_node_open and nothing opened on it is left. Cold.
#[no_mangle]
pub unsafe extern "C" fn iox_node_close(node: *mut NodeHandle) {
    guard(std::ptr::null_mut(), || {
        drop(unsafe { Box::from_raw(node) });
        Ok(0)
    });
}
