// SPDX-License-Identifier: MIT
//! The value of a blackboard's entry: a counter and two cells, laid out as iceoryx2 does.
//!
//! The writer fills the cell that is not the newest one and counts; the reader copies the
//! newest one and looks whether the counter still stands there. Whoever may write can make
//! a reader wrong, but never read outside of the two cells, nor stay: it tries a few times.

use std::cell::UnsafeCell;
use std::mem::MaybeUninit;
use std::sync::atomic::{fence, AtomicU64, AtomicU8, Ordering};

/// At 1 kHz one is enough; a writer that floods costs a reader no more than this.
const TRIES: usize = 16;
const FREE: u8 = 1;
const HAD: u8 = 0;

#[repr(C)]
pub struct Cells<T> {
    /// Counts writes from 1 on; the newest value is in the cell before this one.
    next: AtomicU64,
    right: AtomicU8,
    cell: [UnsafeCell<MaybeUninit<T>>; 2],
}

impl<T: Copy> Cells<T> {
    fn at(&self, count: u64) -> *mut T {
        self.cell[(count % 2) as usize].get().cast()
    }

    pub fn count(&self) -> u64 {
        self.next.load(Ordering::Acquire)
    }

    /// A copy of the newest value, which may be anything at all; None while a writer floods.
    #[inline(always)]
    pub fn read(&self) -> Option<MaybeUninit<T>> {
        let mut copy = MaybeUninit::<T>::uninit();
        unsafe { self.read_into(copy.as_mut_ptr()) }.then_some(copy)
    }

    /// The same; false, and anything in `out`, while a writer floods.
    ///
    /// # Safety
    /// There is room for a value.
    #[inline(always)]
    pub unsafe fn read_into(&self, out: *mut T) -> bool {
        for _ in 0..TRIES {
            let next = self.count();
            // Somebody may write there meanwhile; what was copied is not looked at then.
            unsafe { self.at(next.wrapping_sub(1)).copy_to(out, 1) };
            fence(Ordering::Acquire);
            if self.next.load(Ordering::Relaxed) == next {
                return true;
            }
        }
        false
    }
}

/// The right to write, which one at a time has. One who dies keeps it.
pub struct Right<T: Copy + 'static> {
    cells: &'static Cells<T>,
    /// What the counter is; the one in shared memory may be anybody's.
    next: u64,
}

impl<T: Copy> Right<T> {
    /// None if somebody has it. The memory outlives the right.
    pub fn take(cells: &'static Cells<T>) -> Option<Self> {
        cells
            .right
            .compare_exchange(FREE, HAD, Ordering::Acquire, Ordering::Relaxed)
            .ok()?;
        Some(Right {
            cells,
            next: cells.count(),
        })
    }

    /// The cell to fill.
    pub fn cell(&self) -> *mut T {
        self.cells.at(self.next)
    }

    /// It is filled.
    pub fn commit(&mut self) {
        self.next = self.next.wrapping_add(1);
        self.cells.next.store(self.next, Ordering::Release);
        // What is written into the other cell from here on is not seen before the count.
        fence(Ordering::Release);
    }
}

impl<T: Copy> Drop for Right<T> {
    fn drop(&mut self) {
        self.cells.right.store(FREE, Ordering::Release);
    }
}
