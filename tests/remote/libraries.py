# SPDX-License-Identifier: GPL-2.0-or-later
"""Skips a test if a Python package that it needs is missing."""
import importlib
import sys


def need(*modules):
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError as missing:
            print(f"skipped: {missing} (Debian: python3-zmq, python3-protobuf)")
            sys.exit(77)
