# SPDX-License-Identifier: GPL-2.0-or-later
"""The doors: one file for each protocol. A door translates; it knows no device."""
