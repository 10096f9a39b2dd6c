# SPDX-License-Identifier: GPL-2.0-or-later
"""The panel as a GTK widget. Everything runs in GTK's main loop, which reading a state does not hold up.

Nothing in it takes the keyboard: AXIS moves axes with keys. A widget is changed only if its content has changed.
"""
from __future__ import annotations

import functools
import logging
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import gi
import pokeys

from . import picture

gi.require_version("Gtk", "3.0")
from gi.repository import Gdk, GLib, Gtk, Pango  # noqa: E402  pylint: disable=wrong-import-position

REFRESH_MS, SEARCH_MS, EVENTS_MS, EVENTS = 100, 1000, 1000, 8
NO_DATA = "no data"
LOCK = Path("/tmp/linuxcnc.lock")
AGES = 10       # so many times less often than the rest, so that a person can read it
STYLE = b"""
.pokeys-name, .pokeys-wrong { font-weight: bold; }
.pokeys-word { border-radius: 4px; padding: 1px 6px; color: white; }
.pokeys-good { background-color: #1a7f37; }
.pokeys-warning { background-color: #9a6700; }
.pokeys-bad { background-color: #cf222e; }
.pokeys-lamps flowboxchild { padding: 1px; }
.pokeys-lamp { border: 1px solid alpha(currentColor, 0.4); border-radius: 4px; padding: 1px 4px; min-width: 18px; }
.pokeys-lamp.on { background-color: #2da44e; color: white; border-color: #2da44e; }
.pokeys-old { opacity: 0.45; }
.pokeys-event { font-size: small; }
"""
_LOG = logging.getLogger("pokeys-panel")


def _label(text: str = "", *classes: str, wrap: bool = False) -> Gtk.Label:
    label = Gtk.Label(label=text, xalign=0)
    if wrap:
        label.set_line_wrap(True)
        label.set_line_wrap_mode(Pango.WrapMode.WORD_CHAR)
        label.set_width_chars(20)
        label.set_max_width_chars(40)
    for name in classes:
        label.get_style_context().add_class(name)
    return label


def _set_text(label: Gtk.Label, text: str) -> None:
    """GTK lays out a label again for the same text as well."""
    if label.get_text() != text:
        label.set_text(text)


def _set_class(widget: Gtk.Widget, name: str, on: bool) -> None:
    context = widget.get_style_context()
    if on and not context.has_class(name):
        context.add_class(name)
    elif not on and context.has_class(name):
        context.remove_class(name)


def _optional(widget: Gtk.Widget) -> Gtk.Widget:
    """It decides itself whether it is to be seen."""
    widget.show_all()
    widget.set_no_show_all(True)
    widget.set_visible(False)
    return widget


class Lamps(Gtk.Box):
    """A heading, and a lamp for each input or output. Without any, it is not shown."""

    def __init__(self, heading: str) -> None:
        super().__init__(orientation=Gtk.Orientation.VERTICAL, spacing=2)
        self._flow = Gtk.FlowBox(selection_mode=Gtk.SelectionMode.NONE, max_children_per_line=16, can_focus=False)
        self._flow.get_style_context().add_class("pokeys-lamps")
        self._labels: list[Gtk.Label] = []
        self._lamps: tuple[picture.Lamp, ...] = ()
        self.pack_start(_label(heading), False, False, 0)
        self.pack_start(self._flow, False, False, 0)

    def show_lamps(self, lamps: tuple[picture.Lamp, ...]) -> None:
        """Show these, and no others."""
        if lamps == self._lamps:
            return
        if [lamp.name for lamp in lamps] != [lamp.name for lamp in self._lamps]:
            self._make(lamps)
        self._lamps = lamps
        for lamp, label in zip(lamps, self._labels, strict=True):
            _set_class(label, "on", lamp.on)
        self.set_visible(bool(lamps))

    def _make(self, lamps: tuple[picture.Lamp, ...]) -> None:
        for child in self._flow.get_children():
            self._flow.remove(child)
        self._labels = [_label(lamp.name, "pokeys-lamp") for lamp in lamps]
        for label in self._labels:
            label.set_xalign(0.5)
            child = Gtk.FlowBoxChild(can_focus=False)
            child.add(label)
            self._flow.add(child)
        self._flow.show_all()


