# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-remote: components of LinuxCNC's HAL whose code runs elsewhere.

``pokeys_machinetalk_pb2`` is made from pokeys_machinetalk.proto when pokeysd is built.
"""

__version__ = "0.1.0"
