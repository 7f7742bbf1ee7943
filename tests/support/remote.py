"""A remote control of `play --osc`."""

from __future__ import annotations

import socket
from typing import Any


class Remote:
    """A program that sends OSC to a local port and receives the answers."""

    def __init__(self, port: int) -> None:
        self.socket, self.port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), port
        self.socket.settimeout(10)

    def send(self, name: str, *values: float | int | str) -> None:
        from pythonosc.osc_message_builder import OscMessageBuilder

        message: Any = OscMessageBuilder(f"/livebass/{name}")
        for value in values:
            message.add_arg(value)
        self.socket.sendto(message.build().dgram, ("127.0.0.1", self.port))

    def hear(self) -> tuple[str, list[Any]]:
        from pythonosc.osc_message import OscMessage

        message = OscMessage(self.socket.recv(65536))
        return message.address.removeprefix("/livebass/"), message.params

    def ask(self, name: str) -> Any:
        self.send(name)
        address, values = self.hear()
        assert address == name, (address, values)
        return values[0]
