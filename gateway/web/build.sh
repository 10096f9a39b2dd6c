#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# Check and bundle the page.
# usage: build.sh SOURCE WORK OUTPUT
# SOURCE is this folder. The packages of package-lock.json are installed into WORK, and again only if that file
# changes. OUTPUT gets index.html, page.js, page.css and licenses.txt.
set -eu

source=$1 work=$2 output=$3

mkdir -p "$work"
if ! cmp -s "$source/package-lock.json" "$work/installed-lock.json"; then
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
node_modules/.bin/tsc --project tsconfig.json
node_modules/.bin/esbuild src/page.tsx --bundle --minify --format=esm --target=es2022 --jsx=automatic \
	--jsx-import-source=preact --log-level=warning --outdir="$output"
cp "$source/index.html" "$output"
for package in preact uplot; do
	printf '%s %s\n\n' "$package" "$(node -p "require('./node_modules/$package/package.json').version")"
	cat "node_modules/$package/LICENSE"
	echo
done >"$output/licenses.txt"
