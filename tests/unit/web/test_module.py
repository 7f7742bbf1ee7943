"""The kernels as WebAssembly: the sound of the native engine, and the same samples on every machine."""

from __future__ import annotations

import json
import platform
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import module_paths, python_output
from support.messages import messages_of
from support.own_basses import load_preset
from support.places import TESTS
from support.plugins import midi_score
from support.wasm import HARD, MESSAGES, PINNED, PINS, QUANTUM, RATE, Module, sound_hash

import livebass
from livebass import QUALITIES, render_to_array, score_of
from livebass.compiling import X86
from livebass.engine.engine import Engine
from livebass.engine.render import mix_strings, single
from livebass.model.instrument import Effects, Instrument, Response
from livebass.plugin.instrument import image_file
from livebass.rows.arrays import Floats
from livebass.rows.parts import Pick
from livebass.rows.techniques import EFFECT, EFFECTS
from livebass.score.score import Score
from livebass.web import build
from livebass.web.layout import ENTRIES, RECORDS, record

MAX_BYTES = 700_000
CLOSE = 1e-6  # of full scale; the largest found, 1.8e-7, is from the single precision of long runs
OTHER_ORDER = 4e-6  # of full scale, from reordering sums of float32 in hard notes: twice the largest found
SOFT = [(0.2 * k, 0.18, 33 + 5 * (k % 3), 25) for k in range(4)]
# Soft notes under key switches: a low one, then another above it, for each of legato, slide, palm, ghost, harmonic,
# vibrato
TECHNIQUES = [
    note
    for k, switch in enumerate((12, 4, 3, 10, 17, 6))
    for note in (
        (0.16 * k, 0.15, switch, 100), (0.16 * k + 0.01, 0.13, 35 + 5 * (k % 3), 25),
        (0.16 * k + 0.05, 0.05, 36 + 5 * (k % 3), 25),
    )
]  # fmt: skip


def in_wasm(preset: str | Instrument, score: Score, seconds: float = 1.0) -> Floats:
    bass = load_preset(preset) if isinstance(preset, str) else preset
    module = Module(image_file(bass), score.rate)
    for message in messages_of(score):
        module.send(*message)
    frames = round(seconds * score.rate) // QUANTUM * QUANTUM
    sound = module.play(frames)
    assert module.field("faults") == 0
    return sound


def natively(preset: str | Instrument, score: Score) -> Floats:
    """As in `livebass render`, cut at full scale, like the page's."""
    bass = load_preset(preset) if isinstance(preset, str) else preset
    sound = render_to_array(bass, score, QUALITIES["live"], tail=1.0)
    return np.clip(mix_strings(single(sound)), -1, 1)


def test_the_module_is_small_and_imports_nothing() -> None:
    import wasmtime

    data = build.module()
    module = wasmtime.Module(wasmtime.Engine(), data)
    assert not list(module.imports) and len(data) < MAX_BYTES
    exported = {"memory", "__indirect_function_table", "__heap_base", *(f"lb_{entry.name}" for entry in ENTRIES)}
    assert {export.name for export in module.exports} == exported
    assert b"numba" not in data and b"Py_" not in data


@pytest.mark.parametrize("preset", PINNED)
def test_it_plays_the_pinned_sound(preset: str) -> None:
    """Hard notes on all strings. Browsers have the same hash: test_page.py."""
    assert sound_hash(in_wasm(preset, score_of(HARD, RATE), PINNED[preset]["seconds"])) == PINNED[preset]["hash"]


@pytest.mark.parametrize("notes", [SOFT, TECHNIQUES], ids=["plucked", "techniques"])
@pytest.mark.parametrize("preset", ["jazz-finger", "precision-finger"])
def test_soft_notes_are_those_of_the_native_engine(preset: str, notes: list[tuple[float, float, int, int]]) -> None:
    """Strings that touch hardly any fret: nothing is chaotic."""
    score = score_of(notes, RATE)
    sound = in_wasm(preset, score)
    assert np.abs(sound - natively(preset, score)[: len(sound)]).max() <= CLOSE < 0.01 < np.abs(sound).max()


