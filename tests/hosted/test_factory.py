"""The factory sounds in the plugins: presets of the host and of the window, which play what `render` makes of them."""

from __future__ import annotations

import struct
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import vst3 as vst3host
from support.clap import RELIEF, Library, Plugin
from support.needs import package
from support.picture import Host, library
from support.plugins import RATE, hard_score, messages_in_s

from livebass import QUALITIES, load_preset
from livebass.engine.engine import Engine, single
from livebass.engine.render import mix_strings
from livebass.files.whole import OutputError
from livebass.live.parameters import PARAMETERS
from livebass.plugin import clap, lv2, vst3
from livebass.plugin.bundle import SOUNDS, instrument_files
from livebass.plugin.systems import this_system
from livebass.preset.sounds import sound_title, sound_values, sounds_of
from livebass.rows.arrays import Floats
from livebass.rows.techniques import SLIDER_ROWS

BASSES = ("jazz-finger", "slap")
FACTORY = [name for bass in BASSES for name in sounds_of(bass)]


@pytest.fixture
def plugin(folder: Path, lend: Any) -> Plugin:
    return lend(Plugin(folder, active=False))  # type: ignore[no-any-return]


def render(bass_name: str, values: dict[str, float] | None = None) -> tuple[Floats, float]:
    """What `render` makes of a hard score with a bass or sound, and its gain (a factor)."""
    bass, out = load_preset(bass_name), []
    for strings, mix in Engine(bass, QUALITIES["live"], RATE).play_with_mix(hard_score(), 0.1):
        out.append(mix_strings(single(strings)) if mix is None else mix)
    return np.concatenate(out), 10 ** (dict(bass.played).get("gain", 0.0) / 20)


def test_the_bundle_has_the_sounds_of_its_basses_and_may_be_replaced(folder: Path) -> None:
    assert sorted(file.stem for file in (folder / SOUNDS).iterdir()) == sorted(map(sound_title, FACTORY))
    assert clap.is_bundle(sorted(folder.iterdir()))
    found = [title for title, *_ in Library(folder).presets()]
    assert found == [*(load_preset(name).name for name in BASSES), *sorted(map(sound_title, FACTORY))]


@pytest.mark.parametrize("name", FACTORY)
def test_a_sound_plays_what_render_makes_of_it(plugin: Plugin, folder: Path, name: str) -> None:
    assert plugin.load_sound(folder / SOUNDS / f"{sound_title(name)}.toml")
    values = {p.symbol: plugin.value(p.number) for p in PARAMETERS}
    for symbol, value in sound_values(name).items():
        assert values[symbol] == pytest.approx(value)
    wanted, gain = render(name)
    plugin.offline()
    plugin.activate()
    sound = plugin.play(hard_score(), len(wanted))
    n = len(wanted) - RATE // 20  # render fades at its end
    if gain == 1.0:
        assert np.array_equal(sound[:n], wanted[:n])
    else:
        assert np.abs(sound[:n] - gain * wanted[:n]).max() < 1e-6


def test_the_window_lists_them_first_and_deletes_none(folder: Path, lend: Any) -> None:
    host = lend(Host(folder))
    before = host.sounds()
    assert before == sorted(map(sound_title, FACTORY))
    assert host.save_sound() == "Jazz bass, fingers 1" and host.sounds() == [*before, "Jazz bass, fingers 1"]
    library().lb_remove_sound(host.address, 0)
    assert host.sounds() == [*before, "Jazz bass, fingers 1"]
    library().lb_remove_sound(host.address, len(before))
    assert host.sounds() == before


