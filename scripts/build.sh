# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Configure and build one build folder. Sourced by ./run.

# configure_and_build FOLDER [meson option ...]
configure_and_build() {
	local folder=$1
	shift
	if [ ! -f "$folder/build.ninja" ]; then
		say "configuring $folder"
		mkdir -p "$folder"
		# left by a configuring that was interrupted, it is "already configured" for meson
		rm -f "$folder/meson-private/coredata.dat"
		meson setup "$folder" "$@" >"$folder/setup.log" 2>&1 || {
			cat "$folder/setup.log" >&2
			return 1
		}
	fi
	say "building $folder"
	ninja -C "$folder" --quiet
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
