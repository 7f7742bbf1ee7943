"""Serves the page to this machine alone: its files, from memory, on a port of 127.0.0.1. [threads of their own]

Requests for another host's name are refused: they come from pages of other sites, which must not read this one.
"""

from __future__ import annotations

import hmac
import json
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self
from urllib.parse import parse_qs, unquote, urlsplit

from livebass.web.export import INDEX

HOST = "127.0.0.1"
KINDS = {
    "html": "text/html; charset=utf-8", "js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8",
    "wasm": "application/wasm",
}  # fmt: skip
PATIENCE = 10.0  # s, for a silent browser
Streams = Mapping[str, Callable[[], Iterator[bytes]]]
NO_STREAMS: Streams = {}
OPENS = "open"  # the path that takes a file, with its name in the query
LARGEST = 24 << 20  # bytes


class PageLost(OSError):
    """The port cannot be opened; the message is one line."""


def check_port(port: int) -> None:
    """Raises PageLost if nothing can be served on `port` of this machine now; 0: any free port."""
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does
        with _opening(port):
            trial.bind((HOST, port))
            trial.listen()


@contextmanager
def _opening(port: int) -> Iterator[None]:
    """Turns an OSError in the block into a PageLost about `port`."""
    try:
        yield
    except OSError as error:
        raise PageLost(f"--port {port}: {error.strerror or error}") from None


def is_under(root: str, path: str) -> bool:
    """True if a path begins with `root`; the time taken does not reveal how much of it matches."""
    return hmac.compare_digest(path[: len(root)].encode(), root.encode())


class PageServer:
    """Serves `files`, by path, until it is closed; `port` 0: any free port. Raises PageLost.

    A path in `streams` is answered with all that its iterator yields. With a `token` all paths begin with it; requests
    without it get nothing. `opens`, if given, answers with data about the bytes and the name of a file that the page
    sends, or raises an error of one line.
    """

    def __init__(
        self, files: Mapping[str, bytes], port: int = 0, streams: Streams = NO_STREAMS, token: str = "",
        opens: Callable[[bytes, str], dict[str, Any]] | None = None,
    ) -> None:  # fmt: skip
        closing = self._closing = threading.Event()
        self._root = f"/{token}/" if token else "/"
        root = self._root

        class Handler(BaseHTTPRequestHandler):
            timeout = PATIENCE

            def do_GET(self) -> None:
                self._answer(True)

            def do_HEAD(self) -> None:
                self._answer(False)

            def do_POST(self) -> None:
                if opens is None:
                    self.send_error(HTTPStatus.NOT_IMPLEMENTED)
                    return
                if self._path() != OPENS or self.headers.get("Origin") is None:
                    self.send_error(HTTPStatus.FORBIDDEN)
                    return
                size = self.headers.get("Content-Length", "")
                if not size.isdecimal() or int(size) > LARGEST:
                    self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
                    return
                name = parse_qs(urlsplit(self.path).query).get("name", ["tablature"])[0]
                status = HTTPStatus.OK
                try:
                    answer = json.dumps(opens(self.rfile.read(int(size)), name))
                except (ValueError, LookupError) as error:
                    status, answer = HTTPStatus.UNPROCESSABLE_ENTITY, str(error)
                self._send(answer.encode(), "application/json", status)

            def _path(self) -> str | None:
                """The asked path; None if another site or program asks."""
                port = self.connection.getsockname()[1]
                own = f"{HOST}:{port}", f"localhost:{port}"
                requested, place = unquote(urlsplit(self.path).path), self.headers.get("Host", "")
                origin = self.headers.get("Origin")
                if place not in own or origin not in (None, f"http://{place}") or not is_under(root, requested):
                    return None
                return requested[len(root) :] or INDEX

            def _answer(self, with_data: bool) -> None:
                path = self._path()
                if path is None:
                    self.send_error(HTTPStatus.FORBIDDEN)
                    return
                if path in streams:
                    self._stream(streams[path](), with_data)
                    return
                data = files.get(path)
                if data is None:
                    self.send_error(HTTPStatus.NOT_FOUND)
                    return
                kind = KINDS.get(path.rpartition(".")[2], "application/octet-stream")
                self._send(data, kind, HTTPStatus.OK, with_data)

            def _send(self, data: bytes, kind: str, status: HTTPStatus, with_data: bool = True) -> None:
                self.send_response(status)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(data)))
                self.send_header("Cache-Control", "no-store")  # the next page at this port may be another one
                self.send_header("X-Content-Type-Options", "nosniff")
                self.end_headers()
                if with_data:
                    self.wfile.write(data)

            def _stream(self, found: Iterator[bytes], with_data: bool) -> None:
                self.send_response(HTTPStatus.OK)
                self.send_header("Content-Type", "application/octet-stream")
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                for data in found if with_data else ():
                    if closing.is_set():
                        break
                    self.wfile.write(data)

            def log_message(self, *_: object) -> None:
                pass

        class Server(ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, *_: object) -> None:
                pass  # a browser that went away

        with _opening(port):
            self._server = Server((HOST, port), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, name="page", daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """The page's address for a browser on this machine."""
        return f"http://{HOST}:{self._server.server_port}{self._root}"

    def close(self) -> None:
        """Ends the server and its streams."""
        self._closing.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
