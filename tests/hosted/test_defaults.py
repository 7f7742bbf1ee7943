"""Hosts may write every parameter's default back: nothing may change.

Ardour sent the defaults of all controllers at the start (github.com/sfztools/sfizz, issue 871; sfizz-ui, issue 52).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from support import clap as of_clap
from support import lv2 as of_lv2
from support import vst3 as of_vst3
from support.plugins import write_bundle
from support.states import with_learned

from livebass.live.parameters import PARAMETERS
from livebass.plugin import clap, lv2, vst3
from livebass.plugin.lv2 import TURTLE, URI
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats

pytestmark = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="hosts by ctypes")
FRAMES = 6000
NOTES = [bytes([0x90, 33, 90]), bytes([0xE0, 0, 100]), bytes([0x90, 43, 70]), bytes([0x91, 50, 100])]
NUMBERS = {p.symbol: p.number for p in PARAMETERS}
CONTROLLERS, BEND = 1000, 129  # ids of hidden parameters: the first channel's


@pytest.fixture(scope="module")
def bundle(thread_checks: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bundle(vst3, tmp_path_factory.mktemp("vst3") / "livebass.vst3")


def test_clap_parameters_at_their_defaults_are_as_new(thread_checks: None, tmp_path: Path) -> None:
    folder = write_bundle(clap, tmp_path / "livebass")

    def played(write: bool) -> Floats:
        with closing(of_clap.Plugin(folder)) as plugin:
            plugin.offline()
            params = [p for p in plugin.params() if not p.flags & 1 << 3]  # 3: read only
            plugin.block(64, [of_clap.value(p.id, p.default) for p in params] if write else ())
            return plugin.block(FRAMES, [of_clap.midi(message) for message in NOTES])

    with closing(of_clap.Plugin(folder, active=False)) as plugin:
        plugin.set(of_clap.RELIEF, 1.0)  # our host has moved it
        assert {p.name: p.default for p in plugin.params()} == {p.name: plugin.value(p.id) for p in plugin.params()}
    assert np.array_equal(played(True), played(False))


def test_lv2_ports_at_their_defaults_are_as_new(thread_checks: None, tmp_path: Path) -> None:
    """As an instance whose ports the host has not connected yet."""
    bundle = write_bundle(lv2, tmp_path / "livebass.lv2")
    described = (bundle / TURTLE).read_text().split(f"<{URI}> a lv2:Plugin")[1]
    found = re.findall(r'lv2:symbol "(\w+)" ; lv2:name "[^"]*" ; lv2:default (\S+)', described)
    default = {symbol: float(x) for symbol, x in found}
    assert default.keys() >= set(NUMBERS)

    def played(write: bool) -> Floats:
        with closing(of_lv2.Plugin(bundle)) as plugin:
            for k, symbol in enumerate(plugin.controls):
                plugin.controls[symbol].value = 1.0 if symbol == "freewheeling" else default[symbol]
                if not write and symbol in NUMBERS:
                    plugin.plugin.connect(plugin.handle, 2 + k, None)
            plugin.block(64)
            return plugin.block(FRAMES, [(0, message) for message in NOTES])

    assert np.array_equal(played(True), played(False))


def vst3_sound(
    bundle: Path, points: Sequence[tuple[int, int, float]], state: bytes = b"", before: Sequence[tuple[int, float]] = ()
) -> Floats:
    """The sound of notes and a wheel after `points`, in a plugin with a state whose controllers were moved `before`."""
    with closing(of_vst3.Plugin(bundle, mode=of_vst3.OFFLINE)) as plugin:
        assert not state or plugin.load(state)
        plugin.block(64, points=[(number, 0, x) for number, x in before])
        plugin.block(64, points=points)
        notes = [
            of_vst3.note_on(key, 0.6, k, 0, channel) for k, (key, channel) in enumerate([(33, 0), (43, 0), (50, 1)])
        ]
        return plugin.block(FRAMES, notes, [(plugin.mapped(0, BEND), 2000, 0.9)])[0, 0]


def defaults(bundle: Path, hidden_only: bool = False) -> list[tuple[int, int, float]]:
    """(id, 0, default) of the parameters that hosts may set."""
    with closing(of_vst3.Plugin(bundle)) as plugin:
        found = plugin.parameters()
        return [
            (number, 0, p.default) for number, p in found.items()
            if not p.flags & of_vst3.IS_READ_ONLY and (p.flags & of_vst3.IS_HIDDEN or not hidden_only)
        ]  # fmt: skip


def test_vst3_parameters_at_their_defaults_are_as_new(bundle: Path) -> None:
    """All of them, in the host's order and backwards, and each controller alone."""
    plain, all_points = vst3_sound(bundle, []), defaults(bundle)
    assert np.array_equal(vst3_sound(bundle, all_points), plain)
    assert np.array_equal(vst3_sound(bundle, all_points[::-1]), plain)
    for number, _, x in all_points:
        if number in (*range(CONTROLLERS, CONTROLLERS + BEND + 1), 2000, 2001, 2002):
            assert np.array_equal(vst3_sound(bundle, [(number, 0, x)]), plain), number
            float32 = float(np.float32(x))  # as some hosts keep values
            assert x in (0.0, 0.5, 1.0) or np.array_equal(vst3_sound(bundle, [(number, 0, float32)]), plain), number


def test_vst3_controllers_at_their_defaults_leave_a_project_as_it_is(bundle: Path) -> None:
    """Controllers that do what a parameter does, too, and one that has learned a parameter."""
    with closing(of_vst3.Plugin(bundle)) as plugin:
        for symbol, x in (("palm_mute", 0.4), ("vibrato", 0.5), ("blend", 0.9), ("tone", 0.2), ("pluck_position", 0.7)):
            plugin.block(64, points=[(NUMBERS[symbol], 0, x)])
        kept = with_learned(plugin.save(), {7: NUMBERS["tone"], 11: NUMBERS["gain"]})
    plain = vst3_sound(bundle, [], kept)
    assert np.array_equal(vst3_sound(bundle, defaults(bundle, hidden_only=True), kept), plain)
    assert not np.array_equal(vst3_sound(bundle, [(CONTROLLERS + 7, 0, 0.5)], kept), plain), "it has learned it"


@pytest.mark.parametrize("number", [3, 16])
def test_the_default_of_the_plucking_place_is_the_basss_own(bundle: Path, number: int) -> None:
    """Also after the controller has moved it; 0 is the neck, as in MIDI."""
    plain, moved = vst3_sound(bundle, []), [(CONTROLLERS + number, 0.9)]
    at_default = next(point for point in defaults(bundle) if point[0] == CONTROLLERS + number)
    assert np.array_equal(vst3_sound(bundle, [at_default], before=moved), plain)
    for x in (0.0, 1 / 127, 1.0):
        assert not np.array_equal(vst3_sound(bundle, [(CONTROLLERS + number, 0, x)]), plain), x


def test_vst3_controllers_that_end_notes_still_do(bundle: Path) -> None:
    """All notes off, with the value 0 or 127; its default is neither."""
    with closing(of_vst3.Plugin(bundle, mode=of_vst3.OFFLINE)) as plugin:
        for number, x, ends in ((120, 0.0, True), (123, 0.0, True), (123, 1.0, True), (123, None, False)):
            plugin.block(4000, [of_vst3.note_on(33, 0.6, 1)])
            value = plugin.default(CONTROLLERS + number) if x is None else x
            plugin.block(24000, points=[(CONTROLLERS + number, 0, value)])
            assert (np.abs(plugin.block(1000)).max() < 1e-3) == ends, (number, x)
