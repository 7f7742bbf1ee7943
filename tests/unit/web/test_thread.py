"""The page's audio thread, in node: the frames of a song's messages; strings relieved by a clock of the tests."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import pytest
from support import node
from support.wasm import QUANTUM, RATE

from livebass import load_preset
from livebass.rows.arrays import Floats

# A frame takes so many ms for each held string with fine operators, and so many ms for a relieved one. Returns the ms
# of each quantum, and its relieved strings
RUN = """
const [notes, quanta, cost, heldUp] = arguments, {now} = Date, found = [];
let clock = 0;
Date.now = () => Math.floor(clock);
globalThis.sampleRate = 48000;
globalThis.currentFrame = 0;
const p = new Processor({processorOptions: {module}}), e = p.engine, play = e.play;
p.hear({bass: build("jazz-finger", {}, sampleRate)});
e.play = n => {
  const frame = e.field("frame"), sound = play.call(e, n);
  const sounding = notes.filter(note => note.begin < frame + n && frame < note.end).length;
  const relieved = Math.min(sounding, e.field("overload"));
  clock += n * (cost.fine * (sounding - relieved) + cost.coarse * relieved);
  for (const {at, ms} of heldUp) if (frame <= at && at < frame + n) clock += ms;
  return sound;
};
for (let k = 0; k < quanta; k++, currentFrame += 128) {
  const began = clock, out = new Float32Array(128);
  for (const {key, begin, end} of notes) {
    if (begin >= currentFrame && begin < currentFrame + 128) p.hear({midi: [0x90, key, 100], frame: begin});
    if (end >= currentFrame && end < currentFrame + 128) p.hear({midi: [0x80, key, 0], frame: end});
  }
  p.process([], [[out]]);
  found.push([clock - began, e.field("overload")]);
}
Date.now = now;
return found;
"""
# Plays a song for some quanta without a bass; in each of `steers` a change comes before a quantum. Returns the messages
# that reach the synth, with their frames, and whether the song has ended
PLAY = """
const [song, quanta, steers] = arguments, sent = [], told = [];
globalThis.sampleRate = 48000;
globalThis.currentFrame = 0;
const p = new Processor({processorOptions: {module}});
p.port.postMessage = message => told.push(message);
p.engine.send = (...message) => sent.push(message);
p.process([], [[new Float32Array(128)]]);
p.hear({song: {...song, messages: Int32Array.from(song.messages.flat())}});
for (let k = 0; k < quanta; k++) {
  for (const [at, steer] of steers) if (at === k) p.hear({steer});
  p.process([], [[new Float32Array(128)]]);
}
return [sent, told.some(({songEnded}) => songEnded)];
"""
WHOLE = 48_000 // QUANTUM * QUANTUM  # frames of the songs below


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[node.Page]:
    with node.page({"jazz-finger": load_preset("jazz-finger")}, tmp_path_factory.mktemp("page")) as page:
        yield page


def audio_thread(
    page: node.Page,
    notes: list[tuple[int, float, float]],
    seconds: float,
    cost: dict[str, float],
    held_up: Sequence[tuple[float, float]] = (),
) -> Floats:
    """The time (ms) of every quantum, and the relieved strings after it, on a machine of known speed.

    `notes` are keys, with start and end (s); `cost` are the loads of a "fine" and a "coarse" string; `held_up` gives
    the moments (s) of the machine's own delays, and their length (ms).
    """
    given = [{"key": key, "begin": round(RATE * begin), "end": round(RATE * end)} for key, begin, end in notes]
    times = [{"at": round(RATE * at), "ms": ms} for at, ms in held_up]
    costs = {name: 1000 / RATE * load for name, load in cost.items()}
    return np.array(page.run(RUN, given, round(RATE * seconds) // QUANTUM, costs, times), float)


def test_hard_chords_are_relieved_at_once_and_stay_so_until_the_playing_is_soft(page: node.Page) -> None:
    chords = [(key, begin + 0.01 * k, begin + 1.0) for begin in (0.1, 3.6) for k, key in enumerate((28, 33, 38, 43))]
    found = audio_thread(page, chords, 20.0, {"fine": 4.0, "coarse": 0.15})
    late, relieved = found[:, 0] > 1000 * QUANTUM / RATE, found[:, 1]
    first, second = (slice(round(RATE * at) // QUANTUM, round(RATE * (at + 1.0)) // QUANTUM) for at in (0.1, 3.6))
    assert late.any() and relieved.max() == 4 and relieved[-1] == 0
    behind = (found[first, 0] - 1000 * QUANTUM / RATE).clip(0).sum()
    assert behind < 40  # ms; 200 if everything waited for a report of 43 ms each
    assert not late[second].any() and (relieved[second] == 4).all()


def test_a_thread_that_is_held_up_once_relieves_one_string(page: node.Page) -> None:
    chord = [(key, 0.1, 1.0) for key in (28, 33)]
    cheap = {"fine": 0.05, "coarse": 0.05}
    assert audio_thread(page, chord, 1.0, cheap, held_up=[(0.3, 30)])[:, 1].max() == 1
    assert audio_thread(page, chord, 1.0, cheap, held_up=[(0.3, 30), (0.35, 30)])[:, 1].max() == 2


def song_of(rng: random.Random, count: int) -> list[list[int]]:
    """The messages of notes, one after another, and of a controller before each."""
    begins = sorted(rng.sample(range(WHOLE), count))
    rows = []
    for begin, end in pairwise([*begins, WHOLE]):
        key, off = rng.randint(30, 60), rng.randint(begin + 1, end)
        rows += [[begin, 0xB0, 1, rng.randint(0, 127)], [begin, 0x90, key, 100], [off, 0x80, key, 64]]
    return sorted(rows, key=lambda row: row[0])


def test_each_message_of_a_song_comes_at_its_frame(page: node.Page) -> None:
    """From any place on, at any tempo; then the song has ended."""
    rng = random.Random(1)
    for _ in range(30):
        rows, begin, tempo = song_of(rng, 20), 1000, rng.choice([0.25, 0.5, 1.0, 1.25])
        at = rng.choice([0, rng.randrange(WHOLE)])
        song = {"messages": rows, "begin": 0, "end": WHOLE, "loops": False, "tempo": tempo, "from": begin, "at": at}
        sent, ended = page.run(PLAY, song, round(WHOLE / tempo) // QUANTUM + 20, [])
        controllers = [row[1:] for row in rows if row[0] < at and row[1] == 0xB0]
        before = [[begin, *controllers[-1]]] if controllers else []
        later = [[round(begin + (row[0] - at) / tempo), *row[1:]] for row in rows if row[0] >= at]
        assert ended and len(sent) == len(before + later)
        for found, wanted in zip(sent, before + later, strict=True):
            assert found[1:] == wanted[1:] and abs(found[0] - wanted[0]) <= 1, "Python rounds halves to even numbers"


def test_a_loop_repeats_its_part_and_leaves_no_note(page: node.Page) -> None:
    rng = random.Random(2)
    for _ in range(30):
        rows, (begin, end) = song_of(rng, 20), sorted(rng.sample(range(0, WHOLE, QUANTUM), 2))
        song = {"messages": rows, "begin": begin, "end": end, "loops": True, "tempo": 1.0, "from": 1000, "at": begin}
        sent, ended = page.run(PLAY, song, 4 * (end - begin) // QUANTUM + 10, [])
        times = [[frame - 1000, *rest] for frame, *rest in sent if rest[0] == 0x90]
        part = [[row[0] - begin, *row[1:]] for row in rows if begin <= row[0] < end and row[1] == 0x90]
        wanted = [[frame + k * (end - begin), *rest] for k in range(4) for frame, *rest in part]
        assert times[: len(wanted)] == wanted and not ended
        held: set[int] = set()
        for k, (frame, status, key, _) in enumerate(sent):
            held = held | {key} if status == 0x90 else held - {key} if status == 0x80 else held
            if k + 1 < len(sent) and (frame - 1000) // (end - begin) < (sent[k + 1][0] - 1000) // (end - begin):
                assert not held - {key for at, status, key, _ in sent if status == 0x80 and at == sent[k + 1][0]}


def test_a_song_goes_on_from_where_it_is_steered(page: node.Page) -> None:
    """To another place, whose controllers come first; at another tempo."""
    rows = [[k * 4800, *rest] for k in range(10) for rest in ([0xB0, 1, 10 + k], [0x90, 40 + k, 100])]
    rows += [[k * 4800 + 2400, 0x80, 40 + k, 64] for k in range(10)]
    song = {"messages": sorted(rows), "begin": 0, "end": WHOLE, "loops": False, "tempo": 1.0, "from": 0, "at": 0}
    jump = 50  # quanta; the second note sounds
    sent, _ = page.run(PLAY, song, 500, [[jump, {"at": 7 * 4800 + 100}]])
    now = (jump + 1) * QUANTUM
    after = [message for message in sent if message[0] >= now]
    assert after[:2] == [[now, 0x80, 41, 64], [now, 0xB0, 1, 17]] and after[2][1:] == [0x80, 47, 64]
    assert [message for message in after if message[1] == 0x90] == [
        [now + 4700, 0x90, 48, 100], [now + 9500, 0x90, 49, 100]
    ]  # fmt: skip
    sent, _ = page.run(PLAY, song, 500, [[jump, {"tempo": 0.5}]])
    assert [frame for frame, status, *_ in sent if status == 0x90][:4] == [
        QUANTUM, 4800, now + 2 * (9600 - now), now + 2 * (14400 - now)
    ]  # fmt: skip


# Builds versions of a bass in turn, each while the one before still sounds; returns their places
IN_TURN = """
const places = [];
let before;
for (const action of arguments[0]) {
  const built = ask({name: "jazz-finger", file: fileOf("jazz-finger", {action}), tier: 0, rate: 48000});
  places.push(built.at);
  if (before) onmessage({data: {free: before}});
  before = built.bass;
}
onmessage({data: {free: before}});
return places;
"""


def test_versions_of_a_bass_take_turns_in_two_rooms(page: node.Page) -> None:
    """On a lower neck a bass may be larger, as strings lie on its frets: moves of a slider take no new memory."""
    places = page.run(IN_TURN, [0, -0.8, 0.5, -0.4, 0, -1.2])
    assert places == places[:2] * 3 and len(set(places)) == 2
