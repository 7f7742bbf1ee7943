"""A string's reports: contacts with their speed, and the events from which its motion can be replayed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.messages import send
from support.own_basses import load_preset
from support.wasm import QUANTUM, Module

from livebass import QUALITIES
from livebass.engine.engine import Engine
from livebass.engine.image import Bass
from livebass.engine.prepare import play_frames
from livebass.kernels.bass.instrument import LIVE
from livebass.kernels.bass.records import BASS
from livebass.kernels.string.records import PLUCK, STRING, THROW
from livebass.kernels.string.reports import REPORTS, begin_again
from livebass.plugin.instrument import image_file
from livebass.rows.arrays import Floats
from livebass.rows.units import OFF

RATE = 48000
# Keys, switches and controllers (modo): palm and bend last from note to note, so a replay must know them
PHRASE = [
    (100, 0x90, 28, 100), (4000, 0xB0, 1, 90), (5000, 0x90, 31, 80), (9000, 0xE0, 0, 80), (12000, 0x80, 31, 0),
    (30000, 0x90, 33, 120), (36000, 0x80, 33, 0), (36000, 0x80, 28, 0),
]  # fmt: skip


class Watched(Engine):
    """An engine whose strings keep contacts and events."""

    contacts, events = 4096, 64

    def _begin(self, seed: int) -> None:
        super()._begin(seed)
        self.bass = self.kept()
        self.voices, self.performer = self.bass.voices, self.bass.performer

    def kept(self) -> Bass:
        """A fresh bass."""
        return self.image.bass(
            LIVE, self.rate, self.seed, self.pools, self.play_string, contacts=self.contacts, events=self.events
        )


@pytest.mark.parametrize("preset", ["jazz-finger", "fretless", "slap"])
def test_keeping_is_not_heard(preset: str) -> None:
    bass = load_preset(preset)
    engines = [kind(bass, QUALITIES["live"], RATE) for kind in (Engine, Watched)]
    for engine in engines:
        send(engine, PHRASE)
    plain, kept = (engine.process(15000) for engine in engines)
    assert np.array_equal(plain, kept)
    counts = [int(engine.voices[0].record["logged"][0]) for engine in engines]
    assert counts[0] == counts[1] > 0


def test_contacts_have_fret_and_speed() -> None:
    """The ring keeps the last contacts. None is slower than standing still, or faster than hard plucks."""
    bass = load_preset("paper-g")
    engines = [Watched(bass, QUALITIES["live"], RATE), Watched(bass, QUALITIES["live"], RATE)]
    engines[1].contacts = 4
    engines[1]._begin(0)
    for engine in engines:
        send(engine, [(0, 0x90, 48, 127)])
        engine.process(4800)
    voice, short = (engine.voices[0] for engine in engines)
    count = int(voice.record["logged"][0])
    assert 4 < count <= len(voice.log)
    log = voice.log[:count]
    op = engines[0].pool.records[0, 5]
    assert (log["fret"] == 5).all() and (np.diff(log["step"]) >= 0).all()
    assert (log["point"] >= 0).all() and (log["point"] < op["points"]).all()
    assert (log["speed"] > 0).all() and log["speed"].max() < 20 and log["speed"].max() > 1
    last = log[-4:]
    assert sorted(short.log.tolist()) == sorted(last.tolist()) and len(short.log) == 4


def replay(engine: Watched, i: int, frames: int) -> Floats:
    """The motion of string `i`, replayed on a fresh bass from the first of its kept events."""
    reports, events = engine.bass.reports(i)
    bass = engine.kept()
    string = bass.voices[i]
    begin_again(string.string.ctypes.data, reports.ctypes.data)
    out = np.zeros(frames - int(reports["from_frame"][0]))
    assert play_frames(string, engine.pool.records[i], events.copy(), out) == len(events)
    return out


@pytest.mark.parametrize("preset", ["jazz-finger", "slap", "fretless", "precision-pick"])
def test_the_same_events_make_the_same_motion(preset: str) -> None:
    """For notes on a resting string, after earlier controllers and notes long gone: bit for bit."""
    bass = load_preset(preset)
    engine = Watched(replace(bass, player=replace(bass.player, floor_noise=OFF)), QUALITIES["live"], RATE)
    send(engine, PHRASE)
    sound = [engine.process(40000)]
    (voice,) = engine.voices[:1]
    while not voice.record["still"][0]:
        sound.append(engine.process(48000))
        assert len(sound) < 40
    first = int(engine.bass.reports(0)[0]["from_frame"][0])
    whole = np.concatenate([s[0] for s in sound])
    assert np.array_equal(replay(engine, 0, len(whole)), whole[first:])
    send(engine, [(engine.frame + 77, 0x90, 29, 127), (engine.frame + 3000, 0x90, 30, 90)])
    begun = engine.frame
    again = engine.process(24000)[0]
    reports, events = engine.bass.reports(0)
    assert reports["from_frame"] == begun + 77 and np.isin(events["kind"], (PLUCK, THROW)).sum() == 2
    assert np.array_equal(replay(engine, 0, engine.frame), again[77:]) and abs(again).max() > 1e-3


def test_a_string_without_room_keeps_nothing() -> None:
    engine = Engine(load_preset("paper-g"), QUALITIES["live"], RATE)
    send(engine, [(0, 0x90, 50, 127)])
    engine.process(4800)
    v = engine.voices[0].record[0]
    assert (v["report_room"], v["report_count"], v["log_room"]) == (0, 0, 0) and v["logged"] > 0


def test_more_events_than_there_is_room_for_are_told() -> None:
    engine = Watched(load_preset("paper-g"), QUALITIES["live"], RATE)
    send(engine, [(40 * k, 0x90, 50, 60) for k in range(90)])
    engine.process(4000)
    with pytest.raises(LookupError, match="events since it was still"):
        engine.bass.reports(0)


def test_a_page_plays_the_last_note_again() -> None:
    """In WebAssembly, on another bass: a worker's replay of the events matches the sound bit for bit."""
    page = Module(image_file(load_preset("paper-g")), RATE, reports=64)
    page.play(QUANTUM * 3)
    page.send(500, 0x90, 48, 127)
    page.send(3000, 0xE0, 0, 90)
    heard = page.play(QUANTUM * 60)
    string, other = (int(page.record(BASS, at)["string"][0]) for at in (page.bass, page.new_bass()))
    voice = page.record(STRING, string)["voice"]
    place, count = int(voice["reports"]), int(voice["report_count"])
    first = int(page.record(REPORTS, place)["from_frame"])
    assert first == 500 and 2 <= count <= 64
    page.call("begin_again", other, place)
    frames = 63 * QUANTUM - first
    out = page.place(8 * frames)
    ops, frets = int(page.record(BASS, page.bass)["operators"][0]), int(page.record(BASS, page.bass)["frets"])
    assert page.call("run_string", other, ops, frets, place + REPORTS.itemsize, count, out, 0, frames) == count
    again = page.bytes(out, 8 * frames).view(np.float64).astype(np.float32)
    assert np.array_equal(again, heard[first - 3 * QUANTUM :]) and abs(again).max() > 0.01
