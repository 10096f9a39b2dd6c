// SPDX-License-Identifier: MIT
//! Who is in a service: its nodes, its readers, its writer. iceoryx2 calls this a bag.
//!
//! Everybody who attaches writes here, so nothing in it is believed. How many entries there
//! are and where they begin is in the head of the segment, which an opener has as a copy of
//! its own (segment.rs), and it is held against the size of the mapping. All that remains in
//! shared memory are owners, counters and values: whatever they are, nobody follows them
//! anywhere, and every loop over them ends.
//!
//! The last one closes a service, and its files go. Only the daemon does, when it leaves, for
//! it has made them: what anybody sees in the list is no reason to remove anything.
//!
//! A process may die at any point. An entry belongs to its owner from the first exchange on,
//! so whoever cleans up after a dead owner finds it, with a value or still without.

use crate::{mapping, segment};
use iceoryx2::prelude::{CallbackProgression, ZeroCopySend};
use iceoryx2_bb_elementary_traits::allocator::{Allocate, AllocationError};
use iceoryx2_bb_elementary_traits::relocatable_container::RelocatableContainer;
use iceoryx2_bb_lock_free::mpmc::robust_unique_index_set::OwnerId;
use iceoryx2_bb_lock_free::mpmc::unique_index_set_enums::{ReleaseMode, ReleaseState};
use iceoryx2_cal::bag::{
    Bag, BagAddFailure, BagFamily, BagHandleFamily, BagRemoveError, BagStateFamily, BagType,
};
use std::alloc::Layout;
use std::cell::UnsafeCell;
use std::fmt::{self, Debug, Formatter};
use std::marker::PhantomData;
use std::mem::{size_of, transmute, MaybeUninit};
use std::ptr::{self, NonNull};
use std::sync::atomic::{fence, AtomicU64, Ordering};

/// No service of ours has more.
const CAPACITY_MAX: usize = 1024;
/// An entry that changes so often while it is read is nobody's.
const TRIES: usize = 16;
/// No owner has this number (OwnerId::new refuses it).
const NOBODY: u64 = u64::MAX;
/// Instead of a count of changes: the last one has left, and the service goes.
const CLOSED: u64 = u64::MAX;

const _: () = assert!(size_of::<OwnerId>() == size_of::<u64>());

fn number(owner: OwnerId) -> u64 {
    unsafe { transmute::<OwnerId, u64>(owner) }
}

#[repr(C)]
struct Entry<T> {
    owner: AtomicU64,
    /// Odd: there is a value.
    turn: AtomicU64,
    value: UnsafeCell<MaybeUninit<T>>,
}

impl<T: Copy> Entry<T> {
    fn value(&self) -> *mut T {
        self.value.get().cast()
    }

    fn clear(&self) {
        let turn = self.turn.load(Ordering::Acquire);
        self.turn
            .store(turn.wrapping_add(turn % 2), Ordering::Release);
    }

    fn fill(&self, value: &T) {
        self.clear();
        fence(Ordering::Release);
        unsafe { self.value().copy_from(value, 1) };
        self.turn.fetch_add(1, Ordering::Release);
    }

    /// A copy of the value, if there is one and it stands still.
    fn copy(&self) -> Option<T> {
        let mut copy = MaybeUninit::uninit();
        for _ in 0..TRIES {
            let turn = self.turn.load(Ordering::Acquire);
            if turn.is_multiple_of(2) {
                return None;
            }
            unsafe { self.value().copy_to(copy.as_mut_ptr(), 1) };
            fence(Ordering::Acquire);
            if self.turn.load(Ordering::Relaxed) == turn {
                return Some(unsafe { copy.assume_init() });
            }
        }
        None
    }

    fn leave(&self, owner: u64) -> bool {
        self.owner
            .compare_exchange(owner, NOBODY, Ordering::AcqRel, Ordering::Relaxed)
            .is_ok()
    }
}

/// The head: in the segment, and in each opener's copy of it.
#[repr(C)]
pub struct Members<T> {
    capacity: u64,
    /// From this head in the segment to the count of changes, before the entries.
    distance: u64,
    _value: PhantomData<T>,
}

unsafe impl<T> ZeroCopySend for Members<T> {}
unsafe impl<T> Send for Members<T> {}
unsafe impl<T> Sync for Members<T> {}

