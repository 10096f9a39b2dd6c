// SPDX-License-Identifier: MIT
//! Notification: one datagram that wakes whoever waits. Cold on both sides (a
//! new listener costs the notifier allocations).

use crate::node::NodeHandle;
use crate::service::Files;
use crate::{guard, string, Error, Failure};
use iceoryx2::port::{listener::Listener, notifier::Notifier};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::event::PortFactory;
use std::ffi::{c_char, c_int};
use std::time::Duration;

const MAX_LISTENERS: usize = 32;
const MAX_NODES: usize = 2 * MAX_LISTENERS + 8;

/// Fields are dropped in order: the port before its service.
pub struct NotifierHandle {
    port: Notifier<Files>,
    _service: PortFactory<Files>,
}

pub struct ListenerHandle {
    port: Listener<Files>,
    _service: PortFactory<Files>,
}

/// # Safety
/// `node` comes from iox_node_open, `name` is NUL terminated, `out` is valid.
#[no_mangle]
pub unsafe extern "C" fn iox_notifier_open(
    node: *const NodeHandle,
    name: *const c_char,
    out: *mut *mut NotifierHandle,
    error: *mut Error,
) -> c_int {
    guard(error, || {
        let name = ServiceName::new(unsafe { string(name) }?).map_err(Failure::from_debug)?;
        let service = unsafe { &*node }
            .0
            .service_builder(&name)
            .event()
            .max_listeners(MAX_LISTENERS)
            .max_notifiers(1)
            .max_nodes(MAX_NODES)
            .event_id_max_value(0)
            .create()
            .map_err(Failure::from_debug)?;
        let port = service
            .notifier_builder()
            .create()
            .map_err(Failure::from_debug)?;
        let handle = NotifierHandle {
            port,
            _service: service,
        };
        unsafe { *out = Box::into_raw(Box::new(handle)) };
        Ok(0)
    })
}

/// # Safety
/// `notifier` comes from iox_notifier_open.
#[no_mangle]
pub unsafe extern "C" fn iox_notify(notifier: *const NotifierHandle, error: *mut Error) -> c_int {
    guard(error, || {
        let woken = unsafe { &*notifier }
            .port
            .notify()
            .map_err(Failure::from_debug)?;
        Ok(woken as c_int)
    })
}

/// # Safety
/// `notifier` comes from iox_notifier_open and is not used again.
#[no_mangle]
pub unsafe extern "C" fn iox_notifier_close(notifier: *mut NotifierHandle) {
    guard(std::ptr::null_mut(), || {
        drop(unsafe { Box::from_raw(notifier) });
        Ok(0)
    });
}

/// # Safety
/// `node` comes from iox_node_open, `name` is NUL terminated, `out` is valid.
#[no_mangle]
pub unsafe extern "C" fn iox_listener_open(
    node: *const NodeHandle,
    name: *const c_char,
    out: *mut *mut ListenerHandle,
    error: *mut Error,
) -> c_int {
    guard(error, || {
        let name = ServiceName::new(unsafe { string(name) }?).map_err(Failure::from_debug)?;
        let service = unsafe { &*node }
            .0
            .service_builder(&name)
            .event()
            .open()
            .map_err(Failure::from_debug)?;
        let port = service
            .listener_builder()
            .create()
            .map_err(Failure::from_debug)?;
        let handle = ListenerHandle {
            port,
            _service: service,
        };
        unsafe { *out = Box::into_raw(Box::new(handle)) };
        Ok(0)
    })
}

/// How many notifications came, 0 after `milliseconds` without.
///
/// # Safety
/// `listener` comes from iox_listener_open.
#[no_mangle]
pub unsafe extern "C" fn iox_listener_wait(
    listener: *const ListenerHandle,
    milliseconds: u64,
    error: *mut Error,
) -> c_int {
    guard(error, || {
        let mut count = 0;
        unsafe { &*listener }
            .port
            .timed_wait(|_| count = 1, Duration::from_millis(milliseconds))
            .map_err(Failure::from_debug)?;
        Ok(count)
    })
}

/// # Safety
/// `listener` comes from iox_listener_open and is not used again.
#[no_mangle]
pub unsafe extern "C" fn iox_listener_close(listener: *mut ListenerHandle) {
    guard(std::ptr::null_mut(), || {
        drop(unsafe { Box::from_raw(listener) });
        Ok(0)
    });
}
