"""Notes of one key that overlap, in hosts that name them by port, channel, key and id (CLAP), or by id (VST3).

A bass has one string for a key of a channel: the second note strikes it again, and from then on the first one's
note-off, choke and expressions mean nothing. CLAP asks for the whole tuple (clap 1.2, include/clap/events.h: "Well
constructed plugins will search for voices and notes using the entire tuple").
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from support import clap as of_clap
from support import vst3 as of_vst3
from support.plugins import RATE, write_bundle

from livebass.plugin import clap, vst3
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats

pytestmark = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="hosts by ctypes")
FORMATS = ("clap", "vst3")
ON, OFF, CHOKE, TUNE = range(4)
ANY, NONE = -1, -2  # ids; NONE: of a note that no id means
SILENT = -60.0  # dB: a damped string and the noise of the electronics; notes ring at -20 to -45
LEGATO, SLIDING, MONO = (0xB0, 68, 127), (0xB0, 65, 127), (0xB0, 126, 1)


class Event(NamedTuple):
    """An event of a host: a note's begin, end or choke, or its tuning by a semitone."""

    frame: int
    kind: int
    channel: int
    key: int
    number: int = ANY  # its id


@pytest.fixture(scope="module")
def places(thread_checks: None, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("notes")
    return {
        "clap": write_bundle(clap, folder / "livebass"),
        "vst3": write_bundle(vst3, folder / "livebass.vst3"),
    }


def clap_event(e: Event) -> Any:
    kind = {ON: of_clap.NOTE_ON, OFF: of_clap.NOTE_OFF, CHOKE: of_clap.NOTE_CHOKE}.get(e.kind)
    if kind is None:
        return of_clap.tuning(1.0, e.key, e.number, e.channel)
    made = of_clap.note_on(e.key, 0.8, e.number, e.channel)
    made.type = kind
    return made


def vst3_event(e: Event) -> of_vst3.Event:
    if e.kind == ON:
        return of_vst3.note_on(e.key, 0.8, e.number, e.frame, e.channel)
    if e.kind == OFF:
        return of_vst3.note_off(e.key, e.number, e.frame, e.channel)
    return of_vst3.tuning(1.0, e.number, e.frame)


def played(place: Path, events: Sequence[Event], frames: int, first: Iterable[tuple[int, int, int]] = ()) -> Floats:
    """The sound of a CLAP or VST3 plugin, offline, in one block, after the MIDI messages `first`."""
    if place.suffix == ".vst3":
        plugin: Any = of_vst3.Plugin(place, mode=of_vst3.OFFLINE)
        points = [(plugin.mapped(status & 15, number), 0, x / 127) for status, number, x in first]
        plugin.block(1, points=points)
        with closing(plugin):
            return plugin.block(frames, [vst3_event(e) for e in events])[0, 0]
    with closing(of_clap.Plugin(place)) as plugin:
        plugin.offline()
        plugin.block(1, [of_clap.midi(bytes(message)) for message in first])
        return plugin.play([(e.frame, clap_event(e)) for e in events], frames, (frames,))


def by_midi(place: Path, events: Sequence[Event], frames: int) -> Floats:
    """The sound of those events as MIDI, which has no ids."""
    messages = [bytes([(0x80 if e.kind else 0x90) | e.channel, e.key, 0 if e.kind else 102]) for e in events]
    with closing(of_clap.Plugin(place)) as plugin:
        plugin.offline()
        given = [(e.frame, of_clap.midi(message)) for e, message in zip(events, messages, strict=True)]
        return plugin.play(given, frames, (frames,))


def level(sound: Floats) -> float:
    """dB of full scale."""
    return 20 * float(np.log10(np.sqrt(np.mean(np.square(sound, dtype=float))) + 1e-12))


class Model:
    """Which note each key of a channel has, in plain words of CLAP: -1 means any.

    An end with an id also means a note begun without one, by its key, unless that note has replaced one with an id.
    """

    def __init__(self) -> None:
        self.held: dict[tuple[int, int], int] = {}  # ids of the notes that sound

    def take(self, e: Event) -> list[Event]:
        """Returns what of an event a bass hears: note-offs of notes that sound."""
        if e.kind == ON:
            replaced = self.held.get((e.channel, e.key), ANY) != ANY
            self.held[e.channel, e.key] = NONE if e.number == ANY and replaced else e.number
            return [e]
        ended = [
            place for place, number in sorted(self.held.items())
            if e.channel in (ANY, place[0]) and e.key in (ANY, place[1])
            and (e.number in (ANY, number) or (number == ANY and e.key != ANY))
        ]  # fmt: skip
        for place in ended:
            del self.held[place]
        return [Event(e.frame, OFF, *place) for place in ended]


def storm(seed: int, count: int, ids: str, channels: int, wild: bool) -> Iterator[Event]:
    """Random begins of few keys and ends of any of the notes begun, each in a frame of its own.

    ids: "all" notes have one, "none", or "some". `wild`: ends that name less than the whole tuple.
    """
    rng = np.random.default_rng(seed)
    begun: list[Event] = []
    for k in range(count):
        frame = 100 * (k + 1)
        if not begun or rng.random() < 0.55:
            number = k if ids == "all" or (ids == "some" and rng.random() < 0.5) else ANY
            begun.append(Event(frame, ON, int(rng.integers(channels)), int(rng.choice([28, 35, 40, 41, 52])), number))
            yield begun[-1]
            continue
        note = begun.pop(int(rng.integers(max(len(begun) - 6, 0), len(begun))))
        channel, key, number = note.channel, note.key, note.number
        if wild and rng.random() < 0.3:
            channel, number = (ANY, number) if rng.random() < 0.5 and number != ANY else (channel, ANY)
            key = ANY if number != ANY and rng.random() < 0.3 else key
        yield Event(frame, OFF, channel, key, number)


@pytest.mark.parametrize("ids", ["all", "none", "some"])
@pytest.mark.parametrize("kind", FORMATS)
def test_in_a_storm_of_equal_keys_each_end_ends_its_note(places: dict[str, Path], kind: str, ids: str) -> None:
    """The sound is that of MIDI with the ends alone that a model finds; no note is stuck."""
    events = list(storm(len(ids), 1500, ids, 4, wild=kind == "clap"))
    model, heard = Model(), list[Event]()
    for e in events:
        heard += model.take(e)
    end = events[-1].frame + 100
    for k, (channel, key) in enumerate(sorted(model.held)):
        events.append(Event(end + k, OFF, channel, key))
        heard.append(Event(end + k, OFF, channel, key))
    sound = played(places[kind], events, end + RATE)
    assert np.array_equal(sound, by_midi(places["clap"], heard, end + RATE))
    assert level(sound[: end // 2]) > -40 and level(sound[-RATE // 4 :]) < SILENT


@pytest.mark.parametrize("ids", ["all", "none", "some"])
@pytest.mark.parametrize("first", [(), [LEGATO], [SLIDING], [MONO]], ids=["plucked", "legato", "sliding", "mono"])
@pytest.mark.parametrize("kind", FORMATS)
def test_a_key_sounds_while_its_last_note_is_held(
    places: dict[str, Path], kind: str, first: list[tuple[int, int, int]], ids: str
) -> None:
    """After bursts of begins and ends, in every way to join notes."""
    rng = np.random.default_rng(5)
    model, events, wanted, frame = Model(), list[Event](), list[tuple[int, bool]](), 0
    for burst in range(12):
        begun = []
        for k in range(int(rng.integers(1, 9))):
            frame += int(rng.integers(1, 900))
            if begun and rng.random() < 0.5:
                number = begun.pop(int(rng.integers(len(begun))))
                events.append(Event(frame, OFF, 0, 40, number))
            else:
                number = 100 * burst + k if ids == "all" or (ids == "some" and k % 2) else ANY
                begun.append(number)
                events.append(Event(frame, ON, 0, 40, number))
            model.take(events[-1])
        frame += RATE // 3
        wanted.append((frame, bool(model.held)))
    sound = played(places[kind], events, frame, first)
    assert {sounds for _, sounds in wanted} == {False, True}
    for until, sounds in wanted:
        assert (level(sound[until - 4000 : until]) > -48) == sounds, (until, sounds)


@pytest.mark.parametrize("kind", FORMATS)
def test_events_of_a_replaced_note_change_nothing(places: dict[str, Path], kind: str) -> None:
    """Its tuning and its choke; those of the note that replaced it do."""
    twice = [Event(0, ON, 0, 40, 1), Event(2000, ON, 0, 40, 2)]
    plain = played(places[kind], twice, 9000)
    for what in (TUNE, CHOKE) if kind == "clap" else (TUNE,):  # VST3 has no choke
        changed = [played(places[kind], [*twice, Event(4000, what, 0, 40, number)], 9000) for number in (1, 2, ANY)]
        assert np.array_equal(changed[0], plain) and not np.array_equal(changed[1], plain)
        assert kind == "vst3" or np.array_equal(changed[2], changed[1])


@pytest.mark.parametrize("kind", FORMATS)
def test_an_end_names_a_note_that_began_without_an_id(places: dict[str, Path], kind: str) -> None:
    """By its key; but not once that note has replaced one with an id: this end may be the older one's."""
    for begins, number, ends in (([ANY], 5, True), ([7, ANY], 7, False), ([7, ANY], ANY, True), ([7], ANY, True)):
        notes = [Event(1000 * k, ON, 0, 40, begun) for k, begun in enumerate(begins)]
        sound = played(places[kind], [*notes, Event(4000, OFF, 0, 40, number)], RATE)
        assert (level(sound[-9000:]) < SILENT) == ends, (begins, number)


def test_a_note_has_its_port_and_channel(places: dict[str, Path]) -> None:
    """Another port's or channel's end is not its own, with the same key and id."""
    for port, channel, ends in ((0, 0, True), (ANY, 0, True), (0, ANY, True), (1, 0, False), (0, 1, False)):
        with closing(of_clap.Plugin(places["clap"])) as plugin:
            off = of_clap.note_off(40, 3, channel)
            off.port = port
            sound = plugin.play([(0, of_clap.note_on(40, 0.8, 3)), (4000, off)], RATE)
        assert (level(sound[-9000:]) < SILENT) == ends, (port, channel)


@pytest.mark.parametrize("kind", FORMATS)
def test_a_note_of_velocity_0_is_the_softest(places: dict[str, Path], kind: str) -> None:
    """It is no note-off: CLAP's velocity is 0 to 1 in every note (clap 1.2, events.h).

    clack, a library for CLAP, says that such a note-on "is valid and should not be interpreted as a NoteOffEvent".
    """

    def struck(velocity: float) -> Floats:
        if kind == "clap":
            with closing(of_clap.Plugin(places[kind])) as plugin:
                return plugin.block(9000, [of_clap.note_on(40, velocity, 1)])
        with closing(of_vst3.Plugin(places[kind])) as other:
            return other.block(9000, [of_vst3.note_on(40, velocity, 1)])[0, 0]

    softest = struck(0.0)
    assert np.array_equal(softest, struck(1 / 127)) and level(softest) < level(struck(1.0)) - 12


def test_a_place_for_a_replaced_note_does_not_place_the_next(places: dict[str, Path]) -> None:
    def sound(*ids: int) -> Floats:
        with closing(of_clap.Plugin(places["clap"])) as plugin:
            notes = [of_clap.note_on(40, 0.8, 1), of_clap.note_on(40, 0.8, 2)]
            shapes = [of_clap.expression(of_clap.BRIGHTNESS, 0.9, 40, number) for number in ids]
            third = of_clap.note_on(40, 0.8, 3)
            return plugin.play([(0, notes[0]), (500, notes[1]), *((600, s) for s in shapes), (900, third)], 6000)

    plain = sound()
    assert np.array_equal(sound(1), plain) and not np.array_equal(sound(2), plain)
