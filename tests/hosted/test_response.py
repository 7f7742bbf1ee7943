"""A cabinet's impulse response in the plugins: as `render` plays it, kept by sessions with all its samples."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from support import lv2 as lv2host
from support import vst3 as vst3host
from support.clap import Plugin
from support.hosts import FORMATS, HOSTS
from support.picture import Host, Picture, library, shelf
from support.plugins import RATE
from support.states import file_of, read, state_of, with_file

from livebass import QUALITIES, load_preset, score_of
from livebass.engine.engine import Engine, single
from livebass.engine.image import seal
from livebass.engine.render import mix_strings
from livebass.plugin import clap, lv2, vst3
from livebass.rows.arrays import Floats

BASS = "jazz-finger"
SCORE = score_of([(0.0, 0.4, 28, 110), (0.15, 0.5, 36, 80)], RATE)
FRAMES = 12000
DAMAGED = 200  # states
RESPONSE = "urn:livebass:bass#response"
UNDO = (754, 59)  # px in a window of the usual size
NAME = 24  # its place in the kept response


@pytest.fixture
def own(own: Path) -> Path:
    (own / "responses").mkdir(parents=True)
    return own


@pytest.fixture
def cabinet(own: Path) -> Path:
    """A file of two channels, of which the left one is silent, at another rate."""
    rng = np.random.default_rng(1)
    sound = np.exp(-np.arange(6000) / 700) * rng.normal(0, 0.2, 6000)
    file = own / "responses" / "Old 15 inch.wav"
    soundfile.write(file, np.stack([0 * sound, np.r_[np.zeros(40), sound[40:]]], 1), 44100, "PCM_24")
    return file


@pytest.fixture(scope="module")
def bundles(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("bundles")
    basses = {BASS: load_preset(BASS)}
    clap.write_bundle(basses, made / "livebass")
    lv2.write_bundle(basses, made / "livebass.lv2")
    vst3.write_bundle(basses, made / "livebass.vst3")
    shelf(made, [BASS])
    return made


@pytest.fixture
def host(bundles: Path, own: Path, lend: Any) -> Host:
    return lend(Host(bundles))  # type: ignore[no-any-return]


def render(file: Path | str) -> Floats:
    """What `render` makes of the score."""
    out = []
    for strings, mix in Engine(load_preset(file), QUALITIES["live"], RATE).play_with_mix(SCORE, 0.1):
        out.append(mix_strings(single(strings)) if mix is None else mix)
    return np.concatenate(out)[:FRAMES]


def save(host: Host, own: Path) -> Path:
    """The file of the host's sound."""
    name = host.save_sound()
    assert name
    return own / f"{name}.toml"


def take(host: Host, path: Path | str) -> str | None:
    """Loads a file by its path in the clipboard; returns the fault."""
    why = library().lb_take_text(host.address, str(path).encode())
    return why and why.decode()


def test_a_saved_sound_plays_its_response_as_render_does(bundles: Path, host: Host, own: Path, cabinet: Path) -> None:
    """Bit for bit; the sound has a copy of the file, which the first one is."""
    assert take(host, cabinet) is None
    file = save(host, own)
    assert 'response = "responses/Old 15 inch.wav"' in file.read_text()
    assert [each.name for each in cabinet.parent.iterdir()] == [cabinet.name]
    wanted, plain = render(file), render(BASS)
    with closing(Plugin(bundles / "livebass", active=False)) as plugin:
        assert plugin.load_sound(file)
        plugin.offline()
        plugin.activate()
        assert np.array_equal(plugin.play(SCORE, FRAMES), wanted)
    assert np.abs(wanted - plain).max() > 0.1 * np.abs(plain).max()


def test_sessions_of_clap_and_vst3_keep_the_samples(bundles: Path, host: Host, own: Path, cabinet: Path) -> None:
    """On a computer without the file, and a session without a response takes it away."""
    plain = host.save()
    assert take(host, cabinet) is None
    state, wanted = host.save(), render(save(host, own))
    for file in cabinet.parent.iterdir():
        file.unlink()
    with closing(Plugin(bundles / "livebass", active=False)) as plugin:
        assert plugin.load(state) and plugin.save() == state
        plugin.offline()
        plugin.activate()
        assert np.array_equal(plugin.play(SCORE, FRAMES), wanted)
        assert plugin.load(plain) and plugin.save() == plain
    other = vst3host.Plugin(bundles / "livebass.vst3")
    assert other.load(state) and other.save() == state
    other.close()


def name_in(plugin: lv2host.Plugin) -> str:
    """The response's name, as a window hears it."""
    reported = dict(plugin.send([("urn:livebass:bass#watch", np.int32(1).tobytes())]))
    return (reported | dict(plugin.send([])))[RESPONSE].partition(b"\0")[0].decode()


