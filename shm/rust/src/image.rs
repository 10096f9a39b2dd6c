// SPDX-License-Identifier: MIT
//! An image: a blackboard with one entry, one writer, many readers.
//!
//! The generic part is written once; the macro at the end gives each image its
//! set of C functions.

use crate::cells::{Cells, Right};
use crate::layout::{
    Judge, PokeysCommand, PokeysDiag, PokeysReport, PokeysState, PokeysWish, Verdict,
};
use crate::libc_errno::{EAGAIN, EDEADLK, EPROTO};
use crate::node::NodeHandle;
use crate::segment::{self, Payload};
use crate::service::Files;
use crate::{guard, string, Error, Failure};
use iceoryx2::port::reader::Reader;
use iceoryx2::port::writer::Writer;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use iceoryx2::service::port_factory::PortFactory as _;
use std::ffi::{c_char, c_int};
use std::fmt::Debug;
use std::{mem, ptr};

/// POKEYS_SHM_READERS in shm.h.
const MAX_READERS: usize = 32;
/// Each reader, writer and the daemon is a node; and dead ones not yet reaped.
const MAX_NODES: usize = 2 * MAX_READERS + 8;
const KEY: u64 = 1;

pub trait Value: ZeroCopySend + Copy + Debug + Judge + 'static {
    /// Its service is written by a commander, not by the daemon.
    const COMMANDERS: bool;
}

/// Holds the service that this process created.
pub struct Image {
    _service: PortFactory<Files, u64>,
}

/// The writer port must live as long as the right: when a process dies, the
/// port is what the one who cleans up finds, and frees the writer's place by.
/// Fields are dropped in order, so the right goes first.
pub struct ImageWriter<T: Value> {
    right: Right<T>,
    loaned: bool,
    _port: Writer<Files, u64>,
    _service: PortFactory<Files, u64>,
}

pub struct ImageReader<T: Value> {
    cells: &'static Cells<T>,
    /// What news() found last.
    last: u64,
    _port: Reader<Files, u64>,
    _service: PortFactory<Files, u64>,
}

unsafe fn service_name(name: *const c_char) -> Result<ServiceName, Failure> {
    ServiceName::new(unsafe { string(name) }?).map_err(Failure::from_debug)
}

unsafe fn open_service(
    node: *const NodeHandle,
    name: *const c_char,
    writes: bool,
) -> Result<(PortFactory<Files, u64>, Option<Payload>), Failure> {
    let name = unsafe { service_name(name) }?;
    let builder = unsafe { &*node }.0.service_builder(&name);
    segment::with_payload(writes, || builder.blackboard_opener::<u64>().open())
        .map_err(Failure::from_debug)
}

/// The value of a service, which is where iceoryx2 puts the first and only one.
fn cells<T>(payload: Option<Payload>) -> Result<&'static Cells<T>, Failure> {
    // iceoryx2 leaves room to align it, which it does not need.
    let size = mem::size_of::<Cells<T>>() + mem::align_of::<Cells<T>>() - 1;
    match payload.filter(|payload| payload.room == size) {
        // It stays mapped as long as the service, which the caller keeps beside it.
        Some(payload) => Ok(unsafe { &*payload.address.cast::<Cells<T>>() }),
        None => Err(Failure(-EPROTO, "a value of another size".to_string())),
    }
}

impl Image {
    unsafe fn create<T: Value>(
        node: *const NodeHandle,
        name: *const c_char,
        first: T,
    ) -> Result<Self, Failure> {
        let name = unsafe { service_name(name) }?;
        let builder = unsafe { &*node }
            .0
            .service_builder(&name)
            .blackboard_creator::<u64>()
            .max_readers(MAX_READERS)
            .max_nodes(MAX_NODES)
            .add::<T>(KEY, first);
        let service = segment::for_commanders(T::COMMANDERS, || builder.create())
            .map_err(Failure::from_debug)?;
        unsafe { &*node }.has_made(&name);
        Ok(Image { _service: service })
    }
}

impl<T: Value> ImageWriter<T> {
    unsafe fn open(node: *const NodeHandle, name: *const c_char) -> Result<Self, Failure> {
        let (service, payload) = unsafe { open_service(node, name, true) }?;
        let cells = cells(payload)?;
        let port = service
            .writer_builder()
            .create()
            .map_err(Failure::from_debug)?;
        let had = || Failure(-EDEADLK, "the right to write is had".to_string());
        Ok(ImageWriter {
            right: Right::take(cells).ok_or_else(had)?,
            loaned: false,
            _port: port,
            _service: service,
        })
    }

