"""The checks of plugin validators that the tests of formats and promises do not make anyway.

The lists are those of
- clap-validator: github.com/free-audio/clap-validator, src/tests/plugin_library.rs and plugin_instance.rs;
- Steinberg's validator: github.com/steinbergmedia/vst3_public_sdk, samples/vst-hosting/validator/source/validator.cpp,
  with its checks in source/vst/testsuite;
- pluginval, up to strictness 10: github.com/Tracktion/pluginval, Source/tests.
The plugins have no audio input, no 64-bit samples, no modulation and no IMidiLearn: checks of these do not apply.
"""

from __future__ import annotations

import ctypes as c
import locale
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import vst3 as low
from support.clap import (
    DESCRIPTOR,
    MIDI_EVENT,
    MONO,
    NOTE,
    STRINGS,
    Library,
    Plugin,
    choke,
    expression,
    midi,
    note_off,
    note_on,
    tuning,
    value,
)

from livebass.live.parameters import PARAMETERS
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats

BASSES = ("jazz-finger", "slap")
RATES = (1000.0, 1234.5678, 22050.0, 44100.0, 123456.78, 768000.0, 1234567.8)  # Hz
TINY = float(np.finfo(np.float32).tiny)
ROUNDS = 12  # rounds of random values and events


def assert_sound(sound: Floats) -> None:
    assert np.isfinite(sound).all()
    assert not ((sound != 0) & (abs(sound) < TINY)).any(), "subnormal"


# --- CLAP ---


def test_scanning_is_quick_and_takes_known_names_alone(folder: Path) -> None:
    began = time.process_time()
    library = Library(folder)
    assert [name for name, _ in library.plugins()] == [MONO, STRINGS]
    assert time.process_time() - began < 0.1
    assert not library.entry.factory(b"clap.plugin-factory-of-ours")
    factory, address = library.factory()
    with closing(Plugin(folder, active=False)) as plugin:
        assert not factory.create(address, c.addressof(plugin.host), f"{MONO}x1".encode())
        assert not factory.create(address, c.addressof(plugin.host), b"")
    assert not factory.descriptor(address, 2)


def test_an_instance_is_described_as_its_factory_says(folder: Path) -> None:
    for k, name in enumerate((MONO, STRINGS)):
        with closing(Plugin(folder, name=name, active=False)) as plugin:
            factory, address = plugin.library.factory()
            reported, own = factory.descriptor(address, k).contents, plugin.plugin.descriptor.contents
            for field in dict(DESCRIPTOR._fields_).keys() - {"version", "features"}:
                assert getattr(reported, field) == getattr(own, field)
            assert (
                reported.name and reported.vendor and reported.release and list(reported.version) == list(own.version)
            )
            features = []
            while reported.features[len(features)]:
                features.append(reported.features[len(features)])
            assert b"instrument" in features and len(set(features)) == len(features)


def events(rng: np.random.Generator, count: int, frames: int) -> list[Any]:
    """Random events that need not match; keys and channels of -1 mean any."""
    made = []
    for _ in range(count):
        key, number, low7 = int(rng.integers(-1, 128)), int(rng.integers(-1, 20)), rng.integers(0, 128, 2).tolist()
        any_event = [
            note_on(max(key, 0), rng.uniform(0, 1), number, int(rng.integers(-1, 16))), note_off(key, number),
            choke(key), tuning(rng.uniform(-120, 120), key, number),
            expression(int(rng.integers(0, 8)), rng.uniform(-2, 2), key, number),
            midi(rng.integers(0, 256, 3, dtype=np.uint8).tobytes()), midi(bytes([0xB0, *low7])),
        ]  # fmt: skip
        made.append(any_event[rng.integers(len(any_event))])
    return at_random_frames(rng, frames, made)


def at_random_frames(rng: np.random.Generator, frames: int, events: list[Any]) -> list[Any]:
    for event, when in zip(events, sorted(rng.integers(0, frames, len(events)).tolist()), strict=True):
        event.time = when
    return events


def test_any_notes_give_a_sound_without_subnormal_numbers(plugin: Plugin) -> None:
    rng = np.random.default_rng(1)
    for k in range(ROUNDS):
        assert_sound(plugin.block(512, events(rng, 40, 512)))
        assert_sound(plugin.block(512, [note_on(28 + k, 0.9), note_on(43 + k, 0.5)]))
    plugin.block(1, [note_off(-1)])
    assert_sound(plugin.block(48000))