impl<T> Debug for Members<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "Members {{ capacity: {} }}", self.capacity)
    }
}

/// The part that is shared, after it was found to be inside of the mapping.
struct Area<'a, T> {
    changes: &'a AtomicU64,
    entries: &'a [Entry<T>],
}

/// The entries follow the count of changes, which is as large as their alignment.
fn area_bytes<T>(capacity: usize) -> usize {
    align_of::<Entry<T>>() + capacity * size_of::<Entry<T>>()
}

impl<T: BagType> Members<T> {
    /// None if it would not be inside of the mapping.
    fn area(&self) -> Option<Area<'_, T>> {
        let head = mapping::original(ptr::from_ref(self).cast());
        let (capacity, distance) = (self.capacity as usize, self.distance as usize);
        if capacity > CAPACITY_MAX
            || distance > head.room
            || area_bytes::<T>(capacity) > head.room - distance
            || !(head.address as usize + distance).is_multiple_of(align_of::<Entry<T>>())
        {
            segment::is_damaged("a list of members is not inside of its file");
            return None;
        }
        unsafe {
            let memory = head.address.add(distance);
            let entries = memory.add(align_of::<Entry<T>>()).cast();
            Some(Area {
                changes: &*memory.cast(),
                entries: std::slice::from_raw_parts(entries, capacity),
            })
        }
    }
}

impl<T: BagType> Area<'_, T> {
    /// False if it is closed.
    fn changed(&self) -> bool {
        let count = |changes| (changes != CLOSED).then(|| changes + 1);
        self.changes
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, count)
            .is_ok()
    }

    fn is_closed(&self) -> bool {
        self.changes.load(Ordering::Acquire) == CLOSED
    }

    fn count(&self) -> usize {
        let taken = |entry: &&Entry<T>| entry.owner.load(Ordering::Acquire) != NOBODY;
        self.entries.iter().filter(taken).count()
    }

    /// Who enters takes an entry first and counts the change then; so an exchange of a count
    /// from before an empty list proves that nobody has entered.
    fn close_if_empty(&self) -> ReleaseState {
        for _ in 0..TRIES {
            let changes = self.changes.load(Ordering::Acquire);
            if changes == CLOSED {
                return ReleaseState::Locked;
            }
            if self.count() != 0 {
                return ReleaseState::Unlocked;
            }
            if self
                .changes
                .compare_exchange(changes, CLOSED, Ordering::AcqRel, Ordering::Relaxed)
                .is_ok()
            {
                return ReleaseState::Locked;
            }
        }
        ReleaseState::Unlocked
    }

    fn take_entry(&self, owner: u64) -> Result<usize, BagAddFailure> {
        let free = |entry: &Entry<T>| {
            entry
                .owner
                .compare_exchange(NOBODY, owner, Ordering::AcqRel, Ordering::Relaxed)
                .is_ok()
        };
        if self.is_closed() {
            return Err(BagAddFailure::IsLocked);
        }
        let index = self
            .entries
            .iter()
            .position(free)
            .ok_or(BagAddFailure::OutOfSpace)?;
        if self.changed() {
            return Ok(index);
        }
        self.entries[index].leave(owner);
        Err(BagAddFailure::IsLocked)
    }

    fn copy(&self, state: &mut MembersState<T>) {
        let had = |entry: &Entry<T>| entry.owner.load(Ordering::Acquire) != NOBODY;
        let copy = |entry| had(entry).then(|| Entry::copy(entry)).flatten();
        state.changes = self.changes.load(Ordering::Acquire);
        state.values = self.entries.iter().map(copy).collect();
    }
}

impl<T: BagType> RelocatableContainer for Members<T> {
    unsafe fn new_uninit(capacity: usize) -> Self {
        Members {
            capacity: capacity as u64,
            distance: 0,
            _value: PhantomData,
        }
    }

    unsafe fn init<A: Allocate<NonNull<u8>>>(
        &mut self,
        allocator: &A,
    ) -> Result<(), AllocationError> {
        let capacity = self.capacity as usize;
        let align = align_of::<Entry<T>>();
        let layout = Layout::from_size_align(area_bytes::<T>(capacity), align)
            .map_err(|_| AllocationError::SizeTooLarge)?;
        let memory = allocator.allocate(layout)?.as_ptr();
        let entries = unsafe { memory.add(align) }.cast::<Entry<T>>();
        self.distance = (memory as usize - ptr::from_ref(self) as usize) as u64;
        unsafe { memory.cast::<AtomicU64>().write(AtomicU64::new(1)) };
        for index in 0..capacity {
            let entry = Entry {
                owner: AtomicU64::new(NOBODY),
                turn: AtomicU64::new(0),
                value: UnsafeCell::new(MaybeUninit::uninit()),
            };
            unsafe { entries.add(index).write(entry) };
        }
        Ok(())
    }