    fn loan(&mut self) -> *mut T {
        self.loaned = true;
        self.right.cell()
    }

    fn commit(&mut self) {
        if mem::take(&mut self.loaned) {
            self.right.commit();
        }
    }
}

impl<T: Value> ImageReader<T> {
    unsafe fn open(node: *const NodeHandle, name: *const c_char) -> Result<Self, Failure> {
        let (service, payload) = unsafe { open_service(node, name, false) }?;
        let cells = cells(payload)?;
        let port = service
            .reader_builder()
            .create()
            .map_err(Failure::from_debug)?;
        Ok(ImageReader {
            cells,
            last: 0,
            _port: port,
            _service: service,
        })
    }

    /// 1 = whole and written out, 0 = nobody has written yet, -EPROTO = not ours, -EAGAIN =
    /// somebody writes without a pause.
    #[inline(always)]
    unsafe fn read(&self, out: *mut T) -> c_int {
        let Some(copy) = self.cells.read() else {
            return -EAGAIN;
        };
        let value = unsafe { copy.assume_init_ref() };
        match value.judge() {
            Verdict::Whole => {
                unsafe { out.write(*value) };
                1
            }
            Verdict::Empty => 0,
            Verdict::Foreign => -EPROTO,
        }
    }

    /// The same with one copy less, and anything in `out` unless 1 is returned.
    #[inline(always)]
    unsafe fn read_into(&self, out: *mut T) -> c_int {
        if !unsafe { self.cells.read_into(out) } {
            return -EAGAIN;
        }
        match unsafe { &*out }.judge() {
            Verdict::Whole => 1,
            Verdict::Empty => 0,
            Verdict::Foreign => -EPROTO,
        }
    }

    /// The image if it was written since the last call. One load of a counter
    /// if it was not. The counter may be older than the value it stands with;
    /// then the same image is news twice, never none.
    unsafe fn news(&mut self, out: *mut T) -> c_int {
        let count = self.cells.count();
        if count == self.last {
            return 0;
        }
        let found = unsafe { self.read(out) };
        if found != -EAGAIN {
            self.last = count;
        }
        found
    }
}

fn give<T>(value: T, out: *mut *mut T) -> c_int {
    unsafe { *out = Box::into_raw(Box::new(value)) };
    0
}

fn take<T>(handle: *mut T) {
    guard(ptr::null_mut(), || {
        drop(unsafe { Box::from_raw(handle) });
        Ok(0)
    });
}

/// # Safety
/// `image` comes from one of the create functions and is not used again.
#[no_mangle]
pub unsafe extern "C" fn iox_image_destroy(image: *mut Image) {
    take(image)
}

/// How many writers an image has, without becoming one: opens the service and
/// looks. `pid` (may be NULL) gets the process of the last one seen.
///
/// # Safety
/// Valid handle and string. Cold.
#[no_mangle]
pub unsafe extern "C" fn iox_writers(
    node: *const NodeHandle,
    name: *const c_char,
    pid: *mut i32,
    error: *mut Error,
) -> c_int {
    guard(error, || {
        let (service, _) = unsafe { open_service(node, name, false) }?;
        let mut count = 0;
        service.dynamic_config().list_writers(|writer| {
            count += 1;
            if let (Some(pid), Ok(id)) = (unsafe { pid.as_mut() }, writer.node_id.pid::<Files>()) {
                *pid = id.value();
            }
            CallbackProgression::Continue
        });
        Ok(count)
    })
}

