"""Drag and drop between programs on X11, the side that drags.

Protocol XDND, version 5: https://www.freedesktop.org/wiki/Specifications/XDND
"""

import ctypes
import ctypes.util
from ctypes import POINTER, Structure, Union, byref, c_char_p, c_int, c_long, c_uint, c_ulong, c_void_p
from pathlib import Path

CLIENT_MESSAGE, SELECTION_NOTIFY, SELECTION_REQUEST = 33, 31, 30
REPLACE = 0


class ClientMessage(Structure):
    _fields_ = [
        ("type", c_int),
        ("serial", c_ulong),
        ("send_event", c_int),
        ("display", c_void_p),
        ("window", c_ulong),
        ("message_type", c_ulong),
        ("format", c_int),
        ("data", c_long * 5),
    ]


class SelectionRequest(Structure):
    _fields_ = [
        ("type", c_int),
        ("serial", c_ulong),
        ("send_event", c_int),
        ("display", c_void_p),
        ("owner", c_ulong),
        ("requestor", c_ulong),
        ("selection", c_ulong),
        ("target", c_ulong),
        ("property", c_ulong),
        ("time", c_ulong),
    ]


class Selection(Structure):
    _fields_ = [
        ("type", c_int),
        ("serial", c_ulong),
        ("send_event", c_int),
        ("display", c_void_p),
        ("requestor", c_ulong),
        ("selection", c_ulong),
        ("target", c_ulong),
        ("property", c_ulong),
        ("time", c_ulong),
    ]


class Event(Union):
    _fields_ = [
        ("type", c_int),
        ("client", ClientMessage),
        ("request", SelectionRequest),
        ("selection", Selection),
        ("room", c_long * 24),
    ]


class Drag:
    """Files on their way to a window, as a file manager would bring them. `pump` answers what the window asks."""

    def __init__(self, display: str, target: int, files: list[Path], x: int, y: int) -> None:
        self.lib = ctypes.CDLL(ctypes.util.find_library("X11"))
        for name, result, *arguments in (
            ("XOpenDisplay", c_void_p, c_char_p),
            ("XDefaultRootWindow", c_ulong, c_void_p),
            ("XCreateSimpleWindow", c_ulong, c_void_p, c_ulong, c_int, c_int, c_uint, c_uint, c_uint, c_ulong, c_ulong),
            ("XInternAtom", c_ulong, c_void_p, c_char_p, c_int),
            ("XPending", c_int, c_void_p),
            ("XSetSelectionOwner", c_int, c_void_p, c_ulong, c_ulong, c_ulong),
            ("XFlush", c_int, c_void_p),
            ("XSendEvent", c_int, c_void_p, c_ulong, c_int, c_long, POINTER(Event)),
            ("XNextEvent", c_int, c_void_p, POINTER(Event)),
            ("XCloseDisplay", c_int, c_void_p),
            ("XChangeProperty", c_int, c_void_p, c_ulong, c_ulong, c_ulong, c_int, c_int, c_char_p, c_int),
        ):
            function = getattr(self.lib, name)
            function.restype, function.argtypes = result, arguments
        self.display = self.lib.XOpenDisplay(display.encode())
        assert self.display, display
        root = self.lib.XDefaultRootWindow(self.display)
        self.window = self.lib.XCreateSimpleWindow(self.display, root, 0, 0, 1, 1, 0, 0, 0)
        self.target, self.place, self.dropped, self.finished = target, (x << 16) | y, False, False
        self.text = "".join(f"{file.as_uri()}\r\n" for file in files).encode()
        self.lib.XSetSelectionOwner(self.display, self.atom("XdndSelection"), self.window, 0)
        self._send("XdndEnter", 5 << 24, self.atom("text/uri-list"), 0, 0)
        self._send("XdndPosition", 0, self.place, 0, self.atom("XdndActionCopy"))

    def atom(self, name: str) -> int:
        return self.lib.XInternAtom(self.display, name.encode(), 0)

    def pump(self) -> None:
        event = Event()
        while self.lib.XPending(self.display):
            self.lib.XNextEvent(self.display, byref(event))
            if event.type == CLIENT_MESSAGE and event.client.message_type == self.atom("XdndStatus"):
                assert event.client.data[1] & 1, "the window takes no files"
                if not self.dropped:
                    self.dropped = True
                    self._send("XdndDrop", 0, 0, 0, 0)
            elif event.type == SELECTION_REQUEST:
                self._answer(event.request)
            elif event.type == CLIENT_MESSAGE and event.client.message_type == self.atom("XdndFinished"):
                self.finished = True

    def close(self) -> None:
        self.lib.XCloseDisplay(self.display)

    def _send(self, name: str, *data: int) -> None:
        event = Event()
        event.client = ClientMessage(CLIENT_MESSAGE, 0, 1, None, self.target, self.atom(name), 32)
        event.client.data = (c_long * 5)(self.window, *data)
        self.lib.XSendEvent(self.display, self.target, 0, 0, byref(event))
        self.lib.XFlush(self.display)

    def _answer(self, request: SelectionRequest) -> None:
        self.lib.XChangeProperty(
            self.display, request.requestor, request.property, request.target, 8, REPLACE, self.text, len(self.text)
        )
        event = Event()
        event.selection = Selection(
            SELECTION_NOTIFY,
            0,
            1,
            None,
            request.requestor,
            request.selection,
            request.target,
            request.property,
            request.time,
        )
        self.lib.XSendEvent(self.display, request.requestor, 0, 0, byref(event))
        self.lib.XFlush(self.display)
