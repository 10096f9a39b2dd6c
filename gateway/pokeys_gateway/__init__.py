# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-gateway(8): PoKeys devices for browsers and for Prometheus.

A process of its own beside pokeysd. It reads the daemon's mirror through the package pokeys, so
neither the daemon nor LinuxCNC notices how many clients it has, or whether it runs at all.
"""
__version__ = "0.1.0"
