"""`livebass page` serves the page to this machine alone, until Ctrl-C."""

from __future__ import annotations

import http.client
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
import webbrowser
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from support.browser import PATIENCE
from support.command import Run, assert_one_clear_line, refusal
from support.jack import wait_for

from livebass import load_preset
from livebass.cli.page import open_address
from livebass.system.interrupts import StopFlag
from livebass.web.bench import Source
from livebass.web.export import page_files
from livebass.web.link import check_link
from livebass.web.serve import HOST, MAX_OPENING, OPENS, PageLost, PageServer

FILES = {"index.html": b"<!doctype html>", "basses/a b.lbass": b"\0\1", "livebass.wasm": b"\0asm", "app.js": b"1"}
PAGE = (sys.executable, "-m", "livebass", "page", "-p", "slap")


@pytest.fixture
def server() -> Iterator[PageServer]:
    with PageServer(FILES) as made:
        yield made


@pytest.mark.parametrize(
    ("path", "file", "kind"),
    [
        ("", "index.html", "text/html; charset=utf-8"),
        ("app.js?v=0123", "app.js", "text/javascript; charset=utf-8"),
        ("basses/a%20b.lbass", "basses/a b.lbass", "application/octet-stream"),
        ("livebass.wasm", "livebass.wasm", "application/wasm"),
    ],
)
def test_it_serves_its_files_by_kind(server: PageServer, path: str, file: str, kind: str) -> None:
    with urllib.request.urlopen(server.address + path, timeout=PATIENCE) as answer:
        assert answer.read() == FILES[file]
        assert answer.headers["Content-Type"] == kind and answer.headers["Cache-Control"] == "no-store"


@pytest.mark.parametrize("path", ["/none", "/../pyproject.toml", "/etc/passwd", "/%2e%2e/pyproject.toml"])
def test_it_serves_nothing_else(server: PageServer, path: str) -> None:
    there = http.client.HTTPConnection(urlsplit(server.address).netloc, timeout=PATIENCE)
    for method in ("GET", "HEAD"):
        there.request(method, path)
        answer = there.getresponse()
        body = answer.read()
        assert answer.status == 404 and b"livebass" not in body
    there.request("POST", "/", b"1")
    assert there.getresponse().status == 501
    there.close()


def test_it_is_for_this_machine_alone_and_ends(server: PageServer) -> None:
    assert server._server.server_address[0] == HOST == "127.0.0.1"
    port = server._server.server_port
    with pytest.raises(PageLost, match=f"--port {port}: "):
        PageServer(FILES, port)
    server.close()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(server.address, timeout=PATIENCE)


def test_the_command_prints_its_address_and_ends_by_ctrl_c() -> None:
    link = ("--link", "http://there/#like=slap&action=-0.5", "--no-browser")
    process = subprocess.Popen([*PAGE, *link], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        address = process.stdout.readline().strip()  # once all is ready
        assert address.startswith(f"http://{HOST}:") and address.endswith("/#like=slap&action=-0.5")
        wanted = page_files({"slap": load_preset("slap")}, "live", more={"opens": OPENS})
        with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
            assert answer.read() == wanted["index.html"]
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0 and not out and err.splitlines()[-1] == "Ctrl-C ends it", err
    finally:
        process.kill()
        process.wait()


def test_on_a_fresh_machine_the_page_opens_at_once_and_says_what_it_waits_for(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    addresses: list[str] = []
    seen: list[str] = []

    def read() -> str:
        with urllib.request.urlopen(addresses[0], timeout=PATIENCE) as answer:
            return str(answer.read().decode())

    def compile_slowly(reported: Callable[[float], None]) -> None:
        seen.append(read())
        reported(0.37)
        seen.append(read())

    def ready(stop: StopFlag, _: object) -> None:
        seen.append(read())
        stop.set()

    monkeypatch.setattr("livebass.web.build.is_cached", lambda: False)
    monkeypatch.setattr("livebass.cli.page.page_ready", compile_slowly)
    monkeypatch.setattr("livebass.cli.page.open_address", addresses.append)
    monkeypatch.setattr("livebass.cli.page.stop_instead", ready)
    status, out, _ = run("page", "-p", "slap")
    assert status == 0 and out.strip() == addresses[0]
    first, later, page = seen
    for text, part in ((first, "0 %"), (later, "37 %")):
        assert part in text and "Compiling the strings, once" in text and 'http-equiv="refresh" content="1"' in text
    assert 'id="page">' in page and "refresh" not in page


@pytest.mark.parametrize("there", ["no browser", "a text browser", "--no-browser"])
def test_without_a_browser_the_address_answers_while_the_kernels_compile(tmp_path: Path, there: str) -> None:
    """A text browser cannot show the page, and Python's webbrowser waits until it is closed: compiling never began."""
    if sys.platform != "linux" and there != "--no-browser":
        pytest.skip("the system opens its browser here, whatever is on the path")
    started, programs = tmp_path / "started", tmp_path / "programs"
    programs.mkdir()
    if there == "a text browser":
        (programs / "w3m").write_text(f"#!/bin/sh\n: >'{started}'\nexec sleep 5\n")
        (programs / "w3m").chmod(0o755)
    line = [*PAGE, *(["--no-browser"] * (there == "--no-browser"))]
    absent = {"DISPLAY", "WAYLAND_DISPLAY", "BROWSER"}
    env = {name: value for name, value in os.environ.items() if name not in absent}
    env |= {"PATH": f"{programs}{os.pathsep}/bin", "NUMBA_CACHE_DIR": str(tmp_path / "cold")}
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env)
    try:
        assert process.stdout is not None and process.stderr is not None
        with urllib.request.urlopen(process.stdout.readline().strip(), timeout=PATIENCE) as answer:
            assert b"Compiling the strings, once" in answer.read()
        reported = process.stderr.readline()
        if there != "--no-browser":
            assert reported == "no browser could be opened: open the address yourself\n"
            reported = process.stderr.readline()
        assert reported.startswith("compiling the kernels, once") and not started.exists()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, out, err) == (130, "", "livebass: error: interrupted\n")
    finally:
        process.kill()
        process.communicate()


