"""The worst case for a bass: a script of messages, and the times of the blocks that play it.

A `FakeDevice` requests the blocks from the native callback, one after the other without a pause. The synth's own meter
inside the callback takes the times, without Python's work between blocks. A message is sent just before its block, as
from a keyboard. The synth is not adaptive, so no block has coarse strings. The player is even, so runs are almost
equal; strings that run ahead of the clock make small differences.
"""

import gc
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.live.fake import FakeDevice
from livebass.live.synth import LiveBass, Synth
from livebass.model.instrument import Instrument
from livebass.model.keymap import MODO
from livebass.model.quality import Quality
from livebass.rows.parts import SILENT

NOTE_ON, NOTE_OFF, CONTROL, ALL_SOUND_OFF = 0x90, 0x80, 0xB0, 120  # status bytes of channel 1, and a controller
POPPED = (0.0, 0.5)  # s, all open strings at velocity 127 at once; they still sound at the second
LINE_FROM = 1.0  # s
SIXTEENTH = 60 / 110 / 4  # s
# Fret and velocity of each round over the strings. No step up is a fourth or two: the next string would still play that
# note from the old fret, and lose it.
ROUNDS = ((0, 127), (3, 100), (7, 127), (2, 115))
# One hand technique after the other on every string: a controller and its value, then the frets and velocities played.
# Here too no step up is a fourth or two.
HANDS = ((0, 0, ((0, 127),)), (68, 127, ((7, 127),)), (65, 127, ((13, 127),)), (65, 0, ((0, 127),)))
HAND_NAMES = ("plucked open again", "hammered on", "slid", "pulled off")
HANDS_APART = 0.15  # s
LINE = len(ROUNDS) * 4 * SIXTEENTH  # s of sixteenths
STRING_KEYS = {pitch_class: key for key, technique, pitch_class in MODO.keys if technique == "string"}
REST = 0.3  # s of silence after each run


def even(bass: Instrument) -> Instrument:
    """Returns `bass` with a player whose strokes are all alike, and without noise, which would hide differences."""
    alike: dict[str, Any] = {**SILENT, "unevenness": 0.0, "release_spread": 0.0, "squeak": bass.player.squeak}
    return replace(bass, player=replace(bass.player, **alike))


@dataclass(frozen=True)
class Script:
    """Messages for a `FakeDevice`, ordered by frame, from frame 0."""

    rate: int  # Hz
    messages: tuple[tuple[int, int, int, int], ...]  # frame, status, first and second data byte
    popped: int  # frames before the line begins
    hands: int  # frames before the hands begin
    frames: int


def worst_case(bass: Instrument, rate: int, strings: int, line: float = LINE) -> Script:
    """Pops the first `strings` strings of `bass` at once, twice, then plays `line` s of sixteenths over them.

    At the end all are, at once, plucked open from the frets they sound at, hammered on, slid up and pulled off.
    """
    keys = [string.open_note for string in bass.strings[:strings]]
    messages = [(round(beat * rate), NOTE_ON, key, 127) for beat in POPPED for key in keys]
    playing = list(keys)
    count = int(line / SIXTEENTH + 1e-9)
    for k in range(count):
        frame, i = round((LINE_FROM + k * SIXTEENTH) * rate), k % strings
        fret, velocity = ROUNDS[k // strings % len(ROUNDS)]
        messages.append((frame, NOTE_OFF, playing[i], 0))
        playing[i] = keys[i] + fret
        messages.append((frame, NOTE_ON, playing[i], velocity))
    hands = LINE_FROM + count * SIXTEENTH
    after = hands
    for control, value, notes in HANDS:
        frame = round(after * rate)
        messages += [(frame, CONTROL, control, value)] if control else []
        for string, key in zip(bass.strings, keys, strict=False):
            messages += [(frame, NOTE_ON, STRING_KEYS[string.called], 100)]
            messages += [(frame, NOTE_ON, key + fret, velocity) for fret, velocity in notes]
            messages += [(frame, NOTE_OFF, STRING_KEYS[string.called], 0)]
        after += HANDS_APART
    messages += [(round(after * rate), CONTROL, control, 0) for control in (65, 68)]
    return Script(
        rate, tuple(messages), round(LINE_FROM * rate), round(hands * rate), round((after + HANDS_APART) * rate)
    )


def hand_blocks(script: Script, k: int, block: int) -> slice:
    """Returns the slice of blocks of `block` frames that play the hand HANDS[k]."""
    begin, end = (script.hands + round((k + i) * HANDS_APART * script.rate) for i in range(2))
    return slice(begin // block, -(-end // block))


def play_script(device: FakeDevice, script: Script, block: int) -> NDArray[np.int64]:
    """Plays `script` in blocks of `block` frames; returns the time of each, ns. After `silence`, runs are alike."""
    synth, messages = device.synth, script.messages
    metered, busy, begin = bool(synth.record["clock"][0]), synth.record["busy"], synth.frame
    times, out = np.zeros(-(-script.frames // block), np.int64), np.zeros(block, np.float32)
    sent, collected = 0, gc.isenabled()
    gc.disable()
    try:
        for k in range(len(times)):
            end = (k + 1) * block
            while sent < len(messages) and messages[sent][0] < end:
                frame, status, first, second = messages[sent]
                synth.send(status, first, second, begin + frame)
                sent += 1
            began = time.perf_counter_ns()
            device.fill(out)
            times[k] = busy[0] if metered else time.perf_counter_ns() - began
    finally:
        if collected:
            gc.enable()
    return times


def silence(device: FakeDevice, block: int) -> None:
    """Ends all sound and waits for silence, in blocks of `block` frames."""
    device.synth.send(CONTROL, ALL_SOUND_OFF, 0)
    for _ in range(-(-round(REST * device.synth.rate) // block)):
        device.block(block)


def block_times(
    bass: Instrument, quality: Quality, block: int, script: Script, runs: int, cores: int = 1
) -> NDArray[np.int64]:
    """Returns the times of the blocks of `script`, (runs, blocks), ns; an extra first run is not counted."""
    synth = Synth(script.rate, adaptive=False)
    synth.switch_to(LiveBass(bass, quality, script.rate))
    device = FakeDevice(synth)
    synth.start_helpers(cores - 1)
    try:
        play_script(device, replace(script, frames=script.popped), block)
        times = []
        for _ in range(runs):
            silence(device, block)
            times.append(play_script(device, script, block))
    finally:
        synth.stop_helpers()
    return np.array(times)