    fn memory_size(capacity: usize) -> usize {
        area_bytes::<T>(capacity) + align_of::<Entry<T>>() - 1
    }
}

/// Whose entry it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MembersHandle {
    index: usize,
    owner: u64,
}

impl BagHandleFamily for MembersHandle {
    fn index(&self) -> usize {
        self.index
    }
}

/// A copy of all entries that have a value.
#[derive(Debug)]
pub struct MembersState<T: BagType> {
    changes: u64,
    values: Vec<Option<T>>,
}

impl<T: BagType> BagStateFamily<T> for MembersState<T> {
    fn for_each<F: FnMut(usize, &T) -> CallbackProgression>(&self, mut callback: F) {
        for (index, value) in self.values.iter().enumerate() {
            if let Some(value) = value {
                if callback(index, value) == CallbackProgression::Stop {
                    return;
                }
            }
        }
    }

    fn get(&self, index: usize) -> Option<&T> {
        self.values.get(index)?.as_ref()
    }
}

#[derive(Debug)]
pub struct MembersFamily;

impl BagFamily for MembersFamily {
    type BagHandle = MembersHandle;
    type BagState<T: BagType> = MembersState<T>;
    type Bag<T: BagType> = Members<T>;
}

impl<T: BagType> Bag<T> for Members<T> {
    type BagHandle = MembersHandle;
    type BagState<TT: BagType> = MembersState<T>;

    fn capacity(&self) -> usize {
        self.capacity as usize
    }

    fn len(&self) -> usize {
        self.area().map_or(0, |area| area.count())
    }

    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    unsafe fn add(
        &self,
        value: T,
        owner_id: OwnerId,
    ) -> Result<(*const T, MembersHandle), BagAddFailure>
    where
        T: PartialEq,
    {
        let area = self.area().ok_or(BagAddFailure::OutOfSpace)?;
        let owner = number(owner_id);
        let index = area.take_entry(owner)?;
        area.entries[index].fill(&value);
        area.changed();
        Ok((area.entries[index].value(), MembersHandle { index, owner }))
    }

    unsafe fn remove(
        &self,
        handle: MembersHandle,
        mode: ReleaseMode,
    ) -> Result<ReleaseState, BagRemoveError> {
        let none = BagRemoveError::HandleNotOwnedByInstance;
        let area = self.area().ok_or(none)?;
        let entry = area.entries.get(handle.index).ok_or(none)?;
        if !entry.leave(handle.owner) {
            return Err(none);
        }
        area.changed();
        match mode {
            ReleaseMode::LockIfLastIndex if segment::is_maker() => Ok(area.close_if_empty()),
            _ => Ok(ReleaseState::Unlocked),
        }
    }

    unsafe fn get_state(&self) -> MembersState<T> {
        let mut state = MembersState {
            changes: 0,
            values: Vec::new(),
        };
        if let Some(area) = self.area() {
            area.copy(&mut state);
        }
        state
    }

    unsafe fn recover<F: FnMut(T) -> bool>(
        &self,
        dead_owner_id: OwnerId,
        mut predicate: F,
        _mode: ReleaseMode,
    ) -> ReleaseState {
        let owner = number(dead_owner_id);
        let Some(area) = self.area() else {
            return ReleaseState::Unlocked;
        };
        for entry in area.entries {
            if entry.owner.load(Ordering::Acquire) != owner {
                continue;
            }
            // What its value says is not believed: it frees the entry in any case.
            entry.copy().map(&mut predicate);
            entry.leave(owner);
            area.changed();
        }
        ReleaseState::Unlocked
    }

    unsafe fn update_state(&self, previous_state: &mut MembersState<T>) -> bool {
        let Some(area) = self.area() else {
            return false;
        };
        if area.changes.load(Ordering::Acquire) == previous_state.changes {
            return false;
        }
        area.copy(previous_state);
        true
    }
}
