# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# What the project needs from Debian, and how it gets there. Sourced by ./run.
#
# Everything is a package of Debian 12 and 13. The Rust compiler has to be newer than
# their default one (iceoryx2 0.10 needs 1.89): a newer cargo on PATH is
# taken as it is, else the security archive's rustc-web and cargo-web.

PACKAGES_BUILD=(
	build-essential		# the compiler
	meson ninja-build pkg-config
	liburing-dev		# io_uring
	libinih-dev		# pokeysd.conf
	libcmocka-dev		# unit tests
	libclang-dev		# bindgen, for iceoryx2
	clang bpftool libbpf-dev	# the XDP guard, pokeysctl trace
	systemtap-sdt-dev	# probes for tracers
	libxdp-dev		# the AF_XDP transport
	scdoc			# man pages
	protobuf-compiler	# pokeys-remote's messages
	linuxcnc-uspace linuxcnc-uspace-dev	# HAL: to build against and to run
	python3 iproute2 procps util-linux
)
PACKAGES_TEST=(
	clang-format-19		# house / format
	strace			# system calls of the realtime thread
	systemd			# systemd-analyze
	python3-venv mypy	# the Python package
	python3-jsonschema python3-websockets inetutils-telnet netcat-openbsd curl	# the gateway's clients
)
PACKAGES_REMOTE=(python3-zmq python3-protobuf python3-zeroconf)	# pokeys-remote
PACKAGES_GATEWAY=(python3-aiohttp python3-prometheus-client python3-serial)	# the gateway, for Debian's Python
PACKAGES_PANEL=(xvfb gir1.2-gtk-3.0 python3-gi python3-pil)	# the panel, on a virtual screen
PACKAGES_WEB=(nodejs npm)	# the gateway's page; npm fetches what package-lock.json names
PACKAGES_BROWSER=(chromium)	# the page in a browser
PACKAGES_PLOTS=(gnuplot-nox)	# ./run plots
PACKAGES_FUZZ=(libclang-rt-dev)	# libFuzzer
PACKAGES_VM=(qemu-system-x86 mmdebstrap e2fsprogs)	# a PREEMPT_RT machine
PACKAGES_PACKAGE=(debhelper dpkg-dev dh-python esbuild apt-utils xz-utils systemd udev)	# ./run package
PACKAGES_RUST=(rustc-web cargo-web)
RUST_MINIMUM=1.89

say() { printf 'pokeysd: %s\n' "$*"; }
die() { printf 'pokeysd: %s\n' "$*" >&2; exit 1; }

as_root() {
	if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

package_installed() {
	[ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

# show_newest FILE: append standard input to FILE; on a terminal, show its newest line.
show_newest() {
	local line
	while IFS= read -r line; do
		printf '%s\n' "$line" >>"$1"
		[ ! -t 1 ] || printf '\r\033[K  %.70s' "$line"
	done
	[ ! -t 1 ] || printf '\r\033[K'
}

# Install those of the named packages that are missing, and say which.
install_packages() {
	local package log missing=()
	command -v dpkg-query >/dev/null && command -v apt-get >/dev/null || {
		say "this is not Debian, so it is for you to have what corresponds to: $*"
		return 0
	}
	for package; do
		package_installed "$package" || missing+=("$package")
	done
	[ ${#missing[@]} -gt 0 ] || return 0
	[ "$(id -u)" = 0 ] || command -v sudo >/dev/null ||
		die "not root and no sudo; as root run: apt-get install ${missing[*]}"
	say "installing with apt-get: ${missing[*]}"
	as_root apt-get -o Acquire::Retries=5 update -qq
	log=$(mktemp)
	as_root env DEBIAN_FRONTEND=noninteractive apt-get -o Acquire::Retries=5 install -y -q \
		--no-install-recommends "${missing[@]}" 2>&1 </dev/null | show_newest "$log" || {
		cat "$log" >&2
		rm -f "$log"
		die "apt-get could not install: ${missing[*]}"
	}
	rm -f "$log"
}

rust_is_new_enough() {
	local have
	command -v cargo >/dev/null && command -v rustc >/dev/null || return 1
	have=$(rustc --version 2>/dev/null | awk '{ sub(/-.*/, "", $2); print $2 }')
	[ -n "$have" ] && [ "$(printf '%s\n' "$RUST_MINIMUM" "$have" | sort -V | head -n 1)" = "$RUST_MINIMUM" ]
}

install_for_build() {
	install_packages "${PACKAGES_BUILD[@]}"
	command -v npm >/dev/null || install_packages "${PACKAGES_WEB[@]}"
	rust_is_new_enough || install_packages "${PACKAGES_RUST[@]}"
	rust_is_new_enough || die "rustc $RUST_MINIMUM or newer is needed, found: $(rustc --version 2>&1 || true)"
}

install_for_plots() {
	install_for_build
	install_packages "${PACKAGES_PLOTS[@]}"
}

install_for_package() {
	install_for_build
	install_packages "${PACKAGES_PACKAGE[@]}" "${PACKAGES_REMOTE[@]}"
}

install_for_gateway() {
	install_for_build
	install_packages "${PACKAGES_GATEWAY[@]}"
}

# install_for_test [SUITE ...]
install_for_test() {
	local packages=("${PACKAGES_TEST[@]}" "${PACKAGES_REMOTE[@]}")

	[[ ! " $* " =~ " "(gateway|web|soak)" " ]] || packages+=("${PACKAGES_GATEWAY[@]}")
	[[ " $* " != *" linuxcnc "* ]] || packages+=("${PACKAGES_PANEL[@]}")
	[[ " $* " != *" web "* ]] || packages+=("${PACKAGES_BROWSER[@]}")
	[[ " $* " != *" fuzz "* ]] || packages+=("${PACKAGES_FUZZ[@]}")
	[[ " $* " != *" vm "* ]] || packages+=("${PACKAGES_VM[@]}" "${PACKAGES_PACKAGE[@]}")
	[[ " $* " != *" package "* ]] || packages+=("${PACKAGES_PACKAGE[@]}" lintian mmdebstrap)
	install_for_build
	# Python 3.13 no longer includes telnetlib
	/usr/bin/python3 -W ignore -c 'import telnetlib' 2>/dev/null || packages+=(python3-zombie-telnetlib)
	install_packages "${packages[@]}"
}
