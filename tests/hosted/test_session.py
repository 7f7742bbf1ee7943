"""What a session saved plays as it did: in every format, after the bass has changed, and in other versions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import another_version
from support.another_version import MORE
from support.hosts import FORMATS, HOSTS, Host
from support.kept_files import FRAMES, NOTES, settle
from support.picture import Host as Inner
from support.picture import library, shelf
from support.states import bass_of, file_of, read, state_of, with_file, without_instrument

from livebass import __version__, load_preset
from livebass.live.parameters import PARAMETERS
from livebass.model.instrument import Instrument
from livebass.plugin.instrument import instrument_file
from livebass.rows.arrays import Floats
from livebass.rows.techniques import PICKED

LOWERED = 1.4 + 1e3 * load_preset("slap").necks[0].fret_heights[11]  # mm: the action becomes 1.4 mm
MOVED = {"technique": float(PICKED), "action": LOWERED, "named_tuning": 3.0, "tone": -0.25}
every_format = pytest.mark.parametrize("kind", FORMATS)


def change(bass: Instrument) -> Instrument:
    """A preset whose neck, string and player have been worked on since."""
    necks = tuple(replace(neck, friction=0.5 * neck.friction) for neck in bass.necks)
    strings = tuple(replace(string, thermoelastic=2 * string.thermoelastic) for string in bass.strings)
    return replace(bass, necks=necks, strings=strings, player=replace(bass.player, thumb_mass=5e-3))


def bundle(kind: str, folder: Path, basses: dict[str, Instrument]) -> Path:
    made = folder / HOSTS[kind].folder
    HOSTS[kind].module.write_bundle(basses, made)
    return made


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], Path]:
    """Bundles by format and by what has happened to slap: "as it was", "changed" or "gone"."""
    jazz, slap = load_preset("jazz-finger"), load_preset("slap")
    shelves = {
        "as it was": {"jazz-finger": jazz, "slap": slap},
        "changed": {"jazz-finger": jazz, "slap": change(slap)},
        "gone": {"jazz-finger": jazz},
    }
    return {
        (kind, what): bundle(kind, tmp_path_factory.mktemp("bundles"), basses)
        for kind in FORMATS
        for what, basses in shelves.items()
    }


@pytest.fixture
def host_of(places: dict[tuple[str, str], Path], lend: Any) -> Callable[[str, str], Host]:
    return lambda kind, what: lend(HOSTS[kind](places[kind, what], offline=True))


def sound(host: Host) -> Floats:
    settle(host)
    out = host.play(NOTES, FRAMES)
    assert np.abs(out).max() > 0.01
    return out


def set_up(host: Host, kind: str, bass: float = 1.0) -> None:
    """Chooses slap, a pick, an action of 1.4 mm, a tuning and a tone; LV2 hosts restore ports themselves."""
    settle(host, [(0, "bass", bass)] if bass else [])
    settle(host, [(0, symbol, value) for symbol, value in MOVED.items()])


def restore(host: Host, kind: str, state: Any) -> Host:
    assert host.load(state)
    if kind == "lv2":
        host.play([], 64, (64,), [(0, symbol, value) for symbol, value in MOVED.items()])
    return host


@every_format
@pytest.mark.parametrize("what", ["changed", "gone"])
def test_it_plays_as_saved_although_the_preset_has_changed(host_of: Any, kind: str, what: str) -> None:
    """Sample for sample, with pick, action and tuning; also where no bass of that name is installed any more."""
    old = host_of(kind, "as it was")
    set_up(old, kind)
    wanted, state = sound(old), old.save()
    new = restore(host_of(kind, what), kind, state)
    assert np.array_equal(sound(new), wanted)
    again = new.save()
    assert np.array_equal(sound(restore(host_of(kind, "as it was"), kind, again)), wanted)
    fresh = host_of(kind, what)
    set_up(fresh, kind, float(what == "changed"))
    assert not np.array_equal(sound(fresh), wanted)


def test_one_click_takes_the_new_bass_in_lv2(host_of: Any) -> None:
    """The window learns that the bass has changed since, and that it is the present one afterwards."""
    old = host_of("lv2", "as it was")
    set_up(old, "lv2")
    state = old.save()
    fresh, new = host_of("lv2", "changed"), restore(host_of("lv2", "changed"), "lv2", state)
    set_up(fresh, "lv2")
    wanted = sound(fresh)
    assert not np.array_equal(sound(new), wanted) and reports_kept(new) == 1
    new.plugin.send([("urn:livebass:bass#update", np.int32(1).tobytes())])
    new.work()
    assert reports_kept(new) == 0 and np.array_equal(sound(new), wanted)


def reports_kept(host: Any) -> int | None:
    """What the plugin tells a window that asks: whether a kept bass plays."""
    found = host.plugin.send([("urn:livebass:bass#watch", np.int32(1).tobytes())])
    for _ in range(4):
        found += host.plugin.send([("urn:livebass:bass#watch", np.int32(0).tobytes())])
    values = [int(np.frombuffer(body, np.int32)[0]) for uri, body in found if uri == "urn:livebass:bass#update"]
    return values[-1] if values else None


@pytest.fixture
def inner(places: dict[tuple[str, str], Path], lend: Any) -> Callable[[str], Inner]:
    """Instances behind a window, with their shelf: CLAP's and VST3's."""
    return lambda what: lend(Inner(places["clap", what]))


def test_one_click_takes_the_new_bass_and_undo_the_saved_one(inner: Any) -> None:
    old, new = inner("as it was"), inner("changed")
    old.set("bass", 1.0)
    state = old.save()
    assert old.title() == "Slap" and not library().host_is_kept(old.address)
    assert new.load(state) and new.save() == state
    assert new.title() == "Slap (as saved)" and library().host_is_kept(new.address)
    library().host_update(new.address)
    assert new.title() == "Slap" and not library().host_is_kept(new.address)
    assert file_of(new.save(), "instrument") == instrument_file(change(load_preset("slap")))
    library().lb_undo(new.address)
    assert new.title() == "Slap (as saved)" and new.save() == state
    new.set("bass", 0.0)
    new.set("bass", 1.0)
    assert new.title() == "Slap (as saved)", "as long as the session lasts"


def test_the_same_bass_needs_no_update(inner: Any) -> None:
    """Whichever version wrote it, and in whatever order."""
    one, other = inner("as it was"), inner("as it was")
    one.set("bass", 1.0)
    state = one.save()
    assert other.load(state) and other.title() == "Slap" and other.save() == state


# --- words ---


@pytest.fixture
def plain(inner: Any) -> Inner:
    host: Inner = inner("as it was")
    host.set("tone", -0.5)
    return host


def test_a_state_is_words_in_the_engines_units(plain: Inner) -> None:
    words = read(plain.save())
    assert words[""] == {
        "format": "1", "made": f'"{__version__}"', "bass": '"jazz-finger"', "seed": "0", "side": '"A"',
    }  # fmt: skip
    assert words["A"]["tone"] == "-0.5" and words["B"]["tone"] == "0" and set(words["A"]) == set(words["B"])
    assert {*words["A"], *words["processor"], "bass"} == {p.symbol for p in PARAMETERS}
    assert file_of(plain.save(), "instrument") == instrument_file(load_preset("jazz-finger"))


def test_unknown_words_are_kept_and_reported(plain: Inner, capfd: pytest.CaptureFixture[str]) -> None:
    """In every section, and in those that are unknown, too; they are there when the project is saved again."""
    words = read(plain.save())
    words[""]["mood"] = '"blue"'
    words["A"]["growl"], words["B"]["growl"] = "0.25", "1"
    words["processor"]["threads"] = "7"
    words["controllers"] = {"21": '"growl"', "22": '"tone"'}
    words["amplifier"] = {"bright": "1", "cabinet": '"8 x 10"'}
    state = state_of(words)
    capfd.readouterr()
    assert plain.load(state)
    said = capfd.readouterr().err.splitlines()
    assert len(said) == 1 and f"unknown to livebass {__version__}: mood, growl, growl, threads, 21, bright" in said[0]
    assert read(plain.save()) == words
    assert plain.load(without_unknown(state)) and "growl" not in read(plain.save())["A"], "a state replaces all"


def without_unknown(state: bytes) -> bytes:
    words = read(state)
    del words["amplifier"], words["controllers"]["21"], words[""]["mood"], words["processor"]["threads"]
    del words["A"]["growl"], words["B"]["growl"]
    return state_of(words)


def test_missing_words_have_their_defaults(plain: Inner) -> None:
    words = read(plain.save())
    del words["A"]["tone"], words["A"]["drive"], words["processor"]["cores"], words[""]["seed"], words["B"]
    for symbol, value in (("tone", 0.75), ("drive", 0.5), ("cores", 3.0)):
        plain.set(symbol, value)
    assert plain.load(state_of(words))
    assert [plain.value(symbol) for symbol in ("tone", "drive", "cores")] == [0, 0, 1]


def test_values_beyond_their_limits_are_held_there_with_a_word(plain: Inner, capfd: pytest.CaptureFixture[str]) -> None:
    words = read(plain.save())
    words["A"] |= {"tone": "1e9", "gain": "-1e300", "action": "0.123456"}
    capfd.readouterr()
    assert plain.load(state_of(words))
    (said,) = capfd.readouterr().err.splitlines()
    assert said.endswith("held within the limits: gain, tone, action")
    assert (plain.value("tone"), plain.value("action")) == (1, 0.12)


@pytest.fixture
def other(tmp_path: Path, lend: Any) -> Inner:
    """A build with one parameter more in the middle, and another name for one: a later version, or an earlier one."""
    host = another_version.Host(shelf(tmp_path, ["jazz-finger"]), build=another_version.library())
    return lend(host)  # type: ignore[no-any-return]


def test_a_later_version_has_inserted_and_renamed_parameters(plain: Inner, other: Inner) -> None:
    """Each value finds its own; the new one has its default."""
    values = {"tone": -0.5, "gauge": 10.0, "wear": 120.0, "foam": 7.0, "cable": 300.0, "cores": 2.0}
    for symbol, value in values.items():
        plain.set(symbol, value)
    other.set(another_version.EXTRA, 0.75)
    assert other.load(plain.save())
    found = {symbol: other.value("string_age" if symbol == "wear" else symbol) for symbol in values}
    assert found == values and other.value(another_version.EXTRA) == MORE.default
    assert set(read(other.save())["A"]) == set(read(plain.save())["A"]) - {"wear"} | {"string_age", "growl"}


def test_a_later_version_has_removed_parameters(plain: Inner, other: Inner, capfd: pytest.CaptureFixture[str]) -> None:
    """As for any unknown word: it is reported, and stays in the project."""
    for symbol, value in (("tone", 0.25), ("growl", 0.5), ("string_age", 120.0), ("foam", 7.0)):
        other.set(symbol, value)
    capfd.readouterr()
    assert plain.load(other.save())
    (said,) = capfd.readouterr().err.splitlines()
    assert f"unknown to livebass {__version__}: growl, string_age" in said
    assert (plain.value("tone"), plain.value("foam"), plain.value("wear")) == (0.25, 7.0, 0.0)
    assert read(plain.save())["A"]["growl"] == "0.5"


@pytest.mark.parametrize("kind", FORMATS)
def test_a_later_format_is_refused_by_the_version_that_made_it(host_of: Any, kind: str, capfd: Any) -> None:
    host = host_of(kind, "as it was")
    set_up(host, kind)
    before = state = host.save()
    if kind == "lv2":
        number, made = (host.plugin.number(f"urn:livebass:bass#{name}") for name in ("format", "made"))
        state = state | {number: ((2).to_bytes(8, "little"), state[number][1]), made: (b"9.1\0", state[made][1])}
    else:
        words = read(state)
        words[""] |= {"format": "2", "made": '"9.1"'}
        state = state_of(words)
    capfd.readouterr()
    assert not host.load(state) and host.save() == before
    (said,) = host.lines(capfd.readouterr().err)[-1:]
    assert f"was made by livebass 9.1; this one, {__version__}, cannot read it" in said


def test_a_damaged_bass_in_a_state_gives_way_to_the_one_of_its_name(
    plain: Inner, capfd: pytest.CaptureFixture[str]
) -> None:
    state = plain.save()
    good = file_of(state, "instrument")
    capfd.readouterr()
    for damaged in (good[:-8], good[:900] + b"?" + good[901:], b"", bytes(1000)):
        assert plain.load(with_file(state, "instrument", damaged))
        (said,) = capfd.readouterr().err.splitlines()
        assert said == "jazz-finger: the bass that the session kept cannot be played"
        assert plain.value("tone") == -0.5 and plain.save() == state


def test_a_state_without_the_bass_plays_the_present_one(inner: Any) -> None:
    """As factory presets, which name theirs."""
    new, state = inner("changed"), without_instrument(inner("as it was").save())
    assert new.load(state) and bass_of(new.save()) == "jazz-finger" and new.title() == load_preset("jazz-finger").name


def test_sizes(host_of: Any) -> None:
    """A state has the bass, 54 kB as text, and a response if there is one: a few 100 kB at most."""
    host = host_of("clap", "as it was")
    set_up(host, "clap")
    assert 50_000 < len(host.save()) < 65_000