def test_any_values_give_a_sound(plugin: Plugin) -> None:
    """At random, at their limits, and at random frames."""
    rng = np.random.default_rng(2)
    params = [p for p in plugin.params() if not p.flags & 1 << 3]  # 3: read only
    for k in range(ROUNDS):
        moved = at_random_frames(rng, 1000, [
            value(p.id, rng.uniform(p.minimum, p.maximum) if k % 2 else (p.minimum, p.maximum)[rng.integers(2)])
            for p in params
        ])  # fmt: skip
        assert_sound(plugin.block(1000, [note_on(28 + 2 * k, 0.9), *moved]))
        plugin.work()


def test_values_are_the_same_by_flush_and_by_process(folder: Path) -> None:
    rng = np.random.default_rng(3)
    with closing(Plugin(folder)) as one, closing(Plugin(folder)) as other:
        wanted = {p.id: rng.uniform(p.minimum, p.maximum) for p in one.params() if not p.flags & 1 << 3}
        for number, x in wanted.items():
            one.set(number, x)
        other.block(64, [value(number, x) for number, x in wanted.items()])
        assert [one.value(number) for number in wanted] == [other.value(number) for number in wanted]
        assert one.save() == other.save()


def test_events_of_another_space_change_nothing(plugin: Plugin) -> None:
    """Nor do transport events, 9."""
    before = plugin.save()
    foreign = [value(p.id, p.maximum) for p in plugin.params()] + [note_on(40, 0.9)]
    for event in foreign:
        event.space = 0xB33F
    transport = MIDI_EVENT(c.sizeof(NOTE), 0, 0, 9)
    assert not plugin.block(512, [*foreign, transport]).any() and plugin.save() == before


def test_values_and_texts_agree(plugin: Plugin) -> None:
    rng = np.random.default_rng(4)
    for p in plugin.params():
        ends = [plugin.text(p.id, x) for x in (p.minimum, p.maximum)] if p.name.endswith(b" place") else []
        for x in (p.minimum, p.default, p.maximum, *rng.uniform(p.minimum, p.maximum, 200)):
            x = round(x) if p.flags & 1 else x  # 1: stepped
            text = plugin.text(p.id, x)
            read = plugin.value_of(p.id, text)
            limited = text in ("0 %", "50 %", *ends)  # of unevenness, which a bass has up to here; of a pickup's room
            assert read is not None and (limited or abs(read - x) <= 0.04 * (p.maximum - p.minimum)), (p.name, text)
            assert plugin.text(p.id, read) == text


def test_values_and_texts_agree_in_vst3(vst3_bundle: Path) -> None:
    """Of all parameters: those that hosts hide, and Overload."""
    rng = np.random.default_rng(4)
    with closing(low.Plugin(vst3_bundle)) as plugin:
        for number, p in plugin.parameters().items():
            count = 200 if number <= len(PARAMETERS) else 3
            for x in [0.0, float(p.default), 1.0, *rng.uniform(0, 1, count)]:
                text = plugin.text(number, x)
                read = plugin.value_of(number, text)
                assert read is not None and 0 <= read <= 1, (low.wide(p.title), text)
                assert plugin.text(number, read) == text, low.wide(p.title)
        assert plugin.value_of(1000, "none") is plugin.value_of(1000, "inf") is plugin.value_of(999, "0") is None


def test_a_state_of_random_bytes_is_refused(plugin: Plugin) -> None:
    rng, before = np.random.default_rng(5), plugin.save()
    for size in (1, 8, 300, 1 << 16, 1 << 18):
        assert not plugin.load(rng.bytes(size))
    assert plugin.save() == before


def test_a_state_is_the_same_when_saved_again(folder: Path, plugin: Plugin) -> None:
    """Our host reads and writes it in pieces of a few bytes."""
    rng = np.random.default_rng(6)
    for _ in range(ROUNDS):
        plugin.block(
            64, [value(p.id, rng.uniform(p.minimum, p.maximum)) for p in plugin.params() if not p.flags & 1 << 3]
        )
        state = plugin.save()
        assert state == plugin.save()
        with closing(Plugin(folder, active=False)) as other:
            assert other.load(state) and other.save() == state
            assert [other.value(p.id) for p in other.params()] == [plugin.value(p.id) for p in plugin.params()]


def test_it_plays_at_any_rate(folder: Path) -> None:
    for rate in RATES:
        with closing(Plugin(folder, rate=rate)) as plugin:  # type: ignore[arg-type]
            sound = plugin.block(1024, [note_on(40, 0.9)])
            assert_sound(sound)
            assert sound.any()


def test_the_locale_stays(plugin: Plugin) -> None:
    before = locale.setlocale(locale.LC_ALL)
    plugin.block(64, [note_on(40, 0.9)])
    assert plugin.load(plugin.save()) and plugin.text(0, -3.5) == "-3.5 dB"
    assert locale.setlocale(locale.LC_ALL) == before


# --- VST3 ---

