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
		meson setup "$folder" "$@" >"$folder/setup.log" 2>&1 || {
			cat "$folder/setup.log" >&2
			return 1
		}
	fi
	say "building $folder"
	ninja -C "$folder" --quiet
}

build_main() {
	configure_and_build build || die "the build failed"
}