def test_a_browser_that_returns_when_it_is_closed_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    closed = threading.Event()
    monkeypatch.setattr("livebass.cli.page.STARTS", 0.05)
    monkeypatch.setattr(webbrowser, "get", lambda: webbrowser.GenericBrowser("firefox"))
    monkeypatch.setattr(webbrowser, "open", lambda _: closed.wait(PATIENCE))
    assert open_address("http://there/")
    closed.set()
    monkeypatch.setattr("livebass.cli.page.STARTS", PATIENCE)
    for answer in (True, False):
        monkeypatch.setattr(webbrowser, "open", lambda _, answer=answer: answer)
        assert open_address("http://there/") is answer


@pytest.mark.parametrize(
    ("link", "says"),
    [
        ("", "--link : a link must be case=b"), ("http://there/#", "a link must be case=b"),
        ("hello", "the link names no bass of this page that can be changed: hello="),
        ("http://there/", "the link names no bass"), ("case=d", "the link names no case of this page: case=d"),
        ("case=b", "none of its basses has cases, as paper-g does"),
        ("#like=slap&action=0x2", "action = 0x2: it must be from -2 to 3 mm"),
        ("story=buzz&step=7", "no step of a story: buzz, 7; stories: buzz, paper"),
        ("story=buzz", "lacks a bass of the story buzz: jazz-finger"),
        ("like=slap&action=1_5", "action = 1_5: it must"),
    ],
)  # fmt: skip
def test_what_is_no_link_gets_one_line_before_any_work(
    run: Run, monkeypatch: pytest.MonkeyPatch, link: str, says: str
) -> None:
    monkeypatch.setattr("livebass.cli.page.page_ready", lambda: pytest.fail("it works"))
    assert says in refusal(run, "page", "-p", "slap", "--no-browser", "--link", link, status=2)


def test_links_that_pages_copy_and_the_cases_are_taken() -> None:
    basses = {name: load_preset(name) for name in ("slap", "paper-g", "jazz-finger")}
    sources = {name: Source(name) for name in basses}
    sliders = "#like=slap&fret=7&fret_height=0.12&pickup_2_place=-6&gauge=%2B5"
    for link in (sliders, "http://x/#case=b", "case=b&more", "#story=buzz&step=6", "story=buzz"):
        check_link(link, basses, sources)


def test_a_port_that_is_taken_and_other_mistakes_get_one_line(run: Run) -> None:
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("livebass.cli.page.page_ready", lambda: pytest.fail("it works"))
            status, out, err = run("page", "-p", "slap", "--no-browser", "--port", str(port))
        assert_one_clear_line(status, err)
        assert f"--port {port}" in err and not out
    for bad in (["--port", "70000"], ["-p", "none"], ["-q", "reference"], ["slap"]):
        refusal(run, "page", "--no-browser", *bad)


def answer_to(server: PageServer, *pieces: bytes) -> bytes:
    """The status line of the answer to what is sent, "" without one."""
    with socket.create_connection((HOST, server._server.server_port), timeout=PATIENCE) as client:
        for piece in pieces:
            client.sendall(piece)
        return client.recv(1 << 16).split(b"\r\n")[0]


