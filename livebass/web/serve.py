"""Serves the page to this machine alone: its files, from memory, on a port of 127.0.0.1. [threads of their own]

Requests for another host's name are refused: they come from pages of other sites, which must not read this one.
Slow, endless and many requests take bounded time, memory and threads; each gets an answer.
"""

from __future__ import annotations

import hmac
import io
import json
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from http import HTTPStatus
from http.client import HTTPException
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self
from urllib.parse import parse_qs, unquote, urlsplit

from livebass.web.export import INDEX

HOST = "127.0.0.1"
KINDS = {
    "html": "text/html; charset=utf-8", "js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8",
    "wasm": "application/wasm",
}  # fmt: skip
PATIENCE = 10.0  # s, for a whole request, and for its answer
LINGER = 2.0  # s in which a client reads an answer that it did not wait for
MAX_CONNECTIONS = 128
MAX_OPENING = 4  # files at once
MAX_HEAD = 128 << 10  # bytes of a request before its body
Streams = Mapping[str, Callable[[], Iterator[bytes]]]
NO_STREAMS: Streams = {}
OPENS = "open"  # the path that takes a file, with its name in the query
LARGEST = 24 << 20  # bytes
BUSY = b"HTTP/1.0 503 Service Unavailable\r\nContent-Length: 0\r\nRetry-After: 1\r\n\r\n"


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


class _Socket(io.RawIOBase):
    """A socket to read until a time, which ends it like its client."""

    def __init__(self, connection: socket.socket, until: float) -> None:
        super().__init__()
        self._connection, self._until = connection, until

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        self._connection.settimeout(max(self._until - time.monotonic(), 1e-3))
        try:
            return self._connection.recv_into(buffer)
        except TimeoutError:
            return 0
        finally:
            self._connection.settimeout(PATIENCE)


class _Request(io.BufferedReader):
    """Reads what a client sends. Its lines, all before the body, have at most MAX_HEAD bytes."""

    left = MAX_HEAD

    def readline(self, size: int | None = -1, /) -> bytes:
        line = super().readline(-1 if size is None else size)
        self.left -= len(line)
        if self.left < 0:
            raise HTTPException(f"more than {MAX_HEAD >> 10} kB")
        return line


class _Server(ThreadingHTTPServer):
    """Has a thread for each of MAX_CONNECTIONS; others are told to come later."""

    daemon_threads = True
    request_queue_size = MAX_CONNECTIONS

    def __init__(self, port: int, handler: type[BaseHTTPRequestHandler]) -> None:
        self._free = threading.Semaphore(MAX_CONNECTIONS)
        self._refused = deque[tuple[float, socket.socket]]()  # open until their clients have read the answer
        super().__init__((HOST, port), handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
            return
        with suppress(OSError):
            request.settimeout(0)
            request.sendall(BUSY)
            request.shutdown(socket.SHUT_WR)
        self._refused.append((time.monotonic() + LINGER, request))
        self._close_refused(len(self._refused) - MAX_CONNECTIONS)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def service_actions(self) -> None:
        self._close_refused(sum(until < time.monotonic() for until, _ in self._refused))

    def _close_refused(self, count: int) -> None:
        for _ in range(count):
            self._refused.popleft()[1].close()

    def server_close(self) -> None:
        super().server_close()
        self._close_refused(len(self._refused))

    def handle_error(self, *_: object) -> None:
        pass  # a browser that went away


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
        opening = threading.Semaphore(MAX_OPENING)
        one = threading.Lock()
        self._root = f"/{token}/" if token else "/"
        root = self._root

        class Handler(BaseHTTPRequestHandler):
            timeout = PATIENCE

            def setup(self) -> None:
                super().setup()
                self.rfile.close()
                self.rfile = _Request(_Socket(self.connection, time.monotonic() + PATIENCE))

            def finish(self) -> None:
                """Reads on for a while: a connection closed before would take the answer with it."""
                super().finish()
                with suppress(OSError):
                    self.connection.shutdown(socket.SHUT_WR)
                    rest, end = bytearray(1 << 16), time.monotonic() + LINGER
                    while (left := end - time.monotonic()) > 0:
                        self.connection.settimeout(left)
                        if not self.connection.recv_into(rest):
                            break

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
                size = self._size()
                if isinstance(size, HTTPStatus):
                    self.send_error(size)
                    return
                if not opening.acquire(blocking=False):
                    self.send_error(HTTPStatus.SERVICE_UNAVAILABLE)
                    return
                try:
                    self._open(opens, size)
                finally:
                    opening.release()

            def _size(self) -> int | HTTPStatus:
                """The bytes of the body, or what is wrong with them."""
                sizes = {size.strip() for size in self.headers.get_all("Content-Length", [])}
                if not sizes or "Transfer-Encoding" in self.headers:
                    return HTTPStatus.LENGTH_REQUIRED
                size = sizes.pop()
                if sizes or not size.isdecimal():
                    return HTTPStatus.BAD_REQUEST
                size = size.lstrip("0") or "0"
                large = len(size) > len(str(LARGEST)) or int(size) > LARGEST
                return HTTPStatus.REQUEST_ENTITY_TOO_LARGE if large else int(size)

            def _open(self, opens: Callable[[bytes, str], dict[str, Any]], size: int) -> None:
                data = self.rfile.read(size)
                if len(data) < size:
                    self.send_error(HTTPStatus.BAD_REQUEST, "The body is shorter than its length")
                    return
                name = parse_qs(urlsplit(self.path).query).get("name", ["tablature"])[0]
                status = HTTPStatus.OK
                try:
                    with one:  # at a time: a large file takes memory
                        answer = json.dumps(opens(data, name))
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

        with _opening(port):
            self._server = _Server(port, Handler)
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
