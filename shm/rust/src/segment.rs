// SPDX-License-Identifier: MIT
//! A file that is mapped, opened without believing anything in it.
//!
//! iceoryx2 makes such a file: a version, a head of some type, and memory that the head points
//! into by distances. It would map the file and follow the distances at each use, and whoever
//! may write into the file can have it follow them anywhere. LinuxCNC is setuid root. So this
//! storage stands between: iceoryx2's own makes the files, and they are opened here.
//!
//! * What is opened has to be a regular file of the user whose folder it is in, not a link,
//!   and as large as its head at least.
//! * The head is copied once, and iceoryx2 works on the copy. Nothing that is shared is in a
//!   head: members.rs keeps what changes behind it, and finds it through mapping.rs.
//! * The head of a service says of which kind the service is, by a number that Rust's `match`
//!   believes. It is checked.
//! * The values are read and written by cells.rs, at the one place where they can be. So the
//!   table that says where they are (the blackboard's management segment) is never opened.

use crate::mapping::{self, Mapping};
use iceoryx2::prelude::{FileName, Path, ZeroCopySend};
use iceoryx2_bb_elementary::package_version::PackageVersion;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_memory::bump_allocator::BumpAllocator;
use iceoryx2_bb_posix::file::AccessMode;
use iceoryx2_cal::dynamic_storage::file::{Builder as FileBuilder, Configuration, Storage};
use iceoryx2_cal::dynamic_storage::{
    DynamicStorage, DynamicStorageBuilder, DynamicStorageCreateError, DynamicStorageOpenError,
    DynamicStorageOpenOrCreateError,
};
use iceoryx2_cal::named_concept::{
    NamedConcept, NamedConceptBuilder, NamedConceptConfiguration, NamedConceptDoesExistError,
    NamedConceptListError, NamedConceptMgmt, NamedConceptPathHintRemoveError,
    NamedConceptRemoveError,
};
use std::cell::Cell;
use std::ffi::c_int;
use std::fmt::{self, Debug, Formatter};
use std::fs::{self, File, OpenOptions, Permissions};
use std::io;
use std::marker::PhantomData;
use std::mem::{offset_of, size_of, MaybeUninit};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::ptr::{self, NonNull};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// No file of ours is larger, and a length that somebody made up is not mapped.
const BYTES_MAX: u64 = 64 << 20;

thread_local! {
    /// What a call into iceoryx2 has found (errno); it has no error of its own for it.
    static FOUND: Cell<Option<(c_int, &'static str)>> = const { Cell::new(None) };
    /// Whether the value that is made or opened now is written by a commander or this process.
    static WRITES: Cell<bool> = const { Cell::new(false) };
    /// The value that was opened last.
    static PAYLOAD: Cell<Option<Payload>> = const { Cell::new(None) };
}

pub fn is_damaged(what: &'static str) {
    FOUND.set(Some((libc::EBADMSG, what)));
}

fn is_known() -> bool {
    FOUND.get().is_some()
}

/// What was found since the last call.
pub fn take_found() -> Option<(c_int, &'static str)> {
    FOUND.take()
}

/// This process has made services.
static MAKER: AtomicBool = AtomicBool::new(false);

pub fn is_maker() -> bool {
    MAKER.load(Ordering::Relaxed)
}

/// Where the value of a service is; mapped as long as the service is open.
#[derive(Clone, Copy)]
pub struct Payload {
    pub address: *mut u8,
    pub room: usize,
}

/// Run `make`, which makes a service, for a value that commanders write or not.
pub fn for_commanders<R>(commanders_write: bool, make: impl FnOnce() -> R) -> R {
    MAKER.store(true, Ordering::Relaxed);
    WRITES.set(commanders_write);
    make()
}

/// Run `open`, which opens a service, for one that writes its value or not.
pub fn with_payload<R, E>(
    writes: bool,
    open: impl FnOnce() -> Result<R, E>,
) -> Result<(R, Option<Payload>), E> {
    WRITES.set(writes);
    PAYLOAD.set(None);
    let result = open();
    let payload = PAYLOAD.take();
    result.map(|service| (service, payload))
}

/// As iceoryx2's storage lays a file out.
#[repr(C)]
struct Front<T> {
    version: AtomicU64,
    head: MaybeUninit<T>,
}

/// What a segment is for.
pub trait Purpose: Debug + Send + Sync + 'static {
    /// Who makes it goes on with iceoryx2's own storage.
    const MAKER_KEEPS: bool;
    /// It is not looked into.
    const CLOSED: bool;

    /// Permissions of its file; the group is the commanders'.
    fn mode() -> u32;
    fn writes() -> bool;
    fn is_good(_head: &[u8]) -> bool {
        true
    }
    fn opened(_address: *mut u8, _room: usize) {}
}

