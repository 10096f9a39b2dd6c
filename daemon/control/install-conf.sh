#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# install-conf.sh FOLDER: pokeysd.conf into it, unless there is one.
set -eu
folder=${DESTDIR:-}$1
if [ -e "$folder/pokeysd.conf" ]; then
	echo "$folder/pokeysd.conf is there and stays as it is"
	exit 0
fi
mkdir -p "$folder"
install -m 0644 "$(dirname "$0")/pokeysd.conf.example" "$folder/pokeysd.conf"
echo "Installing pokeysd.conf to $folder"
