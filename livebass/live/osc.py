"""A control socket: Open Sound Control over UDP, for programs on this machine. [its own thread]

A message to an address of the table sets a control; without arguments the reply is the control's value. Needs
python-osc, which is imported when a server is made.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from livebass.system.extras import install

LOG = logging.getLogger(__name__)
HOST = "127.0.0.1"  # this machine only
PREFIX = "/livebass/"
LIST, METERS, SUBSCRIBE, UNSUBSCRIBE, ERROR = "list", "meters", "subscribe", "unsubscribe", "error"
MAX_SUBSCRIBERS = 8
Value = float | int | str
Sender = tuple[str, int]  # address and port


class OscLost(OSError):
    """The control socket cannot be opened; one line."""


@dataclass(frozen=True)
class Control:
    """Serves an address: `write` raises ValueError for values that it refuses, TypeError for too few or too many."""

    write: Callable[..., object]
    read: Callable[[], Value] | None = None


class OscServer:
    """Serves `controls` and `meters` by name on UDP `port`. Raises OscLost."""

    def __init__(self, port: int, controls: Mapping[str, Control], meters: Callable[[], Mapping[str, Value]]) -> None:
        try:
            from pythonosc.dispatcher import Dispatcher
            from pythonosc.osc_server import BlockingOSCUDPServer
        except ImportError as error:
            raise OscLost(f"--osc: {' '.join(str(error).split())}; {install('osc')}") from None

        class Server(BlockingOSCUDPServer):  # type: ignore[misc, unused-ignore]
            def handle_error(self, _request: object, _sender: object) -> None:
                LOG.debug("a packet to the control socket failed", exc_info=True)

        dispatcher = Dispatcher()
        dispatcher.set_default_handler(self._answer, needs_reply_address=True)
        self.controls, self.meters = controls, meters
        self._subscribers: list[Sender] = []
        try:
            self._server = Server((HOST, port), dispatcher)
        except OSError as error:
            raise OscLost(f"--osc {port}: {error.strerror or error}") from None
        self.port = int(self._server.server_address[1])
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def publish(self) -> None:
        """Sends the meters to the subscribers. [main thread]"""
        for sender in list(self._subscribers):
            self._send_meters(sender)

    def _answer(self, sender: Sender, address: str, *values: Value) -> None:
        """Handles one message."""
        name = address.removeprefix(PREFIX)
        control = self.controls.get(name) if address.startswith(PREFIX) else None
        try:
            if control is not None and values:
                control.write(*values)
            elif control is not None and control.read is None:
                control.write()
            elif control is not None:
                self._send_value(sender, name, control)
            elif address == PREFIX + LIST:
                for each, one in self.controls.items():
                    self._send_value(sender, each, one)
            elif address == PREFIX + METERS:
                self._send_meters(sender)
            elif address == PREFIX + SUBSCRIBE:
                others = [other for other in self._subscribers if other != sender]
                self._subscribers = [*others, sender][-MAX_SUBSCRIBERS:]
            elif address == PREFIX + UNSUBSCRIBE:
                self._subscribers = [other for other in self._subscribers if other != sender]
            else:
                raise ValueError(f"there is no such address; {PREFIX}{LIST} names all")
        except ValueError as error:
            self._send(sender, ERROR, f"{address}: {error}")
        except TypeError:
            self._send(sender, ERROR, f"{address}: does not take {len(values)} values")

    def _send_value(self, sender: Sender, name: str, control: Control) -> None:
        self._send(sender, name, *([control.read()] if control.read else []))

    def _send_meters(self, sender: Sender) -> None:
        for name, value in self.meters().items():
            self._send(sender, f"meter/{name}", value)

    def _send(self, sender: Sender, name: str, *values: Value) -> None:
        from pythonosc.osc_message_builder import OscMessageBuilder

        message: Any = OscMessageBuilder(PREFIX + name)
        for value in values:
            message.add_arg(value)
        with suppress(OSError):  # nobody listens there any more
            self._server.socket.sendto(message.build().dgram, sender)
