# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Configure and build one build folder. Sourced by ./run.

# A folder that was moved or copied here with the sources still names the old
# place: what is built and tested would be what lies there.
belongs_here() {
	local info=$1/meson-info/meson-info.json source
	[ -f "$info" ] || return 0
	source=$(sed -n 's/.*"source": *"\([^"]*\)".*/\1/p' "$info" | head -n 1)
	# a name that JSON has to escape is not worth a parser
	[ -z "$source" ] || [[ $source == *\\* ]] || [ "$source" -ef . ]
}

CARGO_CACHE=${XDG_CACHE_HOME:-${HOME:+$HOME/.cache}}
CARGO_CACHE=${CARGO_CACHE:+$CARGO_CACHE/pokeysd}

# The folder that cargo builds in. All build folders of this user share it, also those of other checkouts,
# as long as the crates and the compiler are the same; ./run clean keeps it. Empty = in the build folder.
cargo_target() {
	local key
	[ -n "$CARGO_CACHE" ] || return 0
	key=$({ cat shm/rust/Cargo.lock; rustc -vV; } 2>/dev/null | sha256sum | cut -c 1-16)
	if mkdir -p "$CARGO_CACHE/cargo-$key" 2>/dev/null && [ -w "$CARGO_CACHE/cargo-$key" ]; then
		echo "$CARGO_CACHE/cargo-$key"
	fi
}

# is_building FOLDER: does another ./run build there now?
is_building() {
	local status=0
	[ -e "$1/.lock" ] || return 1
	flock -n "$1/.lock" true || status=$?
	[ "$status" = 1 ]
}

# configure_and_build FOLDER [meson option ...]: only one at a time in a folder, which ninja does not ensure
configure_and_build() {
	local folder=$1
	belongs_here "$folder" ||
		die "$folder was configured for sources in another place; ./run clean, then again"
	mkdir -p "$folder"
	{
		flock -n 9 || { say "another ./run is building in $folder; waiting until it has finished"; flock 9; }
		build_folder "$@" 9>&-
	} 9>"$folder/.lock"
}

build_folder() {
	local folder=$1
	shift
	if [ ! -f "$folder/build.ninja" ]; then
		say "configuring $folder"
		# left by a configuring that was interrupted, it is "already configured" for meson
		rm -f "$folder/meson-private/coredata.dat"
		meson setup "$folder" -Dcargo-target-dir="$(cargo_target)" "$@" >"$folder/setup.log" 2>&1 || {
			cat "$folder/setup.log" >&2
			return 1
		}
	fi
	say "building $folder"
	# on a terminal, show the progress
	if [ -t 1 ]; then ninja -C "$folder"; else ninja -C "$folder" --quiet; fi
}

# Fuzz targets are there only if clang was, when meson looked for it.
reconfigure_for_fuzzing() {
	local folder=$1
	[ -f "$folder/build.ninja" ] && ! grep -q 'fuzz-wire' "$folder/build.ninja" || return 0
	say "configuring $folder again, now with clang"
	meson setup --reconfigure "$folder" >"$folder/setup.log" 2>&1 || die "see $folder/setup.log"
}

build_main() {
	configure_and_build build || die "the build failed"
}
