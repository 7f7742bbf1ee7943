"""The files that a version keeps in tests/kept, and what later versions make of them."""

from __future__ import annotations

import base64
import hashlib
import json
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import mido
import numpy as np
import soundfile

from livebass import load_preset
from livebass.cli import play_settings
from livebass.cli.main import run
from livebass.compiling import store
from livebass.plugin.instrument import image_digest, instrument_file
from livebass.preset.keymap import key_map_text, load_key_map
from livebass.preset.load import own_tables
from livebass.preset.revisions import with_revision
from livebass.preset.sounds import sound_text
from livebass.rows.techniques import PICKED
from livebass.score.reading import TAKE
from livebass.score.takes import text_of
from support.hosts import FORMATS, HOSTS, Host
from support.kept import image_made
from support.picture import Host as Inner
from support.picture import library
from support.places import TESTS

DIGESTS = "digests.json"
SOUNDS = "sounds.json"  # in tests/kept: the digest of the pinned sounds, by the number of the sound
NOTES = [(0, bytes([0x90, 28, 110])), (4000, bytes([0x90, 33, 80])), (8000, bytes([0x80, 33, 0]))]
FRAMES = 12000
MOVED = {"technique": float(PICKED), "action": -0.4, "named_tuning": 3.0, "tone": -0.25}
PRESET = """format = 1
name = "Low slap"
like = "slap@1"

[neck]
action = "1.4 mm"

[bench]
gauge = 4.0
"""
SETTINGS = play_settings.PlaySettings(preset="slap", gain=-3.0, controllers={"tone": 20}, tuning="drop-d")
LINK = "like=slap&action=-0.4&tone=-0.25&drive=0.5&format=1&revision=1"


def settle(host: Host, points: Any = ()) -> None:
    """Moves parameters; then the bass that is wanted plays."""
    host.play([], 64, (64,), points)
    for _ in range(4):
        host.play([], 64, (64,))
        host.work()
    host.renew()


def bundle(kind: str, folder: Path) -> Path:
    place = folder / HOSTS[kind].folder
    HOSTS[kind].module.write_bundle({name: load_preset(name) for name in ("jazz-finger", "slap")}, place)
    return place


def state_bytes(host: Host, state: Any) -> bytes:
    """A state as a file: LV2's by the URIs of its keys and types."""
    if isinstance(state, bytes):
        return state
    uris = host.plugin.uris
    rows = {uris[key - 1]: [uris[kind - 1], base64.b64encode(value).decode()] for key, (value, kind) in state.items()}
    return json.dumps(rows, indent=1).encode()


def state_of(host: Host, data: bytes) -> Any:
    """The state in a file."""
    if not data.startswith(b"{"):
        return data
    number = host.plugin.number
    return {number(key): (base64.b64decode(value), number(kind)) for key, (kind, value) in json.loads(data).items()}


def take() -> bytes:
    """A take of `livebass play`: a revision of a bass, with options."""
    track = mido.MidiTrack([mido.MetaMessage("set_tempo", tempo=500_000), mido.MetaMessage("text", text=TAKE)])
    track.append(mido.MetaMessage("text", text=text_of(with_revision("slap"), {"tuning": "drop-d", "capo": "1"})))
    for note, on in ((30, 100), (30, 0), (45, 120), (45, 0)):
        track.append(mido.Message("note_on", note=note, velocity=on, time=6000))
    with tempfile.TemporaryFile() as file:
        mido.MidiFile(type=0, ticks_per_beat=24000, tracks=[track]).save(file=file)
        file.seek(0)
        return file.read()


def make_files() -> dict[str, bytes]:
    """The files of this version, by name."""
    found = {
        "slap.lbass": instrument_file(load_preset("slap")),
        "take.mid": take(),
        "preset.toml": PRESET.encode(),
        "keys.toml": key_map_text(load_key_map("modo")).encode(),
        "sound.toml": sound_text("reggae-dub").encode(),
        "link.txt": LINK.encode(),
        "play.toml": SETTINGS.text().encode(),
    }
    with tempfile.TemporaryDirectory() as folder:
        for kind in FORMATS:
            with closing(HOSTS[kind](bundle(kind, Path(folder)), offline=True)) as host:
                settle(host, [(0, "bass", 1.0)])
                settle(host, [(0, symbol, value) for symbol, value in MOVED.items()])
                found[f"{kind}.state"] = state_bytes(host, host.save())
    return found


class Opened:
    """The files of a folder of tests/kept, opened by this version."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.stack = folder, ExitStack()
        self.place = Path(self.stack.enter_context(tempfile.TemporaryDirectory()))

    def close(self) -> None:
        self.stack.close()

    def digests(self) -> dict[str, Any]:
        """Digests of what all processors compute alike, and of sounds, by the level of the processor."""
        return {"numbers": dict(self.numbers()), "sounds": {store.level(): dict(self.sounds())}}

    def numbers(self) -> Iterator[tuple[str, str]]:
        yield "slap.lbass", digest(image_made((self.folder / "slap.lbass").read_bytes()))
        yield "preset.toml", image_digest(load_preset(self.folder / "preset.toml"))
        yield "keys.toml", digest(repr(load_key_map(str(self.folder / "keys.toml")).keys).encode())
        assert load_preset(self.folder / "sound.toml").name
        yield "sound.toml", digest(repr(sorted(own_tables(self.folder / "sound.toml")[1].items())).encode())
        settings = vars(play_settings.load(self.folder / "play.toml"))
        yield "play.toml", digest(repr([settings[name] for name in tomllib.loads(SETTINGS.text())]).encode())
        yield "link.txt", self.link((self.folder / "link.txt").read_bytes())

    def link(self, text: bytes) -> str:
        """What a window takes from a link: its bass and its values."""
        host = Inner(bundle("clap", self.place))
        why = library().lb_take_text(host.address, text)
        assert not why, why
        values = {symbol: host.value(symbol) for symbol in ("bass", "action", "tone", "drive", "gain")}
        host.close()
        return digest(repr(values).encode())

    def sounds(self) -> Iterator[tuple[str, str]]:
        for kind in FORMATS:
            with closing(HOSTS[kind](bundle(kind, self.place / "states"), offline=True)) as host:
                assert host.load(state_of(host, (self.folder / f"{kind}.state").read_bytes()))
                settle(host, [(0, symbol, value) for symbol, value in MOVED.items()] if kind == "lv2" else ())
                out = host.play(NOTES, FRAMES)
                assert np.abs(out).max() > 0.01
                yield f"{kind}.state", digest(out.tobytes())
        sound = self.place / "take.wav"
        assert run(["render", str(self.folder / "take.mid"), "-q", "live", "-o", str(sound)]) == 0
        yield "take.mid", digest(soundfile.read(sound, dtype="float32")[0].tobytes())


def sounds_digest() -> str:
    """A digest of the engine's pinned sounds."""
    return digest((TESTS / "unit" / "engine" / "pinned.json").read_bytes())


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]