/// Who is in a service.
#[derive(Debug)]
pub struct Attendance;

/// A blackboard, in iceoryx2's list of the kinds of service.
const BLACKBOARD: u32 = 3;

impl Purpose for Attendance {
    const MAKER_KEEPS: bool = false;
    const CLOSED: bool = false;

    fn mode() -> u32 {
        0o660
    }
    fn writes() -> bool {
        true
    }
    fn is_good(head: &[u8]) -> bool {
        head.first_chunk() == Some(&BLACKBOARD.to_ne_bytes())
    }
}

/// Its value.
#[derive(Debug)]
pub struct Contents;

impl Purpose for Contents {
    const MAKER_KEEPS: bool = true;
    const CLOSED: bool = false;

    fn mode() -> u32 {
        if WRITES.get() {
            0o660
        } else {
            0o640
        }
    }
    fn writes() -> bool {
        WRITES.get()
    }
    fn opened(address: *mut u8, room: usize) {
        PAYLOAD.set(Some(Payload { address, room }));
    }
}

/// Where its values are.
#[derive(Debug)]
pub struct Table;

impl Purpose for Table {
    const MAKER_KEEPS: bool = true;
    const CLOSED: bool = true;

    fn mode() -> u32 {
        0o600
    }
    fn writes() -> bool {
        false
    }
}

struct Opened<T> {
    _mapping: Mapping,
    head: Box<MaybeUninit<T>>,
}

impl<T> Opened<T> {
    fn register(mapping: Mapping, head: Box<MaybeUninit<T>>) -> Self {
        mapping.has_copy(
            head.as_ptr().cast(),
            size_of::<T>(),
            offset_of!(Front<T>, head),
        );
        Opened {
            _mapping: mapping,
            head,
        }
    }
}

impl<T> Drop for Opened<T> {
    fn drop(&mut self) {
        mapping::forget_copy(self.head.as_ptr().cast());
    }
}

/// What iceoryx2 asks of a type that it puts into a segment.
pub trait Content: Debug + Send + Sync + ZeroCopySend + 'static {}
impl<T: Debug + Send + Sync + ZeroCopySend + 'static> Content for T {}

enum State<T: Content> {
    Made(Box<Storage<T>>),
    Opened(Opened<T>),
    Closed,
}

/// iceoryx2's storage, as it sees it.
pub struct Segment<T: Content, P: Purpose> {
    name: FileName,
    config: Configuration<T>,
    state: State<T>,
    /// Its file is removed with it.
    owned: AtomicBool,
    _purpose: PhantomData<P>,
}

impl<T: Content, P: Purpose> Segment<T, P> {
    fn new(name: &FileName, config: &Configuration<T>, state: State<T>) -> Self {
        Segment {
            name: *name,
            config: config.clone(),
            state,
            owned: AtomicBool::new(false),
            _purpose: PhantomData,
        }
    }

    fn open(name: &FileName, config: &Configuration<T>) -> Result<Self, DynamicStorageOpenError> {
        if P::CLOSED {
            return Ok(Self::new(name, config, State::Closed));
        }
        let writable = P::writes();
        let least = size_of::<Front<T>>();
        let (file, length) = open_file(&config.path_for(name).to_string(), least, writable)?;
        let mapping = Mapping::of(&file, length, writable)
            .map_err(|_| DynamicStorageOpenError::InternalError)?;
        let head = copy_head::<T>(&mapping).inspect_err(|error| {
            let making = file
                .metadata()
                .is_ok_and(|status| status.mode() & 0o777 == MAKING);
            if *error == DynamicStorageOpenError::InitializationNotYetFinalized && !making {
                is_damaged("a file has no version");
            }
        });
        let head = match head {
            Err(_) if is_known() => return Err(DynamicStorageOpenError::InternalError),
            head => head?,
        };
        let bytes = unsafe { std::slice::from_raw_parts(head.as_ptr().cast(), size_of::<T>()) };
        if !P::is_good(bytes) {
            is_damaged("the head of a file is not one");
            return Err(DynamicStorageOpenError::InternalError);
        }
        let behind = unsafe { mapping.address.add(size_of::<Front<T>>()) };
        P::opened(behind, length - size_of::<Front<T>>());
        let opened = Opened::register(mapping, head);
        Ok(Self::new(name, config, State::Opened(opened)))
    }
}

