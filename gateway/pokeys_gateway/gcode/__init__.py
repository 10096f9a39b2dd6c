# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's own G-code: what is sent to a machine without a firmware of its own."""