class Lines(Gtk.Grid):
    """Axes, motors, heaters and PWM outputs: name, value, state. Long words wrap."""

    def __init__(self) -> None:
        super().__init__(column_spacing=10)
        self._rows: list[tuple[Gtk.Label, ...]] = []
        self._lines: tuple[picture.Line, ...] = ()

    def show_lines(self, lines: tuple[picture.Line, ...]) -> None:
        """Show these, and no others."""
        if lines == self._lines:
            return
        self._lines = lines
        while len(self._rows) > len(lines):
            for label in self._rows.pop():
                self.remove(label)
        while len(self._rows) < len(lines):
            self._add_row()
        for line, row in zip(lines, self._rows, strict=True):
            for label, text in zip(row, (line.name, line.value, line.words), strict=True):
                _set_text(label, text)
                _set_class(label, "pokeys-wrong", line.bad)

    def _add_row(self) -> None:
        name, value, words = row = _label(), _label(), _label(wrap=True)
        name.set_ellipsize(Pango.EllipsizeMode.END)
        name.set_max_width_chars(14)
        value.set_xalign(1)
        words.set_width_chars(10)
        words.set_hexpand(True)
        for column, label in enumerate(row):
            label.set_valign(Gtk.Align.START)
            self.attach(label, column, len(self._rows), 1, 1)
            label.show()
        self._rows.append(row)


class DeviceView(Gtk.Box):
    """One device."""

    def __init__(self, name: str) -> None:
        super().__init__(orientation=Gtk.Orientation.VERTICAL, spacing=6)
        self._word, self._age, self._turns = _label("", "pokeys-word"), _label(), 0
        title = _label(name, "pokeys-name")
        title.set_ellipsize(Pango.EllipsizeMode.END)
        head = Gtk.Box(spacing=8)
        head.pack_start(title, True, True, 0)
        head.pack_end(self._word, False, False, 0)
        self._notes = _optional(_label("", "pokeys-wrong", wrap=True))
        self._inputs, self._outputs = _optional(Lamps("Inputs")), _optional(Lamps("Outputs"))
        self._lines, self._events = Lines(), _label("", "pokeys-event", wrap=True)
        self._markup = ""
        for widget in (head, self._age, self._notes, self._inputs, self._outputs, self._lines, self._events):
            self.pack_start(widget, False, False, 0)

    def show_picture(self, seen: picture.Picture) -> None:
        """Show a device as it is now."""
        _set_text(self._word, seen.word)
        for level in (picture.GOOD, picture.WARNING, picture.BAD):
            _set_class(self._word, f"pokeys-{level}", level == seen.level)
        if self._turns % AGES == 0 or seen.age == "" or self._age.get_text() == NO_DATA:
            _set_text(self._age, f"data {seen.age} old" if seen.age else NO_DATA)
        self._turns += 1
        _set_text(self._notes, "\n".join(seen.notes))
        self._notes.set_visible(bool(seen.notes))
        self._inputs.show_lamps(seen.inputs)
        self._outputs.show_lamps(seen.outputs)
        self._lines.show_lines(seen.lines)
        for widget in (self._inputs, self._outputs, self._lines):
            _set_class(widget, "pokeys-old", seen.old)

    def show_events(self, events: list[pokeys.Event]) -> None:
        """Show what has happened last, the newest first."""
        lines = []
        for event in reversed(events[-EVENTS:]):
            text = GLib.markup_escape_text(f"{when(event.time)}  {event.text}")
            lines.append(f"<b>{text}</b>" if event.level in ("error", "warning") else text)
        markup = "\n".join(lines)
        if markup != self._markup:
            self._markup = markup
            self._events.set_markup(markup)


def when(time: datetime, now: datetime | None = None) -> str:
    """The time of day here, and the date if it is not today's."""
    here = time.astimezone()
    today = (now or datetime.now().astimezone()).date()
    return f"{here:%H:%M:%S}" if here.date() == today else f"{here:%Y-%m-%d %H:%M:%S}"


def _again(step: Callable[[Panel], None]) -> Callable[[Panel], bool]:
    """A step of the panel as GLib calls it: whatever fails, it is called again."""
    said = ""

    @functools.wraps(step)
    def run(self: Panel) -> bool:
        nonlocal said
        try:
            step(self)
        except Exception as error:
            if said != repr(error):     # not ten times a second
                _LOG.exception("%s failed", step.__name__)
            said = repr(error)
        return True
    return run


