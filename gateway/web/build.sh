#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# Check and bundle the page.
# usage: build.sh SOURCE WORK OUTPUT [PACKAGES]
# SOURCE is this folder. The packages of package-lock.json are installed into WORK, and again only if that file
# changes. OUTPUT gets index.html, page.js, page.css and licenses.txt. If PACKAGES is given, preact and uplot are
# taken from that folder and the tools from the path.
set -eu

source=$1 work=$2 output=$3 packages=${4:-}

mkdir -p "$work"
if [ -n "$packages" ]; then
	rm -rf "$work/node_modules"
	ln -s "$packages" "$work/node_modules"
	export NODE_PATH="$packages"	# they import each other
	esbuild=esbuild tsc=$(command -v tsc || echo true)
else
	esbuild=node_modules/.bin/esbuild tsc=node_modules/.bin/tsc
fi
if [ -z "$packages" ] && ! cmp -s "$source/package-lock.json" "$work/installed-lock.json"; then
	rm -f "$work/installed-lock.json"
	cp "$source/package.json" "$source/package-lock.json" "$work"
	# npm says on standard output what it has done, and nobody asked
	(cd "$work" && npm ci --prefer-offline --ignore-scripts --no-audit --no-fund --loglevel=error >npm.log) || {
		echo "gateway/web: npm could not install the packages of package-lock.json (it needs the network once);" \
			"-Dpage=disabled builds without the page" >&2
		exit 1
	}
	cp "$source/package-lock.json" "$work/installed-lock.json"
fi
# the sources are where their packages are found
rm -rf "$work/src"
cp -r "$source/src" "$source/tsconfig.json" "$work"
cd "$work"
"$tsc" --project tsconfig.json
"$esbuild" src/page.tsx --bundle --minify --format=esm --target=es2022 --jsx=automatic \
	--jsx-import-source=preact --log-level=warning --outdir="$output"
cp "$source/index.html" "$output"
for package in preact uplot; do
	printf '%s %s\n\n' "$package" \
		"$(sed -n 's/^ *"version": "\(.*\)".*/\1/p' "node_modules/$package/package.json" | head -n 1)"
	cat "node_modules/$package/LICENSE"
	echo
done >"$output/licenses.txt"