def test_lv2_hosts_get_them_as_presets() -> None:
    basses = {name: load_preset(name) for name in BASSES}
    files = lv2.bundle_files(basses, instrument_files(basses), b"", this_system())
    text, listed = files[lv2.PRESETS].decode(), files[lv2.MANIFEST].decode()
    for name in FACTORY:
        for uri in lv2.PLUGINS:
            assert f"<{uri}#sound-{name}> a pset:Preset" in listed
            said = text.split(f"<{uri}#sound-{name}>")[1].split("state:state")[0]
            assert f'rdfs:label "{sound_title(name)}"' in said
            for p in PARAMETERS:
                wanted = sound_values(name).get(p.symbol, p.default)
                if p.symbol not in ("bass", "quality"):
                    assert f'[ lv2:symbol "{p.symbol}" ; pset:value {wanted:g} ]' in said


def test_a_tuning_on_the_bench_sounds_as_render_makes_it(plugin: Plugin, tmp_path: Path) -> None:
    preset = tmp_path / "tuned.toml"
    preset.write_text('like = "jazz-finger"\n[bench]\nnamed_tuning = 3\nconcert_pitch = -8\n')
    wanted, _ = render(str(preset))
    for symbol, value in (("named_tuning", 3.0), ("concert_pitch", -8.0)):
        plugin.set(SLIDER_ROWS[symbol].parameter.number, value)
    plugin.offline()
    plugin.activate()
    sound = plugin.play(hard_score(), len(wanted))
    assert np.array_equal(sound[: -RATE // 20], wanted[: -RATE // 20])
    assert plugin.text(SLIDER_ROWS["named_tuning"].parameter.number, 3.0) == "drop D"
    assert plugin.text(SLIDER_ROWS["concert_pitch"].parameter.number, -8.0) == "432.0 Hz"


LINUX = pytest.mark.skipif(not this_system().name.startswith("linux"), reason="hosts on Linux")


@LINUX
def test_presets_of_vst3_are_the_states_of_the_sounds(folder: Path, vst3_bundle: Path, tmp_path: Path) -> None:
    """Each is what the plugin saves after it has loaded the sound; a new export replaces them, and nothing else."""
    vst3.write_presets(BASSES, tmp_path)
    vst3.write_presets(BASSES, tmp_path)
    for which, name in ((vst3host.MONO, "livebass"), (vst3host.STRINGS, "livebass strings")):
        files = sorted((tmp_path / name).iterdir())
        assert [file.stem for file in files] == sorted(map(sound_title, FACTORY))
        plugin = vst3host.Plugin(vst3_bundle, which)
        for file in files:
            data = file.read_bytes()
            at, size = struct.unpack("<qq", data[-16:])
            state = data[at : at + size]
            assert data[8:40] == vst3.CLASSES[name].encode() and data[-20:-16] == b"Comp"
            with closing(Plugin(folder, active=False)) as other:
                other.set(RELIEF, PARAMETERS[RELIEF].default)  # the host of tests had set it
                assert other.load_sound(folder / SOUNDS / f"{file.stem}.toml")
                wanted = other.save()
            assert plugin.load(state) and plugin.save() == wanted
        plugin.close()
    (tmp_path / "livebass" / "song.txt").touch()
    with pytest.raises(OutputError):
        vst3.write_presets(BASSES, tmp_path)


@LINUX
def test_pedalboard_plays_a_preset_of_vst3(vst3_bundle: Path, tmp_path: Path) -> None:
    """As `render` plays the sound, but for values that the host rounds to 32 bits: contacts amplify that."""
    vst3.write_presets(BASSES, tmp_path)
    plugin = package("pedalboard", "").load_plugin(str(vst3_bundle), plugin_name="livebass")
    name = next(name for name in FACTORY if dict(load_preset(name).played).get("gain", 0.0) == 0.0)
    plugin.load_preset(str(tmp_path / "livebass" / f"{sound_title(name)}.vstpreset"))
    score = hard_score()
    wanted, _ = render(name)
    n = len(wanted) - RATE // 20
    plugin.relief_under_overload = False
    sound = plugin(messages_in_s(score), (n + 0.25) / RATE, RATE, 1, 512, True)[0]
    assert np.abs(sound[:n] - wanted[:n]).max() < 5e-4 * np.abs(wanted).max()