class Panel(Gtk.ScrolledWindow):
    """All devices of a daemon, or those that are named. It waits for a daemon, and finds the next one."""

    def __init__(self, names: list[str], runtime: str | None = None) -> None:
        super().__init__(hscrollbar_policy=Gtk.PolicyType.NEVER, vscrollbar_policy=Gtk.PolicyType.AUTOMATIC,
                         can_focus=False, propagate_natural_height=True, max_content_height=600)
        self._names, self._runtime = names, runtime
        self._devices: dict[str, pokeys.Device] = {}
        self._views: dict[str, DeviceView] = {}
        self._box = Gtk.Box(orientation=Gtk.Orientation.VERTICAL, spacing=14, border_width=8)
        self._missing = _optional(_label("", "pokeys-wrong", wrap=True))
        self._box.pack_start(self._missing, False, False, 0)
        self.add(self._box)
        style = Gtk.CssProvider()
        style.load_from_data(STYLE)
        Gtk.StyleContext.add_provider_for_screen(Gdk.Screen.get_default(), style,
                                                 Gtk.STYLE_PROVIDER_PRIORITY_APPLICATION)
        timers = []
        for step, pause in ((self._search, SEARCH_MS), (self._refresh, REFRESH_MS), (self._read_events, EVENTS_MS)):
            step()
            timers.append(GLib.timeout_add(pause, step))
        self.connect("destroy", self._end, timers)

    def _end(self, _widget: Gtk.Widget, timers: list[int]) -> None:
        for timer in timers:
            GLib.source_remove(timer)
        while self._devices:
            self._devices.popitem()[1].close()

    @_again
    def _search(self) -> None:
        """Attach to devices that are new, and forget those that the daemon no longer has."""
        why = ""
        try:
            there = pokeys.devices(self._runtime)
            if not there:
                why = (f"no pokeysd runs in {self._runtime or '/run/pokeysd'}; "
                       "start it with: sudo systemctl start pokeysd")
        except (pokeys.Error, OSError, ValueError) as error:
            there, why = [], str(error)
        for name in self._names or there:
            if name not in self._views:
                self._views[name] = view = DeviceView(name)
                self._box.pack_start(view, False, False, 0)
                view.show_all()
            if name not in self._devices:
                self._attach(name)
        for name in set(self._views) - set(self._names or there or self._views):
            self._views.pop(name).destroy()
            if name in self._devices:
                self._devices.pop(name).close()
        _set_text(self._missing, why)
        self._missing.set_visible(not self._views)

    def _attach(self, name: str) -> None:
        try:
            self._devices[name] = pokeys.attach(name, runtime=self._runtime)
        except (pokeys.Error, OSError, ValueError) as error:
            self._views[name].show_picture(picture.without(name, error))

    @_again
    def _refresh(self) -> None:
        for name, device in self._devices.items():
            try:
                seen = picture.of(name, device.read(stale_ok=True))
            except Exception as error:      # one device is not to hide the others
                seen = picture.without(name, error)
            self._views[name].show_picture(seen)

    @_again
    def _read_events(self) -> None:
        for name, device in self._devices.items():
            try:
                events = device.recent_events()
            except Exception:
                events = []         # the daemon has ended, so its events are out of date
            self._views[name].show_events(events)


def _end_with_linuxcnc(lock: Path) -> None:
    """LinuxCNC ends only its own programs. Its lock is there from its start to its end."""
    def which() -> tuple[int, int] | None:
        try:
            found = lock.stat()
        except OSError:
            return None
        return found.st_ino, found.st_mtime_ns

    began = which()

    def look() -> bool:
        nonlocal began
        now = which()
        if began and now != began:
            Gtk.main_quit()
        began = now
        return True
    GLib.timeout_add(SEARCH_MS, look)


def window(names: list[str], runtime: str | None, *, with_linuxcnc: bool) -> Any:
    """A window of its own, for screens into which nothing can be embedded."""
    if with_linuxcnc:
        _end_with_linuxcnc(LOCK)
    found = Gtk.Window(title="PoKeys", default_width=420, default_height=640)
    found.add(Panel(names, runtime))
    found.connect("destroy", Gtk.main_quit)
    found.show_all()
    return found