def test_a_session_of_lv2_keeps_the_samples(bundles: Path, host: Host, own: Path, cabinet: Path) -> None:
    """The worker reads the file that a window names; the window hears the name. An earlier one needs no file."""
    assert take(host, cabinet) is None
    wanted = render(save(host, own))
    with closing(lv2host.Plugin(bundles / "livebass.lv2")) as plugin:
        plugin.send([(RESPONSE, f"{cabinet}\0".encode())])
        plugin.work()
        assert name_in(plugin) == cabinet.stem
        state = plugin.save()
    cabinet.unlink()
    with closing(lv2host.Plugin(bundles / "livebass.lv2")) as plugin:
        for uri in sorted({RESPONSE, "http://lv2plug.in/ns/ext/atom#Chunk"}):
            plugin.number(uri)
        number = plugin.number(RESPONSE)
        before = plugin.save()
        value, kind = next((v, k) for v, k in state.values() if len(v) > 10000)
        chunk = plugin.number("http://lv2plug.in/ns/ext/atom#Chunk")
        assert kind and plugin.restore({**before, number: (value[:-8] + bytes(8), chunk)}) != 0
        assert plugin.save() == before
        assert plugin.restore({**before, number: (value, chunk)}) == 0
        assert plugin.restore(before) == 0
        cabinet.parent.mkdir(exist_ok=True)
        undo, new = f":{cabinet.stem}", cabinet.with_name("New.wav")
        soundfile.write(new, [0.5, 0.25], 48000)
        for requested, name in ((undo, cabinet.stem), (new, "New"), (":Old", "New"), (undo, cabinet.stem), ("", "")):
            plugin.send([(RESPONSE, f"{requested}\0".encode())])
            plugin.work()
            assert name_in(plugin) == name
        plugin.send([(RESPONSE, f"{undo}\0".encode())])
        plugin.work()
        plugin.controls["freewheeling"].value = 1
        assert np.array_equal(plugin.play(SCORE, FRAMES), wanted)


def test_undo_brings_back_the_response_before(host: Host, own: Path, cabinet: Path) -> None:
    """Of a session, without its file, or none; after a choice, a sound and a pasted text; values alone leave it."""
    before = host.save()
    assert take(host, cabinet) is None
    state, sound = host.save(), save(host, own).read_text()
    library().lb_undo(host.address)
    assert host.save() == before
    assert host.load(state) and host.sounds()
    other = cabinet.with_name("Other.wav")
    soundfile.write(other, [0.5, 0.25], 48000)
    library().lb_keep_values(host.address)
    host.set("gain", -6.0)
    assert take(host, other) is None and take(host, other) is None
    changed, new = host.save(), sound.replace(cabinet.stem, "Other")
    assert library().lb_load_sound(host.address, 0) and library().lb_take_text(host.address, new.encode()) is None
    cabinet.unlink()
    for wanted in (changed, state, state):
        library().lb_undo(host.address)
        library().lb_undo(host.address)
        assert host.save() == wanted


def test_undo_says_that_it_was_the_cabinet(host: Host, cabinet: Path, lend: Any) -> None:
    """In place of the title; not if the last change was another."""
    picture = lend(Picture(host, optional=("undo", "swap", "side", "copy", "paste", "response")))
    titles = []
    for change in (None, "gain", cabinet):
        if change == cabinet:
            assert take(host, cabinet) is None
        elif change:
            library().lb_keep_values(host.address)
            host.set("gain", -6.0)
        picture.draw(10.0)  # the last notice is gone
        picture.press(*UNDO)
        titles.append(picture.pixels[9:37, 156:400].tobytes())
    assert len(set(titles)) == 3


def test_a_damaged_response_changes_nothing(host: Host, cabinet: Path) -> None:
    assert take(host, cabinet) is None
    before, rng = host.save(), np.random.default_rng(2)
    good = file_of(before, "response")
    for k in range(DAMAGED):
        damaged = bytearray(good)
        if k % 4 == 0:
            damaged = damaged[: int(rng.integers(len(good)))]
        else:
            damaged[int(rng.integers(len(good)))] ^= 1 << int(rng.integers(8))
        assert not host.load(with_file(before, "response", bytes(damaged))) and host.save() == before, k
    assert not host.load(with_file(before, "response", good + bytes(8))) and host.load(before)


def damaged_bytes(whole: bytes, rng: np.random.Generator, way: int) -> bytes:
    """A state of CLAP or VST3 with a bit turned, cut, or longer; or, `way` 3, with other words and a valid sum."""
    if way == 0:
        return whole[: int(rng.integers(len(whole)))]
    made = np.frombuffer(whole, np.uint8).copy()
    made[int(rng.integers(len(made)))] ^= 1 << int(rng.integers(8))
    if way < 3:
        return made.tobytes() + bytes(8 * (way - 1))
    words = read(whole)
    section = words[str(rng.choice([name for name, rows in words.items() if rows]))]
    name = str(rng.choice(list(section)))
    wild = ("nan", "-1e300", "1e9", "0", "", '"', "]", "=", '"' + 5000 * "A" + '"', "9" * 400, section[name][:-3])
    section[name if rng.random() < 0.8 else "what_is_this"] = str(rng.choice(wild))
    return state_of(words)


