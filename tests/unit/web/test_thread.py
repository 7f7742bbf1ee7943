"""The page's audio thread, in node and on a clock of the tests: how it relieves strings if it falls behind."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest
from support import node
from support.wasm import QUANTUM, RATE

from livebass import load_preset
from livebass.arrays import Floats

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
