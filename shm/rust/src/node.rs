// SPDX-License-Identifier: MIT
//! A node: this process's seat in one root folder.

use crate::service::Files;
use crate::{guard, string, Error, Failure};
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::prelude::*;
use iceoryx2::service::internal::ServiceInternal;
use iceoryx2::service::service_hash::ServiceHash;
use iceoryx2::service::Service;
use iceoryx2::unique_id_generator::UniqueId;
use std::ffi::{c_char, c_int};
use std::mem::transmute;
use std::sync::{Mutex, MutexGuard, Once};
use std::time::Duration;

/// A node, and the services that were made by it.
pub struct NodeHandle(pub Node<Files>, Mutex<Vec<ServiceHash>>);

impl NodeHandle {
    /// It is cleaned up when a process dies that has it open.
    pub fn has_made(&self, name: &ServiceName) {
        let hash = ServiceHash::new::<Hasher>(name, MessagingPattern::Blackboard);
        let mut services = made(&self.1);
        if !services.contains(&hash) {
            services.push(hash);
        }
    }
}

type Hasher = <Files as Service>::ServiceNameHasher;

fn made(services: &Mutex<Vec<ServiceHash>>) -> MutexGuard<'_, Vec<ServiceHash>> {
    services.lock().unwrap_or_else(|broken| broken.into_inner())
}

/// Of this process: whether they live cannot be asked, and they do.
static OURS: Mutex<Vec<u128>> = Mutex::new(Vec::new());

fn ours() -> MutexGuard<'static, Vec<u128>> {
    OURS.lock().unwrap_or_else(|broken| broken.into_inner())
}

fn number(id: &str) -> Result<u128, Failure> {
    id.parse().map_err(|_| Failure::invalid("node"))
}

const _: () = assert!(size_of::<UniqueId>() == size_of::<UniqueNodeId>());

/// Both are one structure in another (repr(C)).
fn node_id(number: u128) -> UniqueNodeId {
    unsafe { transmute::<UniqueId, UniqueNodeId>(UniqueId::from_raw_id(number)) }
}

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
    // Only the daemon cleans up (reap.c), which does not believe what a dead node has written.
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
        ours().push(node.id().value());
        let handle = NodeHandle(node, Mutex::new(Vec::new()));
        unsafe { *out = Box::into_raw(Box::new(handle)) };
        Ok(0)
    })
}

/// A node of this process?
///
/// # Safety
/// `id` is NUL terminated: its number, as in the names of its files. Cold.
#[no_mangle]
pub unsafe extern "C" fn iox_node_is_ours(id: *const c_char) -> c_int {
    guard(std::ptr::null_mut(), || {
        let id = number(unsafe { string(id) }?)?;
        // iceoryx2 knows the owner of an entry by this half.
        Ok(ours().iter().any(|other| other >> 64 == id >> 64) as c_int)
    })
}

/// Free what a dead node has had in the services that were made by this one. Only its number is
/// used, and our own configuration.
///
/// # Safety
/// `node` comes from iox_node_open, `id` as for iox_node_is_ours. Cold.
#[no_mangle]
pub unsafe extern "C" fn iox_node_forget(
    node: *const NodeHandle,
    id: *const c_char,
    error: *mut Error,
) -> c_int {
    guard(error, || {
        let node = unsafe { &*node };
        let id = node_id(number(unsafe { string(id) }?)?);
        let mut left = Ok(0);
        for service in made(&node.1).iter() {
            // One that is damaged keeps nobody from the others.
            let removed = Files::__internal_remove_node_from_service(&id, service, node.0.config());
            left = left.and(removed.map(|_| 0).map_err(Failure::from_debug));
        }
        left
    })
}

/// # Safety
/// `node` comes from iox_node_open and nothing opened on it is left. Cold.
#[no_mangle]
pub unsafe extern "C" fn iox_node_close(node: *mut NodeHandle) {
    guard(std::ptr::null_mut(), || {
        let node = unsafe { Box::from_raw(node) };
        let id = node.0.id().value();
        drop(node);
        ours().retain(|other| *other != id);
        Ok(0)
    });
}
