# SPDX-License-Identifier: GPL-2.0-or-later
"""The console: clients that send lines to a machine and see what it says, as ESP3D has them."""