/// A file that was made by whoever made the folder, and how long it is.
fn open_file(
    path: &str,
    least: usize,
    writable: bool,
) -> Result<(File, usize), DynamicStorageOpenError> {
    let folder = std::path::Path::new(path).parent();
    let opened = OpenOptions::new()
        .read(true)
        .write(writable)
        .custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK)
        .open(path)
        .and_then(|file| {
            Ok((
                file.metadata()?,
                fs::metadata(folder.unwrap_or("/".as_ref()))?,
                file,
            ))
        });
    let (status, folder, file) = match opened {
        Ok(opened) => opened,
        Err(error) => return Err(open_error(path, &error)),
    };
    if !status.is_file() || status.uid() != folder.uid() || status.len() > BYTES_MAX {
        is_damaged("a file is not the one that pokeysd made");
        return Err(DynamicStorageOpenError::InternalError);
    }
    if status.len() < least as u64 {
        if status.mode() & 0o777 == MAKING {
            return Err(DynamicStorageOpenError::InitializationNotYetFinalized);
        }
        is_damaged("a file is too short");
        return Err(DynamicStorageOpenError::InternalError);
    }
    Ok((file, status.len() as usize))
}

/// Where the folder does not do that by itself; a group that this process is not in cannot be
/// given, and needs not be.
fn give_to_the_folders_group(path: &str) {
    if let Some(Ok(folder)) = std::path::Path::new(path).parent().map(fs::metadata) {
        let _ = std::os::unix::fs::chown(path, None, Some(folder.gid()));
    }
}

/// The mode that iceoryx2 gives a file as long as it makes it.
const MAKING: u32 = 0o200;

fn open_error(path: &str, error: &io::Error) -> DynamicStorageOpenError {
    let mode = || fs::symlink_metadata(path).map_or(0, |status| status.mode() & 0o777);
    match error.raw_os_error() {
        Some(libc::ENOENT) => DynamicStorageOpenError::DoesNotExist,
        Some(libc::EACCES) if mode() == MAKING => {
            DynamicStorageOpenError::InitializationNotYetFinalized
        }
        Some(libc::ELOOP) => {
            is_damaged("a file is a link");
            DynamicStorageOpenError::InternalError
        }
        errno => {
            FOUND.set(Some((
                errno.unwrap_or(libc::EIO),
                "a file cannot be opened",
            )));
            DynamicStorageOpenError::InternalError
        }
    }
}

fn copy_head<T>(mapping: &Mapping) -> Result<Box<MaybeUninit<T>>, DynamicStorageOpenError> {
    let front = mapping.address.cast::<Front<T>>();
    let version = unsafe { &(*front).version };
    match version.load(Ordering::Acquire) {
        0 => return Err(DynamicStorageOpenError::InitializationNotYetFinalized),
        other if other != PackageVersion::get().to_u64() => {
            return Err(DynamicStorageOpenError::VersionMismatch)
        }
        _ => {}
    }
    let mut head = Box::new(MaybeUninit::<T>::uninit());
    unsafe {
        head.as_mut_ptr()
            .copy_from((&raw const (*front).head).cast(), 1)
    };
    Ok(head)
}

impl<T: Content, P: Purpose> Debug for Segment<T, P> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "Segment {{ name: {} }}", self.name)
    }
}

impl<T: Content, P: Purpose> Drop for Segment<T, P> {
    fn drop(&mut self) {
        if self.owned.load(Ordering::Relaxed) {
            let _ = unsafe { Storage::<T>::remove_cfg(&self.name, &self.config) };
        }
    }
}

impl<T: Content, P: Purpose> Abandonable for Segment<T, P> {
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        match &mut unsafe { this.as_mut() }.state {
            State::Made(storage) => unsafe {
                Storage::abandon_in_place(NonNull::from_mut(&mut **storage));
            },
            opened => unsafe { ptr::drop_in_place(opened) },
        }
    }
}

impl<T: Content, P: Purpose> NamedConcept for Segment<T, P> {
    fn name(&self) -> &FileName {
        &self.name
    }
}

impl<T: Content, P: Purpose> NamedConceptMgmt for Segment<T, P> {
    type Configuration = Configuration<T>;

    unsafe fn remove_cfg(
        name: &FileName,
        cfg: &Configuration<T>,
    ) -> Result<bool, NamedConceptRemoveError> {
        unsafe { Storage::<T>::remove_cfg(name, cfg) }
    }

    fn does_exist_cfg(
        name: &FileName,
        cfg: &Configuration<T>,
    ) -> Result<bool, NamedConceptDoesExistError> {
        Storage::<T>::does_exist_cfg(name, cfg)
    }