LINUX = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="the host is for Linux on x86-64")


@pytest.fixture
def other(vst3_bundle: Path, lend: Any) -> low.Plugin:
    return lend(low.Plugin(vst3_bundle))  # type: ignore[no-any-return]


@LINUX
def test_parameters_of_vst3_have_what_hosts_need(other: low.Plugin) -> None:
    parameters = other.parameters()
    assert len(parameters) == other.controller.call(8), "each has an id of its own"
    units = other.units()
    for number, p in parameters.items():
        assert number < 1 << 31 and low.wide(p.title) and p.steps >= 0 and 0 <= p.default <= 1 and p.unit in units
        assert not p.flags & low.IS_READ_ONLY or not p.flags & (low.CAN_AUTOMATE | low.IS_PROGRAM_CHANGE)
        assert not p.flags & low.IS_PROGRAM_CHANGE or p.flags & low.IS_LIST
        for x in (0.0, 0.25, 1.0):
            plain = other.controller.call(12, low.U32(number), x, result=low.D)
            normal = other.controller.call(13, low.U32(number), plain, result=low.D)
            assert p.steps or normal == pytest.approx(x, abs=1e-12)
            assert other.text(number, x)
    assert other.controller.call(9, low.I32(len(parameters)), c.addressof(low.Parameter())) != 0


@LINUX
@pytest.mark.parametrize("which", [low.MONO, low.STRINGS])
def test_buses_are_as_they_say(vst3_bundle: Path, lend: Any, which: int) -> None:
    plugin = lend(low.Plugin(vst3_bundle, which))
    component, found = plugin.component, c.create_string_buffer(16)
    assert component.call(5, c.addressof(found)) != 0, "the object is its own controller"
    assert component.call(7, low.I32(1), low.I32(0)) == 1 and component.call(7, low.I32(0), low.I32(0)) == 0
    for media, direction in ((0, 0), (0, 1), (1, 0), (1, 1)):
        kind = (low.I32(media), low.I32(direction))
        count = component.call(7, *kind)
        for index in range(-1, count + 1):
            bus, exists = low.Bus(), 0 <= index < count
            assert (component.call(8, *kind, low.I32(index), c.addressof(bus)) == 0) == exists
            if exists:
                assert low.wide(bus.name) and bus.channels > 0 and (bus.media, bus.direction) == (media, direction)
                assert bus.type == (index > 0) and bus.flags == 1
            for on in (0, 1):
                assert (component.call(10, *kind, low.I32(index), c.c_uint8(on)) == 0) == exists
            arrangement = low.U64()
            if media == 0:
                reported = plugin.processor.call(4, low.I32(direction), low.I32(index), c.addressof(arrangement))
                assert (reported == 0) == exists and arrangement.value.bit_count() == (bus.channels if exists else 0)


@LINUX
def test_it_begins_and_ends_in_any_legal_order(other: low.Plugin) -> None:
    """Terminated and initialized again, prepared again without an end, with blocks longer than announced."""
    for rate, maximum in ((44100.0, 64), (96000.0, 1024), (48000.0, 32)):
        for on in (0, 1, 0, 1):  # setActive, setProcessing
            setup = low.Setup(low.REAL_TIME, 0, maximum, rate)
            if not on:
                assert other.component.call(11, c.c_uint8(0)) == 0
                assert other.processor.call(7, c.addressof(setup)) == 0
                continue
            assert other.component.call(11, c.c_uint8(1)) == 0 == other.processor.call(8, c.c_uint8(1))
            sound = other.block(2 * maximum, [low.note_on(40, 0.9, 1)])
            assert_sound(sound)
            assert sound.any() and other.processor.call(8, c.c_uint8(0)) == 0
    for _ in range(2):
        assert other.component.call(11, c.c_uint8(0)) == other.component.call(4) == 0
        assert other.component.call(11, c.c_uint8(1)) != 0, "not while it is terminated"
        assert other.component.call(3, None) == 0 == other.component.call(11, c.c_uint8(1))
        assert other.block(256, [low.note_on(40, 0.9, 1)]).any()


@LINUX
def test_values_without_sound_are_taken(vst3_bundle: Path, lend: Any) -> None:
    """A block with no frames and no outputs still moves parameters."""
    sounds = []
    for flush in (False, True):
        plugin = lend(low.Plugin(vst3_bundle))
        points = [(0, 0, 0.5), (1, 0, 0.1)]
        if flush:
            outputs, plugin.outputs = plugin.outputs, 0
            plugin.block(0, points=points)
            plugin.outputs = outputs
        sounds.append(plugin.block(2048, [low.note_on(40, 0.9, 1)], [] if flush else points))
    assert np.array_equal(*sounds) and sounds[0].any()
