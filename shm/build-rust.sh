#!/bin/sh
# SPDX-License-Identifier: MIT
# build-rust.sh CARGO MANIFEST TARGET_DIRECTORY OUTPUT: build the crate, hand
# over the archive. Sanitizer and other C flags of the build are not for Rust.
set -eu
export CARGO_NET_RETRY="${CARGO_NET_RETRY:-10}"	# one failed download must not fail the build
unset RUSTFLAGS CARGO_BUILD_TARGET CARGO_TARGET_DIR
mkdir -p "$3"
# builds of other checkouts may share the folder, so keep them out until the archive is copied
exec 9>"$3/lock"
flock -n 9 || { echo "build-rust: waiting for another build in $3" >&2; flock 9; }
# Cargo takes the crates of two checkouts for the same one, and compares times: where the archive
# of one is younger than the sources of the other, it would hand that over.
sources=$(cd "$(dirname "$2")" && find . -name target -prune -o -type f -print | LC_ALL=C sort |
	xargs cat | sha256sum)
if [ "$(cat "$3/sources" 2>/dev/null)" != "$sources" ] && [ -e "$3/release/libpokeys_iox.a" ]; then
	"$1" clean --release --package pokeys_iox --manifest-path "$2" --target-dir "$3" 9>&-
fi
rm -f "$3/sources"
# a server that a compiler's wrapper starts must not keep the lock
"$1" build --release --locked --manifest-path "$2" --target-dir "$3" 9>&-
echo "$sources" >"$3/sources"
cp "$3/release/libpokeys_iox.a" "$4"