def damaged_values(whole: dict[int, tuple[bytes, int]], rng: np.random.Generator, way: int) -> Any:
    """A state of LV2 with one value cut, changed in one bit, of another type, or made up."""
    key = int(rng.choice(list(whole)))
    value, kind = whole[key]
    flipped = bytearray(value)
    flipped[int(rng.integers(len(value)))] ^= 1 << int(rng.integers(8))
    values = (value[: int(rng.integers(len(value)))], bytes(flipped), value, rng.bytes(len(value)))
    return {**whole, key: (values[way], kind + (way == 2))}


@pytest.mark.parametrize("cases", [40, pytest.param(2000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", FORMATS)
def test_damaged_states_are_refused_or_play(bundles: Path, host: Host, cabinet: Path, kind: str, cases: int) -> None:
    """A refused state changes nothing; a state with valid sums (LV2 has none) plays finite numbers."""
    rng = np.random.default_rng(cases)
    assert take(host, cabinet) is None
    with closing(HOSTS[kind](bundles / HOSTS[kind].folder)) as plugin:
        if kind == "lv2":
            plugin.plugin.send([(RESPONSE, f"{cabinet}\0".encode())])
            plugin.work()
        else:
            assert plugin.load(host.save())
        before, damage, refused = plugin.save(), damaged_values if kind == "lv2" else damaged_bytes, 0
        for k in range(cases):
            taken = plugin.load(damage(before, rng, k % 4))
            refused += not taken
            assert taken or plugin.save() == before, k
            if k % 20 == 19:
                plugin.renew()
                assert np.isfinite(plugin.play([(0, bytes([0x90, 28 + k % 20, 100]))], 512)).all()
            if taken:
                assert (kind == "lv2" or k % 4 == 3) and plugin.load(before), k
        assert plugin.load(before) and plugin.save() == before and refused > cases / 8


@pytest.mark.parametrize(
    "name, good", [("New", True), ("../New", False), ("a\\b", False), ('a"b', False), ("a\nb", False)]
)
def test_a_session_cannot_name_a_file_elsewhere(host: Host, cabinet: Path, name: str, good: bool) -> None:
    """A saved sound writes the response under its name."""
    assert take(host, cabinet) is None
    state = host.save()
    response = bytearray(file_of(state, "response")[:-8])
    response[NAME : NAME + 64] = name.encode().ljust(64, b"\0")
    assert bool(host.load(with_file(state, "response", seal(bytes(response))))) == good


FAULTS = {
    "silent": lambda file: soundfile.write(file, np.zeros(100), 48000),
    "lasts longer": lambda file: soundfile.write(file, np.ones(100_000) / 2, 48000),
    "not a WAV file": lambda file: file.write_bytes(b"RIFF" + bytes(40)),
    "rate": lambda file: soundfile.write(file, np.ones(100) / 2, 4000),
    "cannot be read": lambda file: None,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_no_response_is_said_and_the_last_one_stays(host: Host, cabinet: Path, fault: str) -> None:
    assert take(host, cabinet) is None
    before, file = host.save(), cabinet.with_name("other.wav")
    FAULTS[fault](file)
    assert fault in (take(host, file) or "") and host.save() == before


@pytest.mark.parametrize("kind", ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE"])
def test_kinds_of_files_are_read_as_livebass_reads_them(host: Host, own: Path, tmp_path: Path, kind: str) -> None:
    """Their samples, as the sound's copy has them; 32 bits are kept."""
    file, sound = own / "responses" / "a+b c.wav", np.exp(-np.arange(900) / 90) * np.cos(np.arange(900))
    soundfile.write(file, sound, 48000, kind, format="WAVEX" if kind == "PCM_24" else "WAV")
    assert take(host, f"file://{str(file).replace(' ', '%20')}\r\n") is None
    read, _ = soundfile.read(file)
    file.unlink()
    save(host, own)
    copy, rate = soundfile.read(file)
    end = len(copy)
    assert rate == 48000 and np.array_equal(copy, read[:end].astype(np.float32)) and np.abs(read[end:]).sum() < 1e-5


def test_a_sound_without_its_file_is_refused(host: Host, own: Path, cabinet: Path) -> None:
    assert take(host, cabinet) is None
    file = save(host, own)
    cabinet.unlink()
    before = host.save()
    assert host.sounds() and not library().lb_load_sound(host.address, 0) and host.save() == before
    text = file.read_text()
    assert "Old 15 inch.wav" in (library().lb_take_text(host.address, text.encode()) or b"").decode()