def head_of(server: PageServer, *lines: str) -> bytes:
    """The head of a request that opens a file."""
    host = f"{HOST}:{server._server.server_port}"
    head = (f"POST /{OPENS}?name=a.gp5 HTTP/1.1", f"Host: {host}", f"Origin: http://{host}", *lines, "", "")
    return "\r\n".join(head).encode()


@pytest.fixture
def opener(monkeypatch: pytest.MonkeyPatch) -> Iterator[PageServer]:
    """A server that opens files, and waits shortly."""
    monkeypatch.setattr("livebass.web.serve.PATIENCE", 4.0)
    with PageServer(FILES, opens=lambda data, name: {"size": len(data)}) as made:
        yield made


@pytest.mark.parametrize(
    ("lines", "body", "status"),
    [
        (("Content-Length: 3",), b"abc", 200),
        (("Content-Length: 003",), b"abc", 200),
        ((), b"", 411),
        (("Transfer-Encoding: chunked",), b"ffffff\r\n" + b"a" * 0xFFFFFF + b"\r\n", 411),
        (("Content-Length: 3", "Transfer-Encoding: chunked"), b"abc", 411),
        (("Content-Length: -3",), b"abc", 400),
        (("Content-Length: many",), b"abc", 400),
        (("Content-Length: 3", "Content-Length: 4"), b"abcd", 400),
        (("Content-Length: 30",), b"abc", 400),
        (("Content-Length: 99999999",), b"a" * 0xFFFFFF, 413),
        (("Content-Length: " + "9" * 5000,), b"abc", 413),
        (("Content-Length: 3", *("X: " + "a" * 60_000,) * 3), b"abc", 431),
        (("Content-Length: 3", "X: " + "a" * 70_000), b"abc", 431),
        (("Content-Length: 3", *("X: a",) * 200), b"abc", 431),
    ],
)
def test_bodies_and_heads_of_any_length_get_an_answer(
    opener: PageServer, lines: tuple[str, ...], body: bytes, status: int
) -> None:
    assert answer_to(opener, head_of(opener, *lines), body).split()[1] == str(status).encode()


def test_many_slow_clients_end_and_others_get_the_page(opener: PageServer) -> None:
    def drip() -> None:
        with socket.create_connection((HOST, opener._server.server_port), timeout=PATIENCE) as client:
            try:
                for byte in head_of(opener, "Content-Length: 9", "X: " + "a" * 1000):
                    client.sendall(bytes([byte]))
                    time.sleep(0.02)
            except OSError:
                ended.append(time.monotonic() - began)

    ended, began = list[float](), time.monotonic()
    slow = [threading.Thread(target=drip) for _ in range(40)]
    for thread in slow:
        thread.start()
    with urllib.request.urlopen(opener.address, timeout=PATIENCE) as answer:
        assert answer.read() == FILES["index.html"]
    for thread in slow:
        thread.join()
    assert len(ended) == 40, "the server ends them, although each sends on"


def test_too_many_connections_are_told_to_come_later(server: PageServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebass.web.serve.PATIENCE", PATIENCE)  # the three wait as long as the test
    monkeypatch.setattr(server._server, "_free", threading.Semaphore(3))
    there = [socket.create_connection((HOST, server._server.server_port)) for _ in range(3)]  # accepted in this order
    assert answer_to(server, head_of(server)).split()[1] == b"503"
    assert threading.active_count() < 50
    for client in there:
        client.close()

    def is_served() -> bool:
        try:
            with urllib.request.urlopen(server.address, timeout=PATIENCE) as answer:
                return bool(answer.read() == FILES["index.html"])
        except urllib.error.HTTPError:
            return False

    wait_for(is_served)


def test_few_files_are_opened_at_once() -> None:
    released = threading.Event()

    def opens(data: bytes, name: str) -> dict[str, int]:
        released.wait(PATIENCE)
        return {"size": len(data)}

    with PageServer(FILES, opens=opens) as opener, ThreadPoolExecutor(MAX_OPENING + 2) as pool, ExitStack() as ends:
        ends.callback(released.set)
        request = head_of(opener, "Content-Length: 3"), b"abc"
        sent = [pool.submit(answer_to, opener, *request) for _ in range(MAX_OPENING + 2)]
        first = [answer.result().split()[1] for answer in islice(as_completed(sent, PATIENCE), 2)]
        assert first == [b"503"] * 2, "the others are being opened"
        released.set()
        assert sorted(answer.result().split()[1] for answer in sent) == [b"200"] * MAX_OPENING + [b"503"] * 2