def test_channels_are_apart_as_in_render(tmp_path: Path) -> None:
    """Wheels, ranges, tuning, pedals and expression of two channels, and keys held on both."""
    score = midi_score(tmp_path / "a.mid")
    soft = score.messages.copy()
    soft[:, 2] = np.where(soft[:, 0] & 0xF0 == 0x90, np.minimum(soft[:, 2], 30), soft[:, 2])
    score = replace(score, messages=soft)
    sound = in_wasm("jazz-finger", score)
    assert np.abs(sound - natively("jazz-finger", score)[: len(sound)]).max() <= CLOSE < 0.01 < np.abs(sound).max()


def test_a_pick_of_ones_own_is_heard_as_in_render() -> None:
    bass = load_preset("jazz-finger")
    default = replace(bass, player=replace(bass.player, stroke="pick"))
    own = replace(default, player=replace(default.player, pick=Pick(soft_width=6e-3, hard_width=4e-3, place=0.8)))
    score = score_of(SOFT, RATE)
    here, there = in_wasm(own, score), natively(own, score)
    assert np.abs(here - there[: len(here)]).max() < CLOSE
    assert np.abs(here - in_wasm(default, score)).max() > 0.1 * np.abs(here).max()


def test_the_floor_is_that_of_a_render() -> None:
    default = load_preset("jazz-finger")
    bass, score = replace(default, player=replace(default.player, floor_noise=-20.0)), score_of(SOFT, RATE)
    here, there = in_wasm(bass, score), natively(bass, score)
    assert np.abs(here - there[: len(here)]).max() < CLOSE < 1e-3 < np.abs(here - in_wasm(default, score)).max()


def test_hum_and_a_resting_palm_and_a_click_are_those_of_a_render() -> None:
    default, score = load_preset("precision-pick"), score_of(SOFT, RATE)
    for numbers in ({"palm_resistance": 0.3}, {"pick_noise": -20.0}, {"floor_noise": -200.0, "hum": -20.0}):
        bass = replace(default, player=replace(default.player, **numbers))  # type: ignore[arg-type]
        here, there = in_wasm(bass, score), natively(bass, score)
        assert np.abs(here - there[: len(here)]).max() < CLOSE < np.abs(here - in_wasm(default, score)).max()


def test_effects_are_those_of_a_render() -> None:
    """A response comes with the bass's file, or from the page in its place."""
    samples = np.exp(-np.arange(9000) / 900) * np.cos(np.arange(9000.0)) / 9
    bass, score = load_preset("jazz-finger"), score_of(SOFT, RATE)
    bass = replace(bass, effects=Effects(0.5, 0.75, Response(RATE, samples.tobytes())))
    engine = Engine(bass, QUALITIES["live"], RATE)
    engine.send(score.frames, score.messages)
    wanted, sound = engine.process_with_mix(RATE)[1], in_wasm(bass, score)
    assert wanted is not None and np.abs(sound - wanted[: len(sound)]).max() < CLOSE < 0.005 < np.abs(sound).max()
    dry = replace(bass, effects=Effects())
    by_page = Module(image_file(dry), RATE, response=samples)
    rings = int(by_page.field("midi_ring")[0])
    for knob, value in enumerate((0.5, 0.75)):
        by_page.call("push_event", rings, MESSAGES, 0, EFFECT, knob, value)
    for message in messages_of(score):
        by_page.send(*message)
    assert np.abs(by_page.play(len(sound)) - sound).max() < CLOSE
    assert np.abs(in_wasm(dry, score) - sound).max() > 0.005


