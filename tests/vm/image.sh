#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-2.0-or-later
# Build the disk of the virtual machine: Debian 12, its PREEMPT_RT kernel,
# systemd, cyclictest, stress-ng and LinuxCNC's realtime part.
#
#	image.sh FOLDER	[packages]	leaves FOLDER/{disk.ext4,vmlinuz,initrd}
#
# LinuxCNC comes out of its package without its dependencies: the graphical
# half of them would double the disk and nothing here draws. With "packages" it
# is installed, for the packages that depend on it. The shares are
# mounted by fstab, the test is a unit like any other; all that is tested is
# brought in from outside, so that a change of ours does not make a new disk.
set -euo pipefail
export LC_ALL=C

folder=$1 kind=${2:-image}
packages=(
	systemd systemd-sysv udev kmod initramfs-tools
	linux-image-rt-amd64
	procps psmisc iproute2 ethtool util-linux
	libc6 libgcc-s1 libstdc++6 libinih1 liburing2 libedit2
	rt-tests stress-ng
	python3 python3-aiohttp python3-prometheus-client python3-serial
)

if [ "$kind" = packages ]; then
	packages+=(linuxcnc-uspace python3-zmq python3-protobuf python3-zeroconf libbpf1 libxdp1 grub2-common)
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$folder"

cat >"$work/modules" <<-MODULES
	virtio_pci
	virtio_blk
	ext4
	9pnet_virtio
	9p
MODULES

cat >"$work/vm-test.service" <<-UNIT
	[Unit]
	Description=What the virtual machine is for
	After=multi-user.target
	RequiresMountsFor=/in /out

	[Service]
	Type=oneshot
	ExecStart=/bin/bash /in/guest.sh
	ExecStopPost=/bin/systemctl --no-block poweroff
	StandardOutput=journal+console
	StandardError=journal+console

	[Install]
	WantedBy=graphical.target multi-user.target
UNIT

# The initrd is built while the kernel is installed: it has to find its list.
early() {
	printf '%s\n' \
		"mkdir -p \"\$1/etc/initramfs-tools/conf.d\"" \
		"cp $work/modules \"\$1/etc/initramfs-tools/modules\"" \
		"echo MODULES=list >\"\$1/etc/initramfs-tools/conf.d/vm\""
}

echo "image: installing ${#packages[@]} packages" >&2
mmdebstrap --quiet --variant=minbase \
	--aptopt='Acquire::Retries "5"' \
	--include="$(IFS=,; echo "${packages[*]}")" \
	--essential-hook="$(early)" \
	--dpkgopt='path-exclude=/usr/share/doc/*' \
	--dpkgopt='path-exclude=/usr/share/man/*' \
	--dpkgopt='path-exclude=/usr/share/locale/*' \
	--dpkgopt='path-exclude=/lib/modules/*/kernel/drivers/gpu/*' \
	--dpkgopt='path-exclude=/lib/modules/*/kernel/drivers/media/*' \
	--dpkgopt='path-exclude=/lib/modules/*/kernel/sound/*' \
	bookworm "$work/tree"

[ "$kind" = packages ] || (
	echo "image: adding LinuxCNC" >&2
	cd "$work"
	apt-get -o Acquire::Retries=5 download -qq linuxcnc-uspace
	dpkg-deb --fsys-tarfile linuxcnc-uspace_*.deb |
		tar -x --keep-directory-symlink --wildcards -C tree \
			./etc/linuxcnc ./usr/bin ./usr/lib/linuxcnc './usr/lib/lib*'
)

cp "$work/vm-test.service" "$work/tree/etc/systemd/system/"
mkdir -p "$work/tree/in" "$work/tree/out" \
	"$work/tree/etc/systemd/system/multi-user.target.wants"
ln -s ../vm-test.service "$work/tree/etc/systemd/system/multi-user.target.wants/"
printf '%s\n' \
	'/dev/vda / ext4 rw 0 1' \
	'in /in 9p trans=virtio,version=9p2000.L,ro,msize=262144 0 0' \
	'out /out 9p trans=virtio,version=9p2000.L,rw,msize=262144 0 0' \
	>"$work/tree/etc/fstab"
echo pokeys-vm >"$work/tree/etc/hostname"
echo 'blacklist kvm_intel
blacklist kvm_amd' >"$work/tree/etc/modprobe.d/no-kvm.conf"
chroot "$work/tree" useradd --create-home --shell /bin/bash cnc

cp -L "$work"/tree/boot/vmlinuz-* "$folder/vmlinuz"
cp -L "$work"/tree/boot/initrd.img-* "$folder/initrd"
rm -rf "$work"/tree/boot/* "$work"/tree/var/cache/apt/*
# apt needs the lists to install a package's file
[ "$kind" = packages ] || rm -rf "$work"/tree/var/lib/apt/lists/*
mke2fs -q -t ext4 -d "$work/tree" -O ^has_journal "$folder/disk.ext4" \
	"$(($(du -sm "$work/tree" | cut -f1) * 5 / 4 + 200))M"