macro_rules! image {
    ($value:ty, $commanders:literal, $create:ident, $writer_open:ident, $loan:ident, $commit:ident, $writer_close:ident,
     $reader_open:ident, $read:ident, $reader_close:ident) => {
        impl Value for $value {
            const COMMANDERS: bool = $commanders;
        }
        /// # Safety
        /// Valid handles and strings; `first` is a whole image. Cold.
        #[no_mangle]
        pub unsafe extern "C" fn $create(
            node: *const NodeHandle,
            name: *const c_char,
            first: *const $value,
            out: *mut *mut Image,
            error: *mut Error,
        ) -> c_int {
            guard(error, || {
                Ok(give(unsafe { Image::create(node, name, *first) }?, out))
            })
        }
        /// # Safety
        /// Valid handles and strings. Cold.
        #[no_mangle]
        pub unsafe extern "C" fn $writer_open(
            node: *const NodeHandle,
            name: *const c_char,
            out: *mut *mut ImageWriter<$value>,
            error: *mut Error,
        ) -> c_int {
            guard(error, || {
                Ok(give(unsafe { ImageWriter::open(node, name) }?, out))
            })
        }
        /// The cell to fill in place; its content is that of two updates ago.
        ///
        /// # Safety
        /// Valid handle. Hot.
        #[no_mangle]
        pub unsafe extern "C" fn $loan(writer: *mut ImageWriter<$value>) -> *mut $value {
            unsafe { &mut *writer }.loan()
        }
        /// # Safety
        /// Valid handle, and all of the loan has been written. Hot.
        #[no_mangle]
        pub unsafe extern "C" fn $commit(writer: *mut ImageWriter<$value>) {
            unsafe { &mut *writer }.commit()
        }
        /// # Safety
        /// A handle that is not used again. Cold.
        #[no_mangle]
        pub unsafe extern "C" fn $writer_close(writer: *mut ImageWriter<$value>) {
            take(writer)
        }
        /// # Safety
        /// Valid handles and strings. Cold.
        #[no_mangle]
        pub unsafe extern "C" fn $reader_open(
            node: *const NodeHandle,
            name: *const c_char,
            out: *mut *mut ImageReader<$value>,
            error: *mut Error,
        ) -> c_int {
            guard(error, || {
                Ok(give(unsafe { ImageReader::open(node, name) }?, out))
            })
        }
        /// The newest image, whole: 1. 0 = nobody has written yet. -EPROTO =
        /// this is not such an image, -EAGAIN = somebody writes without a pause.
        /// *out is touched only with 1.
        ///
        /// # Safety
        /// Valid handle, room for an image. Hot.
        #[no_mangle]
        pub unsafe extern "C" fn $read(
            reader: *const ImageReader<$value>,
            out: *mut $value,
        ) -> c_int {
            unsafe { (*reader).read(out) }
        }
        /// # Safety
        /// A handle that is not used again. Cold.
        #[no_mangle]
        pub unsafe extern "C" fn $reader_close(reader: *mut ImageReader<$value>) {
            take(reader)
        }
    };
}

image!(
    PokeysState,
    false,
    iox_state_create,
    iox_state_writer_open,
    iox_state_loan,
    iox_state_commit,
    iox_state_writer_close,
    iox_state_reader_open,
    iox_state_read,
    iox_state_reader_close
);
image!(
    PokeysDiag,
    false,
    iox_diag_create,
    iox_diag_writer_open,
    iox_diag_loan,
    iox_diag_commit,
    iox_diag_writer_close,
    iox_diag_reader_open,
    iox_diag_read,
    iox_diag_reader_close
);
image!(
    PokeysCommand,
    true,
    iox_command_create,
    iox_command_writer_open,
    iox_command_loan,
    iox_command_commit,
    iox_command_writer_close,
    iox_command_reader_open,
    iox_command_read,
    iox_command_reader_close
);
image!(
    PokeysReport,
    false,
    iox_report_create,
    iox_report_writer_open,
    iox_report_loan,
    iox_report_commit,
    iox_report_writer_close,
    iox_report_reader_open,
    iox_report_read,
    iox_report_reader_close
);
image!(
    PokeysWish,
    true,
    iox_wish_create,
    iox_wish_writer_open,
    iox_wish_loan,
    iox_wish_commit,
    iox_wish_writer_close,
    iox_wish_reader_open,
    iox_wish_read,
    iox_wish_reader_close
);

/// Like read, with one copy less: *out is anything unless 1 is returned.
///
/// # Safety
/// Valid handle, room for an image. Hot.
#[no_mangle]
pub unsafe extern "C" fn iox_state_read_into(
    reader: *const ImageReader<PokeysState>,
    out: *mut PokeysState,
) -> c_int {
    unsafe { (*reader).read_into(out) }
}

/// How often it was written.
///
/// # Safety
/// Valid handle. Hot.
#[no_mangle]
pub unsafe extern "C" fn iox_diag_count(reader: *const ImageReader<PokeysDiag>) -> u64 {
    unsafe { (*reader).cells.count() }
}

/// The same.
///
/// # Safety
/// Valid handle. Hot.
#[no_mangle]
pub unsafe extern "C" fn iox_report_count(reader: *const ImageReader<PokeysReport>) -> u64 {
    unsafe { (*reader).cells.count() }
}

/// Like read, but only what was written since the last call: 0 = nothing new.
///
/// # Safety
/// Valid handle, room for an image, one thread at a time. Hot.
#[no_mangle]
pub unsafe extern "C" fn iox_wish_news(
    reader: *mut ImageReader<PokeysWish>,
    out: *mut PokeysWish,
) -> c_int {
    unsafe { (*reader).news(out) }
}
