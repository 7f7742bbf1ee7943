"""The live path through a real JACK server with the dummy driver, started and ended by a fixture."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading

import pytest
from support.jack import JACK_PERIOD, JACK_RATE, PATIENCE, livebass
from support.needs import missing, package
from support.places import TESTS

from livebass.live.guards import open_jack_client
from livebass.live.synth import Synth
from livebass.live.thread.ring import unread

RATE, PERIOD = JACK_RATE, JACK_PERIOD
APART = ("unshare", "-rm", "sh", "-c", 'mount -t tmpfs tmpfs /dev/shm && exec "$@"', "sh")  # with its own /dev/shm


def test_without_a_server_it_says_so() -> None:
    package("jack")
    process = livebass("play", "--backend", "jack", env={**os.environ, "JACK_DEFAULT_SERVER": "nobody"})
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1
    lines = err.splitlines()
    assert lines[-1].startswith("livebass: error: JACK") and "server" in lines[-1]
    assert all(line.startswith(("livebass:", "compiling")) for line in lines)


def test_a_registry_full_of_dead_servers_holds_no_server_up() -> None:
    """JACK's registry holds eight servers. Dead servers' places and files are freed, nothing else, and nothing is left.

    Runs in a process with its own shared memory, as other servers may run here.
    """
    if not shutil.which("jackd") or subprocess.run([*APART, "true"], capture_output=True, check=False).returncode:
        missing("jackd, and shared memory of one's own")
    program = """
import subprocess
from support.jack import SHARED, leave_nothing, running_server, servers, wait_for

started = {}
for k in range(8):
    name = f"server-{k}"
    command = ["jackd", "--no-realtime", "-n", name, "-d", "dummy"]
    started[name] = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
wait_for(lambda: all((SHARED / f"jack_sem.0_{name}_system").exists() for name in started))
assert {name: process.pid for name, process in started.items()} == servers()
lives = started.pop("server-3")
for process in started.values():
    process.kill()
    process.wait()
assert len(servers()) == 8 and list(SHARED.glob("jack*server-5*"))
for _ in range(2):
    with running_server() as process:
        assert sorted(servers().values()) == sorted([lives.pid, process.pid])
    assert servers() == {"server-3": lives.pid} and lives.poll() is None
    left = {path.name for path in SHARED.glob("jack*server*")}
    assert left and all("server-3" in name for name in left), left
leave_nothing()
assert servers() == {"server-3": lives.pid}, "it lives"
lives.terminate()
lives.wait()
leave_nothing()
print(sorted(SHARED.iterdir()))
"""
    done = subprocess.run(
        [*APART, sys.executable, "-c", program], capture_output=True, text=True, timeout=2 * PATIENCE, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path])},
    )  # fmt: skip
    assert done.stdout.strip() == "[]", done.stdout + done.stderr[-2000:]


def test_a_client_that_does_not_open_at_once_is_opened_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another server has a client of that name at the moment; without a server there is no second try."""
    jack = package("jack")
    opened: list[str] = []
    for status, failures in ((0x21, 2), (0x11, 0)):
        faults = [jack.JackOpenError("livebass", jack.Status(status))] * 2

        def client(name: str, no_start_server: bool, faults: list[Exception] = faults) -> str:
            assert no_start_server
            if faults:
                raise faults.pop()
            opened.append(name)
            return name

        monkeypatch.setattr(jack, "Client", client)
        if failures:
            assert open_jack_client(jack, "livebass") == "livebass" and opened == ["livebass"] and not faults
        else:
            with pytest.raises(jack.JackOpenError):
                open_jack_client(jack, "livebass")
            assert len(faults) == 1


IMPATIENT = "from livebass.live import guards; guards.PATIENCE = 2.0; from livebass.__main__ import main; main()"


@pytest.mark.parametrize(
    "arguments", [("play", "--backend", "jack"), pytest.param(("devices",), marks=pytest.mark.slow)]
)
def test_a_jack_library_that_hangs_is_an_error(arguments: tuple[str, ...]) -> None:
    """A server that ends while a client opens JACK's database leaves it so; the client waits for ever.

    Only the hang is slow here, so less patience will do.
    """
    if subprocess.run([*APART, "true"], capture_output=True, check=False).returncode:
        missing("shared memory of one's own")
    leave = "d=/dev/shm/jack_db-0; mkdir $d && : >$d/__db.001 && "  # here this user is 0
    apart = [part.replace("exec", f"{leave} exec") for part in APART]
    done = subprocess.run(
        [*apart, sys.executable, "-c", IMPATIENT, *arguments], capture_output=True, text=True, timeout=PATIENCE,
        check=False,
    )  # fmt: skip
    said = done.stderr + done.stdout
    assert done.returncode == (1 if arguments[0] == "play" else 0), said
    assert "Traceback" not in said
    if shutil.which("jackd"):
        assert "delete /dev/shm/jack_db-0" in said


def test_threads_may_send_together() -> None:
    synth = Synth(RATE)
    threads = [threading.Thread(target=lambda: [synth.send(0x90, 40, 1) for _ in range(500)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(unread(synth.rings[0])) == 2000
