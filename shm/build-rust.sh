#!/bin/sh
# SPDX-License-Identifier: MIT
# build-rust.sh CARGO MANIFEST TARGET_DIRECTORY OUTPUT: build the crate, hand
# over the archive. Sanitizer and other C flags of the build are not for Rust.
set -eu
export CARGO_NET_RETRY="${CARGO_NET_RETRY:-10}"	# a mirror that stutters ends no build
unset RUSTFLAGS CARGO_BUILD_TARGET CARGO_TARGET_DIR
mkdir -p "$3"
# builds of other checkouts may share the folder: the archive is ours until it is copied
exec 9>"$3/lock"
flock 9
"$1" build --release --locked --manifest-path "$2" --target-dir "$3"
cp "$3/release/libpokeys_iox.a" "$4"
