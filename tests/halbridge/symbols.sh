#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# symbols.sh MODULE.so [PATTERN]: what the module wants from LinuxCNC and what it shows.
#
# It may want HAL's and RTAPI's functions and the C library's, nothing else: an
# undefined symbol of another library would only be noticed on the user's
# machine. It may show what the loader looks for; whatever else it showed would
# be seen by every module loaded after it. PATTERN is what it is to show besides.
set -eu
module=$1 besides=${2:-^$}
command -v nm >/dev/null || { echo "nm is not installed (binutils)" >&2; exit 77; }

wanted=$(nm -D --undefined-only "$module" | awk '$1 != "w" { print $2 }' |
	grep -Ev '^(hal|rtapi)_[a-z0-9_]+$|@GLIBC_|@GCC_' || true)
shown=$(nm -D --defined-only "$module" | awk '{ print $3 }' |
	grep -Ev '^rtapi_app_(main|exit)$|^rtapi_info_' | grep -Ev "$besides" || true)
loader=$(nm -D --defined-only "$module" | grep -cE ' T rtapi_app_(main|exit)$' || true)

[ -z "$wanted" ] || { echo "it wants what LinuxCNC does not have:"; echo "$wanted"; exit 1; }
[ -z "$shown" ] || { echo "it shows more than the loader needs:"; echo "$shown"; exit 1; }
[ "$loader" = 2 ] || { echo "rtapi_app_main and rtapi_app_exit are not both there"; exit 1; }
