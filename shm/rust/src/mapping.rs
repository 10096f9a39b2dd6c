// SPDX-License-Identifier: MIT
//! Files in memory, and where the copy of a head has its original.
//!
//! iceoryx2 works on a copy of each head (segment.rs). What lies in the copy finds its place in
//! shared memory here, and how far the mapping goes from there.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::ptr;
use std::sync::{Mutex, MutexGuard};

pub struct Mapping {
    pub address: *mut u8,
    length: usize,
}

unsafe impl Send for Mapping {}
unsafe impl Sync for Mapping {}

impl Mapping {
    pub fn of(file: &File, length: usize, writable: bool) -> io::Result<Self> {
        let write = if writable { libc::PROT_WRITE } else { 0 };
        let address = unsafe {
            libc::mmap(
                ptr::null_mut(),
                length,
                libc::PROT_READ | write,
                libc::MAP_SHARED,
                file.as_raw_fd(),
                0,
            )
        };
        if address == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        Ok(Mapping {
            address: address.cast(),
            length,
        })
    }

    /// What is at `offset` has been copied to `copy`.
    pub fn has_copy(&self, copy: *const u8, size: usize, offset: usize) {
        heads().push(Head {
            copy: copy as usize,
            size,
            original: self.address as usize + offset,
            end: self.address as usize + self.length,
        });
    }
}

/// The copy goes.
pub fn forget_copy(copy: *const u8) {
    heads().retain(|head| head.copy != copy as usize);
}

impl Drop for Mapping {
    fn drop(&mut self) {
        unsafe { libc::munmap(self.address.cast(), self.length) };
    }
}

/// The head of an opened segment: where the copy is, and where its original.
struct Head {
    copy: usize,
    size: usize,
    original: usize,
    end: usize,
}

static HEADS: Mutex<Vec<Head>> = Mutex::new(Vec::new());

fn heads() -> MutexGuard<'static, Vec<Head>> {
    HEADS.lock().unwrap_or_else(|broken| broken.into_inner())
}

/// A place in a mapping, and how much of the mapping is left from there on.
pub struct Original {
    pub address: *const u8,
    pub room: usize,
}

/// Where something that lies in the copy of a head is in shared memory. What lies in none is
/// in a segment that is just being made: it is where it is, and nobody else has it yet.
pub fn original(copy: *const u8) -> Original {
    let at = copy as usize;
    let is_in = |head: &&Head| at >= head.copy && at - head.copy < head.size;
    match heads().iter().find(is_in) {
        Some(head) => {
            let address = head.original + (at - head.copy);
            Original {
                address: address as *const u8,
                room: head.end - address,
            }
        }
        None => Original {
            address: copy,
            room: isize::MAX as usize,
        },
    }
}