def test_the_amp_is_that_of_a_render_from_a_file_and_by_knobs() -> None:
    score, bass = score_of(SOFT, RATE), load_preset("jazz-finger")
    amp = Effects(
        drive=0.5, clean_blend=0.5, eq_bass=6.0, eq_low_mid=-4.0, eq_low_mid_frequency=630.0, cabinet="closed-8x10"
    )
    engine = Engine(replace(bass, effects=amp), QUALITIES["live"], RATE)
    engine.send(score.frames, score.messages)
    wanted, sound = engine.process_with_mix(RATE)[1], in_wasm(replace(bass, effects=amp), score)
    assert wanted is not None and np.abs(sound - wanted[: len(sound)]).max() < CLOSE < 0.005 < np.abs(sound).max()
    by_page = Module(image_file(bass), RATE)
    rings = int(by_page.field("midi_ring")[0])
    knobs = {
        "drive": 0.5, "clean_blend": 0.5, "eq_bass": 6.0, "eq_low_mid": -4.0, "eq_low_mid_frequency": 4.0,
        "cabinet": 3.0,
    }  # fmt: skip
    for knob, value in knobs.items():
        by_page.call("push_event", rings, MESSAGES, 0, EFFECT, EFFECTS.index(knob), value)
    for message in messages_of(score):
        by_page.send(*message)
    assert np.abs(by_page.play(len(sound)) - sound).max() < CLOSE


@pytest.mark.slow  # may have to compile that level
@pytest.mark.skipif(platform.machine().lower() not in X86, reason="another kind of processor")
def test_hard_notes_are_those_of_processors_without_fused_multiplication() -> None:
    """Through all contacts: WebAssembly has the arithmetic of the level x86-64-v2, but another order of sums.

    LLVM picks the number of lanes for each. Where sums stay as written, both give the same bits, even through
    denormals, which WebAssembly keeps.
    """
    environment = {"LIVEBASS_LEVEL": "x86-64-v2"} | module_paths(TESTS.parent)
    there = np.frombuffer(bytes.fromhex(python_output(__file__, "slap", env=environment)), np.float32)
    sound = in_wasm("slap", score_of(HARD, RATE))
    assert np.abs(sound - there[: len(sound)]).max() <= OTHER_ORDER


def test_a_told_load_relieves_strings_and_lets_them_go() -> None:
    module = Module(image_file(load_preset("jazz-finger")), RATE, adaptive=True)
    for message in messages_of(score_of([(0.0, 9.0, key, 100) for key in (28, 33, 38, 43)], RATE)):
        module.send(*message)
    module.play(QUANTUM)
    for k in range(4):
        assert module.field("overload") == k
        module.call("relieve", module.synth, 1.5, QUANTUM)
        module.play(QUANTUM)
    assert module.field("overload") == 4
    for _ in range(3 * RATE // 2048):
        module.call("relieve", module.synth, 0.1, 2048)
        module.play(QUANTUM)
    assert module.field("overload") == 0 and module.field("faults") == 0


def test_a_damaged_file_is_refused() -> None:
    data = bytearray(image_file(load_preset("jazz-finger")))
    data[2000] ^= 1
    with pytest.raises(AssertionError):
        Module(bytes(data), RATE)


def test_javascript_has_the_records_of_the_kernels() -> None:
    for of in RECORDS.values():
        assert of.fields and of.names
        found = record(of)
        assert found["bytes"] == of.itemsize
        offsets = {name: offset for name, (offset, _) in found["fields"].items()}
        assert {name: offset for name, offset in offsets.items() if "." not in name} == {
            name: of.fields[name][1] for name in of.names
        }
        for name in offsets:
            inner, at = of, 0
            for part in name.split("."):
                assert inner.fields
                inner, at = inner.fields[part][0], at + inner.fields[part][1]
            assert offsets[name] == at
        kinds = {kind for _, kind in found["fields"].values()}
        assert kinds <= {"", "i8", "i4", "i2", "f8", "f4", "u1", "u8"}  # u8: a checksum, read only by kernels


if __name__ == "__main__":
    if sys.argv[1:] == ["pin"]:  # listen first
        for preset, of in PINNED.items():
            for key, bass in (("hash", load_preset(preset)), ("shipped", livebass.load_preset(preset))):
                of[key] = sound_hash(in_wasm(bass, score_of(HARD, RATE), of["seconds"]))
        PINS.write_text(json.dumps(PINNED, indent=2) + "\n")
    else:
        print(natively(sys.argv[1], score_of(HARD, RATE)).astype(np.float32).tobytes().hex())
