# SPDX-License-Identifier: GPL-2.0-or-later
"""What GladeVCP loads with pokeys_panel.ui: -U NAME shows this device only, -U runtime=DIR reads another daemon."""
from __future__ import annotations

from typing import Any

import gi

gi.require_version("Gtk", "3.0")
from gi.repository import Gtk  # noqa: E402  pylint: disable=wrong-import-position


def get_handlers(_component: Any, builder: Any, options: list[str]) -> list[Any]:
    """Fill the box. There are no signals to handle, and no pins: the panel reads shared memory."""
    named = [option for option in options if "=" not in option]
    others = dict(option.split("=", 1) for option in options if "=" in option)
    runtime = others.pop("runtime", None)
    try:
        if others:
            raise ValueError(f"-U {', '.join(others)}: there is only runtime=DIR")
        from pokeys_panel.view import Panel
        content = Panel(named, runtime)
    except Exception as error:      # an empty box would say nothing
        more = "; is python3-pokeys installed?" if isinstance(error, ImportError) else ""
        content = Gtk.Label(label=f"PoKeys: {error}{more}", wrap=True, margin=8)
    builder.get_object("pokeys").pack_start(content, True, True, 0)
    content.show_all()
    return []
