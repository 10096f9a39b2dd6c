// SPDX-License-Identifier: MIT
//! The layouts of include/pokeys/state.h, command.h and settings.h, once more.
//!
//! They are written by hand on purpose: two people (or one, twice) who write
//! down the same layout and get the same hash have both read it. The macro
//! defines a struct and its list of members in one go, so that the list cannot
//! drift from the struct; the hashes are compared at compile time with the
//! constants below, and by a test with those of the C headers.
//!
//! Changing a layout: change the header, its VERSION and this file; the failed
//! assertion tells by name which image differs, the test `shm: layout` prints
//! the new values.

use iceoryx2::prelude::ZeroCopySend;

/// A member: name, offset, size, and the members of its own type if that is a
/// struct (or an array of structs).
pub struct Member {
    name: &'static str,
    offset: usize,
    size: usize,
    nested: &'static [Member],
}

pub trait Members {
    const MEMBERS: &'static [Member] = &[];
}

impl Members for u8 {}
impl Members for u16 {}
impl Members for u32 {}
impl Members for u64 {}
impl Members for i16 {}
impl Members for i32 {}
impl Members for i64 {}
impl Members for f32 {}
impl Members for f64 {}
impl<T: Members, const N: usize> Members for [T; N] {
    const MEMBERS: &'static [Member] = T::MEMBERS;
}

/* FNV-1a, 64 bit, at compile time. */

const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;

const fn fnv_byte(hash: u64, byte: u8) -> u64 {
    (hash ^ byte as u64).wrapping_mul(FNV_PRIME)
}

const fn fnv_bytes(mut hash: u64, bytes: &[u8]) -> u64 {
    let mut i = 0;
    while i < bytes.len() {
        hash = fnv_byte(hash, bytes[i]);
        i += 1;
    }
    hash
}

/// A member named like a word of Rust's is written r#word here.
const fn fnv_name(hash: u64, name: &str) -> u64 {
    match name.as_bytes() {
        [b'r', b'#', rest @ ..] => fnv_bytes(hash, rest),
        whole => fnv_bytes(hash, whole),
    }
}

const fn fnv_decimal(hash: u64, number: usize) -> u64 {
    let hash = if number >= 10 {
        fnv_decimal(hash, number / 10)
    } else {
        hash
    };
    fnv_byte(hash, b'0' + (number % 10) as u8)
}

/// The rule of state.h: "name:offset:size;" for each member in order, and for
/// a member that is a struct (or an array of them) the same of its members in
/// braces behind it, offsets from the start of that struct.
const fn fnv_members(mut hash: u64, members: &[Member]) -> u64 {
    let mut i = 0;
    while i < members.len() {
        let member = &members[i];
        hash = fnv_name(hash, member.name);
        hash = fnv_byte(hash, b':');
        hash = fnv_decimal(hash, member.offset);
        hash = fnv_byte(hash, b':');
        hash = fnv_decimal(hash, member.size);
        hash = fnv_byte(hash, b';');
        if !member.nested.is_empty() {
            hash = fnv_byte(hash, b'{');
            hash = fnv_members(hash, member.nested);
            hash = fnv_byte(hash, b'}');
        }
        i += 1;
    }
    hash
}

/// Whether the members follow each other without a hole, up to `size`.
const fn gapless(members: &[Member], size: usize) -> bool {
    let mut at = 0;
    let mut i = 0;
    while i < members.len() {
        if members[i].offset != at {
            return false;
        }
        at += members[i].size;
        i += 1;
    }
    at == size
}

macro_rules! layout {
    ($(#[$attribute:meta])* $name:ident { $($member:ident: $kind:ty,)* }) => {
        $(#[$attribute])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug)]
        pub struct $name {
            $(pub $member: $kind,)*
        }
        impl Members for $name {
            const MEMBERS: &'static [Member] = &[
                $(Member {
                    name: stringify!($member),
                    offset: core::mem::offset_of!($name, $member),
                    size: core::mem::size_of::<$kind>(),
                    nested: <$kind as Members>::MEMBERS,
                },)*
            ];
        }
        const _: () = assert!(
            gapless(<$name as Members>::MEMBERS, core::mem::size_of::<$name>()),
            concat!(stringify!($name), " has a hole"),
        );
    };
}

pub enum Verdict {
    Whole,
    Empty,
    Foreign,
}

/// Is this an image of our layout? Whoever may attach may write, so everyone
/// who reads asks.
pub trait Judge {
    fn judge(&self) -> Verdict;
}

/// A layout that is published as a whole: its name and version, and what the
/// header says its size and hash are.
macro_rules! published {
    ($name:ident, $image:literal, magic $magic:literal, version $version:literal,
     size $size:literal, hash $hash:literal, hash_function $function:ident) => {
        const _: () = {
            assert!(core::mem::align_of::<$name>() == 8);
            assert!(
                core::mem::size_of::<$name>() == $size,
                concat!($image, ": size is not that of the header"),
            );
            assert!(
                fnv_members(FNV_OFFSET, <$name as Members>::MEMBERS) == $hash,
                concat!($image, ": hash is not that of the header"),
            );
        };
        // Plain numbers only; every bit pattern is valid, so that reading what
        // a foreign writer left cannot be undefined behaviour.
        unsafe impl ZeroCopySend for $name {
            unsafe fn type_name() -> &'static str {
                concat!("pokeys.", $image, ".v", $version, ".", stringify!($hash))
            }
        }
        impl Judge for $name {
            fn judge(&self) -> Verdict {
                match (self.magic, self.version, self.size_units, self.hash) {
                    ($magic, $version, units, $hash) if units as usize * 8 == $size => {
                        Verdict::Whole
                    }
                    (0, 0, 0, 0) => Verdict::Empty,
                    _ => Verdict::Foreign,
                }
            }
        }
        /// For the test that holds header, Rust and Python side by side.
        #[no_mangle]
        pub extern "C" fn $function() -> u64 {
            fnv_members(FNV_OFFSET, <$name as Members>::MEMBERS)
        }
    };
}

mod command;
mod settings;
mod state;

pub use command::PokeysCommand;
pub use settings::{PokeysReport, PokeysWish};
pub use state::{PokeysDiag, PokeysState};