    fn list_cfg(cfg: &Configuration<T>) -> Result<Vec<FileName>, NamedConceptListError> {
        Storage::<T>::list_cfg(cfg)
    }

    fn remove_path_hint(value: &Path) -> Result<(), NamedConceptPathHintRemoveError> {
        Storage::<T>::remove_path_hint(value)
    }
}

impl<T: Content, P: Purpose> DynamicStorage<T> for Segment<T, P> {
    type Builder<'builder> = Builder<'builder, T, P>;

    fn does_support_persistency() -> bool {
        true
    }

    fn has_ownership(&self) -> bool {
        match &self.state {
            State::Made(storage) => storage.has_ownership(),
            _ => self.owned.load(Ordering::Relaxed),
        }
    }

    fn acquire_ownership(&self) {
        match &self.state {
            State::Made(storage) => storage.acquire_ownership(),
            _ => self.owned.store(true, Ordering::Relaxed),
        }
    }

    fn release_ownership(&self) {
        match &self.state {
            State::Made(storage) => storage.release_ownership(),
            _ => self.owned.store(false, Ordering::Relaxed),
        }
    }

    fn get(&self) -> &T {
        match &self.state {
            State::Made(storage) => storage.get(),
            State::Opened(opened) => unsafe { opened.head.assume_init_ref() },
            State::Closed => panic!("a segment is used that is not looked into"),
        }
    }

    unsafe fn __internal_set_type_name_in_config(config: &mut Configuration<T>, name: &str) {
        unsafe { Storage::<T>::__internal_set_type_name_in_config(config, name) }
    }
}

#[derive(Debug)]
pub struct Builder<'builder, T: Content, P: Purpose> {
    name: FileName,
    config: Configuration<T>,
    maker: FileBuilder<'builder, T>,
    _purpose: PhantomData<P>,
}

impl<T: Content, P: Purpose> NamedConceptBuilder<Segment<T, P>> for Builder<'_, T, P> {
    fn new(name: &FileName) -> Self {
        Builder {
            name: *name,
            config: Configuration::default(),
            maker: FileBuilder::new(name),
            _purpose: PhantomData,
        }
    }

    fn config(mut self, config: &Configuration<T>) -> Self {
        self.config = config.clone();
        self.maker = self.maker.config(config);
        self
    }
}

impl<'builder, T: Content, P: Purpose> DynamicStorageBuilder<'builder, T, Segment<T, P>>
    for Builder<'builder, T, P>
{
    fn has_ownership(mut self, value: bool) -> Self {
        self.maker = self.maker.has_ownership(value);
        self
    }

    fn enable_global_access(mut self, value: bool) -> Self {
        self.maker = self.maker.enable_global_access(value);
        self
    }

    fn supplementary_size(mut self, value: usize) -> Self {
        self.maker = self.maker.supplementary_size(value);
        self
    }

    fn timeout(mut self, value: Duration) -> Self {
        self.maker = self.maker.timeout(value);
        self
    }

    fn initializer<F: FnMut(&mut MaybeUninit<T>, &mut BumpAllocator) -> bool + 'builder>(
        mut self,
        value: F,
    ) -> Self {
        self.maker = self.maker.initializer(value);
        self
    }

    fn create(self) -> Result<Segment<T, P>, DynamicStorageCreateError> {
        let path = self.config.path_for(&self.name).to_string();
        let made = self.maker.create()?;
        fs::set_permissions(&path, Permissions::from_mode(P::mode()))
            .map_err(|_| DynamicStorageCreateError::InternalError)?;
        give_to_the_folders_group(&path);
        if P::MAKER_KEEPS {
            return Ok(Segment::new(
                &self.name,
                &self.config,
                State::Made(Box::new(made)),
            ));
        }
        let owned = made.has_ownership();
        made.release_ownership();
        let segment = Segment::open(&self.name, &self.config)
            .map_err(|_| DynamicStorageCreateError::InitializationFailed)?;
        segment.owned.store(owned, Ordering::Relaxed);
        Ok(segment)
    }

    /// Whether it is written is not what iceoryx2 says, which is always so.
    fn open(self, _access_mode: AccessMode) -> Result<Segment<T, P>, DynamicStorageOpenError> {
        Segment::open(&self.name, &self.config)
    }

    /// Only of what outlives a service, which is no segment of this kind.
    fn open_or_create(self) -> Result<Segment<T, P>, DynamicStorageOpenOrCreateError> {
        Err(DynamicStorageOpenError::InternalError.into())
    }
}
