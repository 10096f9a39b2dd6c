# SPDX-License-Identifier: GPL-2.0-or-later
"""A panel for LinuxCNC's screen: state, inputs, outputs and faults of PoKeys devices.

It reads the shared memory that may only be read, so it cannot disturb LinuxCNC or the daemon.
"""
