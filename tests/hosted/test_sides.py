"""The window's A and B in hosts' saved states: both, and the playing one."""

from __future__ import annotations

import struct
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import lv2, vst3
from support.clap import Plugin
from support.picture import Host, library, number
from support.plugins import write_bundle
from support.states import read, with_fewer, with_sides
from support.states import state_of as state_written

from livebass.live.parameters import PARAMETERS
from livebass.plugin import clap
from livebass.plugin import lv2 as lv2_plugin
from livebass.plugin import vst3 as vst3_plugin
from livebass.plugin.lv2 import URI
from livebass.plugin.systems import this_system

pytestmark = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="hosts by ctypes")
BASSES = ("slap",)
TONE, GAIN, QUALITY = number("tone"), number("gain"), number("quality")


def test_a_state_has_both_sides_and_which_one_plays(host: Host, instruments: Path, lend: Any) -> None:
    host.set("tone", -0.5)
    plain = host.save()
    library().lb_swap_sides(host.address)
    assert host.value("tone") == 0
    host.set("gain", -6.0)
    host.set("quality", 1.0)
    state = host.save()
    other = lend(Host(instruments))
    assert other.load(state) and other.save() == state
    assert (library().lb_side(other.address), other.value("tone"), other.value("gain")) == (1, 0, -6)
    library().lb_swap_sides(other.address)
    assert (library().lb_side(other.address), other.value("tone"), other.value("gain")) == (0, -0.5, 0)
    assert other.value("quality") == 1, "what the processor does is of neither"
    assert other.load(plain) and other.save() == plain
    library().lb_swap_sides(other.address)
    assert other.value("gain") == 0, "a state without B has one that was not moved"


def test_undo_goes_back_over_a_change_of_side(host: Host) -> None:
    """Without a loss on either side; a hand that moved nothing takes no step."""

    def by_hand(symbol: str, value: float) -> None:
        library().lb_keep_values(host.address)
        host.set(symbol, value)

    by_hand("gain", -6.0)
    library().lb_swap_sides(host.address)
    by_hand("tone", 0.5)
    library().lb_keep_values(host.address)
    steps = []
    for _ in range(4):
        library().lb_undo(host.address)
        steps.append((library().lb_side(host.address), host.value("gain"), host.value("tone")))
    assert steps == [(1, 0, 0), (0, -6, 0), (0, 0, 0), (0, 0, 0)]


def test_a_damaged_side_is_refused_and_leaves_all_as_it_was(host: Host, capfd: pytest.CaptureFixture[str]) -> None:
    host.set("tone", -0.5)
    good = with_sides(host.save(), 1, {GAIN: -6.0})
    library().lb_swap_sides(host.address)
    host.set("gain", 3.0)
    before = host.save()
    words = read(good)
    del words[""]["bass"]
    nameless = state_written(words)
    damaged = [nameless, good[:-8], good[:-1] + b"?", good[:-9] + b"?" + good[-8:], good[:900] + b"?" + good[901:]]
    for state in damaged:
        assert not host.load(state) and host.save() == before
    assert capfd.readouterr().err.splitlines() == ["the session's state is damaged"] * len(damaged)
    assert host.load(good) and host.save() == good


def test_an_older_plugin_with_fewer_parameters_may_have_had_sides(host: Host) -> None:
    """Missing values are at their defaults on either side."""
    older = with_fewer(with_sides(host.save(), 1, {GAIN: -6.0, TONE: 0.5}), TONE + 1)
    host.set("palm_mute", 1.0)
    assert host.load(older) and host.value("palm_mute") == 0
    library().lb_swap_sides(host.address)
    assert (host.value("gain"), host.value("tone"), host.value("palm_mute")) == (-6, 0.5, 0)


def test_values_of_a_side_are_held_within_their_limits(host: Host) -> None:
    assert host.load(with_sides(host.save(), 0, {GAIN: 1e9, QUALITY: 1.0}))
    library().lb_swap_sides(host.address)
    assert host.value("gain") == PARAMETERS[GAIN].maximum and host.value("quality") == 0


# --- in hosts ---


@pytest.mark.parametrize(
    ("module", "name", "host"),
    [(clap, "livebass", Plugin), (vst3_plugin, "livebass.vst3", vst3.Plugin)],
    ids=["clap", "vst3"],
)
def test_clap_and_vst3_keep_them(tmp_path: Path, module: Any, name: str, host: Any) -> None:
    with closing(host(write_bundle(module, tmp_path / name))) as plugin:
        plain = plugin.save()
        state = with_sides(plain, 1, {GAIN: -6.0})
        assert plugin.load(state) and plugin.save() == state
        assert not plugin.load(state[:-8]) and plugin.save() == state
        assert plugin.load(plain) and plugin.save() == plain


def test_lv2_keeps_what_its_window_says_of_them(tmp_path: Path) -> None:
    """By name, and only values off their defaults; a window that asks gets them."""
    bundle = write_bundle(lv2_plugin, tmp_path / "livebass.lv2")
    with closing(lv2.Plugin(bundle)) as plugin, closing(lv2.Plugin(bundle)) as other:
        other.uris = plugin.uris
        plain = plugin.save()
        aside = [p.default for p in PARAMETERS]
        aside[TONE], aside[number("action")] = -0.5, 0.25
        sides = struct.pack(f"<q{len(aside)}d", 1, *aside)
        plugin.send([("urn:livebass:bass#sides", sides)])
        state = plugin.save()
        kept = {plugin.uris[key - 1]: value for key, value in state.items() if key not in plain}
        floats = {name: np.frombuffer(value, "f4")[0] for name, (value, _) in kept.items() if "aside" in name}
        assert floats == {f"{URI}#aside-tone": -0.5, f"{URI}#aside-action": 0.25}
        assert kept[f"{URI}#side"][0] == struct.pack("<q", 1) and len(kept) == 3
        assert other.restore(state) == 0 and other.save() == state
        for _ in "once", "a window that is opened again":
            shown = other.send([("urn:livebass:bass#watch", struct.pack("<i", 1))])
            assert shown == [("urn:livebass:bass#sides", sides)]
        for wanted in (
            [["urn:livebass:bass#response"]],
            [["urn:livebass:bass#update"]],
            [["urn:livebass:bass#song"]],
            ([], ["urn:livebass:bass#look"]),
        ):
            shown = other.send([("urn:livebass:bass#watch", struct.pack("<i", 0))])
            assert [uri for uri, _ in shown] in wanted
        damaged = state | {plugin.number(f"{URI}#aside-tone"): (b"??", state[plugin.number(f"{URI}#aside-tone")][1])}
        assert other.restore(damaged) == 0 and plugin.number(f"{URI}#aside-tone") not in other.save()
        assert other.restore(plain) == 0 and other.save() == plain
