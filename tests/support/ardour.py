"""Ardour 7 without its window: its Lua makes sessions, its own tool exports them."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import mido
import numpy as np
import soundfile

from livebass.rows.arrays import Floats
from support.needs import missing

LUA, EXPORT = "ardour7-lua", "ardour7-export"
LIBRARIES = Path("/usr/lib/ardour7")
SCANNER = LIBRARIES / "ardour-vst3-scanner"
PATIENCE = 180.0  # s
RACE = "Port already exists"  # a port it has just made itself: one start in twenty under load; then it aborts
RATE = 48000
MAX_LATE = 32  # frames
TICKS, BEATS_A_SECOND = 1920, 2  # ticks a beat; beats a second in a new session
SUPERCLOCK = 282240000  # ticks a second of its other clock


def needs_ardour() -> None:
    """Skips a test if Ardour is not installed; fails where CI promises it."""
    if not (shutil.which(LUA) and shutil.which(EXPORT) and SCANNER.exists()):
        missing("Ardour 7", "ardour", "ARDOUR")


class Ardour:
    """Ardour for a user whose `home` holds only what the test puts there."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.environment = {key: value for key, value in os.environ.items() if not key.startswith(("XDG_", "LV2_"))}
        self.environment |= {"HOME": str(home), "XDG_RUNTIME_DIR": str(home)}

    def run(self, *command: object, **more: str) -> str:
        """Runs a program to its end; returns its output."""
        done = subprocess.run(
            [str(word) for word in command], env=self.environment | more, stdin=subprocess.DEVNULL, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE, errors="replace",
        )  # fmt: skip
        assert done.returncode == 0, (done.returncode, done.stdout[-2000:])
        return done.stdout

    def scan(self, bundle: Path) -> str:
        """Scans a VST3 bundle with Ardour's scanner, as its dialog does; returns the output."""
        for file in bundle.rglob("*"):  # it would rescan a file as young as its list of results
            os.utime(file, (0, 0))
        return self.run(SCANNER, "-f", bundle, LD_LIBRARY_PATH=str(LIBRARIES))

    def lua(self, script: str, *arguments: object) -> list[list[str]]:
        """Runs a script; returns the fields of the lines it printed after "TOLD|"."""
        file = self.home / "script.lua"
        file.write_text(script)
        lines = [line.split("|") for line in self.run(LUA, file, *arguments).splitlines()]
        return [line[1:] for line in lines if line[0] == "TOLD"]

    def make(self, session: Path, script: str, *arguments: object) -> list[list[str]]:
        """Runs a script that makes a session; tries once more if Ardour's threads collided."""
        for last in (False, False, True):
            try:
                return self.lua(script, session, *arguments)
            except AssertionError as error:
                if last or RACE not in str(error):
                    raise
                shutil.rmtree(session)
        raise AssertionError

    def export(self, session: Path, snapshot: str) -> Floats:
        """The sound of the whole session at its master bus: (2, frames).

        It exports again if a channel is silent. Under load Ardour hands a plugin no notes in one export of thirty,
        only the controllers that come before them, or leaves an empty file.
        """
        made = self.home / f"{snapshot}.wav"
        sound = np.zeros((0, 2), np.float32)
        for _ in range(3):
            self.run(EXPORT, "-b", "float", "-o", made, session, snapshot)
            sound, rate = soundfile.read(made, dtype="float32", always_2d=True)
            assert rate == RATE
            if sound.any(axis=0).all():
                break
        return np.ascontiguousarray(sound.T)


def is_export_of(exported: Floats, wanted: Floats) -> bool:
    """True if every channel (frames,) of an export begins as `wanted`, to the bit.

    Under load Ardour leaves out the first frames, 16 as a rule, of all tracks alike.
    """
    parts = ((exported[:, : len(wanted) - late], wanted[late:]) for late in range(MAX_LATE + 1))
    return any(all(np.array_equal(channel, part) for channel in channels) for channels, part in parts)


def put_notes(session: Path, snapshot: str, notes: list[tuple[float, float, int, int]], seconds: int) -> None:
    """Puts notes, (start s, length s, key, velocity), on every MIDI track of a snapshot `seconds` long.

    Ardour's Lua cannot add MIDI regions, so this edits the snapshot's file. Frames are exact at multiples of 1/1920 s.
    """
    file = session / f"{snapshot}.ardour"
    tree = ElementTree.parse(file)
    root = tree.getroot()
    number = int(root.get("id-counter", "0"))
    folder = session / "interchange" / session.name / "midifiles"
    folder.mkdir(parents=True, exist_ok=True)
    write_midi(folder / "notes.mid", notes)
    sources, locations = root.find("Sources"), root.find("Locations")
    assert sources is not None and locations is not None
    source = {"name": "notes.mid", "type": "midi", "id": str(number), "flags": "", "origin": "", "take-id": ""}
    ElementTree.SubElement(sources, "Source", source)
    whole = f"b{seconds * BEATS_A_SECOND * TICKS}@b0"
    for playlist in root.findall("Playlists/Playlist"):
        number += 1
        region = {
            "name": "notes", "id": str(number), "type": "midi", "start": "b0", "length": whole, "channels": "1",
            "source-0": source["id"], "master-source-0": source["id"], "opaque": "1", "muted": "0", "hidden": "0",
            "whole-file": "0", "first-edit": "nothing", "sync-position": "b0", "ancestral-start": "b0",
            "ancestral-length": whole, "stretch": "1", "shift": "1", "layer": "0", "layering-index": "0",
        }  # fmt: skip
        ElementTree.SubElement(playlist, "Region", region)
    ElementTree.SubElement(
        locations, "Location", {"id": str(number + 1), "name": "session", "start": "a0",
                                "end": f"a{seconds * SUPERCLOCK}", "flags": "IsSessionRange"},
    )  # fmt: skip
    root.set("id-counter", str(number + 2))
    tree.write(file, encoding="UTF-8", xml_declaration=True)


def write_midi(path: Path, notes: list[tuple[float, float, int, int]]) -> None:
    events = [(start, 1, key, velocity) for start, _, key, velocity in notes]
    events += [(start + length, 0, key, 64) for start, length, key, _ in notes]
    track, now = mido.MidiTrack(), 0
    for time, on, key, velocity in sorted(events):
        tick = round(time * BEATS_A_SECOND * TICKS)
        track.append(mido.Message("note_on" if on else "note_off", note=key, velocity=velocity, time=tick - now))
        now = tick
    mido.MidiFile(type=0, ticks_per_beat=TICKS, tracks=[track]).save(path)
