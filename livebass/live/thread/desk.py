"""Plays a score, JACK's transport, learned controllers and a metronome beside the synth. [audio thread]

The callbacks do so before and after the synth plays a block, on one record, DESK. Python writes its requests into
single words of the record, which are read once per block, and reads the score's progress there.
"""

from typing import Any

import numpy as np

from livebass.compiling import SMALL, entry, jit
from livebass.kernels.bass.records import bass_at
from livebass.kernels.machine.native import (
    load_acquire,
    record_address,
    record_at,
    samples_at,
    status_from,
    store_release,
    words_at,
)
from livebass.kernels.player import controls
from livebass.kernels.player.constants import CONTROLLERS, KEYS
from livebass.kernels.player.parameters import value_at
from livebass.kernels.player.performer import CHANNELS, IN_TUNE, MAX_STRINGS, NO_RPN
from livebass.kernels.player.words import KIND_BIT, STRING, STRING_REST, field, kind_of, plays_strings, unpack
from livebass.kernels.score.sorting import count_below
from livebass.live.thread.records import field_offset, performer_of, synth_at
from livebass.live.thread.ring import WORD, push_learned, push_midi, push_whole
from livebass.rows.techniques import CHANNEL_MODES, PARAMETERS, RESERVED

WHEEL = CONTROLLERS  # index of the pitch bend after the controllers
SETTINGS = (*RESERVED, 126, 127)  # controllers that change what channels mean, or come in sequences
SCORE_RING = 1
CHASED = 1024  # messages before a place that are searched for controllers
MISSED = 0.1  # s that JACK's transport may advance while this client misses periods; their notes are then played late
MAX_TURNS = 8  # of a loop in one block
ELSEWHERE = -1
BEAT = 0xF8  # status of a score's message that is no MIDI: a beat, whose first byte is 1 if a bar begins
BY_SCORE = 1e15  # period of a metronome that clicks at these
WEAK = 0.5  # level of a click within a bar
ROLLING = 1  # JACK's state of a moving transport
POSITION_WORDS = 32  # more than a jack_position_t has; its word 2 is the rate, with the frame in the upper half
POSITION_FRAME = 2

DESK = np.dtype(
    [
        # the score
        ("rate", "f8"),  # frame rate, Hz
        ("frames", "i8"),  # address: int64 (count,), ascending
        ("words", "i8"),  # address: int64 (count,), messages and events (kernels/player/words.py)
        ("count", "i8"),
        ("next", "i8"),  # first unplayed message
        ("position", "f8"),  # score frame at the start of the next block; below 0 before the score begins
        ("anchor", "f8"),  # score frame ...
        ("anchor_frame", "i8"),  # ... at this synth frame: since then neither tempo nor place has changed
        ("step", "f8"),  # score frames per synth frame
        ("due", "i8"),  # expected synth frame of the next block; ELSEWHERE: place or tempo changed
        ("speed", "f8"),  # 1: as written
        ("rolling", "i8"),  # 0: Python wants it to stand still
        ("running", "i8"),  # it moved in the last block
        ("seek", "i8"),  # frame to go to ...
        ("seek_count", "i8"),  # ... whenever Python raises this ...
        ("seek_seen", "i8"),  # ... above the last value seen
        ("loop_from", "f8"),  # frames; the loop ends before loop_to
        ("loop_to", "f8"),  # 0: no loop
        ("once", "i8"),  # 1: it stops at loop_to, and goes to loop_from
        ("held", "i8", (CHANNELS, KEYS)),  # 1 for notes of the score that have not ended
        ("moved_strings", "i8"),  # that strokes of the score may have left sounding or bent, a bit each
        ("pedal", "i8", (CHANNELS,)),  # 1 if the score holds it down
        ("bent", "i8", (CHANNELS,)),  # 1 if the score has left the channel's pitch wheel off-centre
        ("met", "i8", (CHANNELS, CONTROLLERS + 1)),  # workspace
        ("programs", "i8"),  # address: int64 (count + 1,), the program before each message, and after all; -1: none
        ("program", "i8"),  # the synth's latest program
        ("settings", "i8"),  # address: int64 (setting_count,), the messages whose order matters: see `is_chased`
        ("setting_count", "i8"),
        ("received", "i8"),  # number of settings that the synth has received
        # JACK's transport
        ("client", "i8"),  # address, 0: not followed
        ("transport_query", "i8"),  # address of the C function
        ("transport", "i8", (POSITION_WORDS,)),  # room for a jack_position_t
        # MIDI learn
        ("learned", "i8", (CONTROLLERS,)),  # by controller: 1 + the number of its parameter; 0: none
        ("moved", "i8"),  # controller and value of the last move, and the number of moves: see MOVED_BITS
        # the metronome
        ("click", "i8"),  # address: float32 (click_frames,)
        ("click_frames", "i8"),
        ("click_period", "f8"),  # frames; 0: none; BY_SCORE: at the score's BEATs
        ("click_start", "i8"),  # synth frame of a click
        ("click_level", "f8"),
    ],
    align=True,
)
MOVED_BITS = 8  # for each, the value lowest
COUNT, SEEK_COUNT, TRANSPORT = (field_offset(DESK, name) for name in ("count", "seek_count", "transport"))
desk_at = record_at(DESK)


@entry("void(int64, int64, int64, int64, int64, int64, float64)", SMALL)
def load_desk(address, frames, words, count, room, program, rate):
    """Gives the DESK at `address`, which has none, a score: `count` words with their `frames` of `rate` Hz.

    All but `program`, from 0, which plays first (-1: none), are addresses of int64, which the desk keeps: `frames` and
    `words`, (count,), and `room` for 2 * count + 1. [not the audio thread]
    """
    desk, messages = desk_at(address), words_at(words, count)
    programs, settings = words_at(room, count + 1), words_at(room + WORD * (count + 1), count)
    now: Any = np.int64(program)
    found: Any = np.int64(0)
    programs[0] = now
    for k in range(count):
        status, first, _ = unpack(messages[k])
        if status & 0xF0 == 0xC0:
            now = first
        if status & 0xF0 == 0xB0 and first in SETTINGS:
            settings[found] = k
            found += 1
        programs[k + 1] = now
    desk.frames, desk.words, desk.rate = frames, words, rate
    desk.programs, desk.program = room, program
    desk.settings, desk.setting_count = room + WORD * (count + 1), found
    store_release(address + COUNT, count)


@jit
def note_controller(desk, address, size, frame, channel, controller, value):
    """Records a controller's move. If the controller is learned, moves its parameter at `frame`, through the ring.

    Returns True then: the message is not for the bass. [writing thread of the ring]
    """
    count = (desk.moved >> (2 * MOVED_BITS)) + 1
    desk.moved = count << (2 * MOVED_BITS) | controller << MOVED_BITS | value
    number = desk.learned[controller] - 1
    if number < 0 or number >= PARAMETERS:
        return False
    push_learned(address, size, frame, number, value_at(number, value), channel, value)
    return True


@entry("int64(int64, int64, int64, int64, int64, int64, int64)")
def take_controller(desk, address, size, frame, channel, controller, value):
    """C function: `note_controller` for the address of a DESK; returns 1 or 0."""
    return np.int64(note_controller(desk_at(desk), address, size, frame, channel, controller, value))


@jit
def send_message(synth, frame, status, first, second):
    """Sends a score message at `frame`."""
    push_midi(synth.midi_ring[SCORE_RING], synth.midi_ring_size[SCORE_RING], frame, status, first, second)


@jit
def release_score(desk, synth, frame):
    """Ends the score's held notes, pedals and bends, and its strokes. The player's stay."""
    for i in range(MAX_STRINGS):
        if (desk.moved_strings >> i) & 1:
            push_whole(
                synth.midi_ring[SCORE_RING], synth.midi_ring_size[SCORE_RING], frame,
                i | np.int64(STRING_REST) << KIND_BIT,
            )  # fmt: skip
    desk.moved_strings = 0
    for channel in range(CHANNELS):
        for key in range(KEYS):
            if desk.held[channel, key]:
                desk.held[channel, key] = 0
                send_message(synth, frame, 0x80 | np.int64(channel), np.int64(key), np.int64(0))
    for channel in range(CHANNELS):
        if desk.pedal[channel]:
            desk.pedal[channel] = 0
            send_message(synth, frame, 0xB0 | np.int64(channel), np.int64(controls.PEDAL), np.int64(0))
    for channel in range(CHANNELS):
        if desk.bent[channel]:
            desk.bent[channel] = 0
            send_message(synth, frame, 0xE0 | np.int64(channel), np.int64(0), np.int64(64))


@jit
def note_message(desk, status, first, second):
    """Tracks held notes, pedals, bends and the program."""
    kind, channel = status & 0xF0, status & 0x0F
    if kind == 0x90 or kind == 0x80:
        desk.held[channel, first] = 1 if kind == 0x90 and second > 0 else 0
    elif kind == 0xB0 and first == controls.PEDAL:
        desk.pedal[channel] = 1 if second >= 64 else 0
    elif kind == 0xC0:
        desk.program = first
    elif kind == 0xE0:
        desk.bent[channel] = 0 if first == 0 and second == 64 else 1


@jit
def is_chased(controller):
    """True for a controller whose last value alone counts, unlike RPNs, which are sequences, and channel modes."""
    return controller < CHANNEL_MODES and controller != 6 and controller != 38 and not 96 <= controller <= 101


@jit
def send_settings(desk, synth, low, frame):
    """Sends RPNs and modes (`settings`) until the synth has all before message `low`.

    Going back, it first clears channel meanings, ranges and tunings, then restarts with the first setting.
    """
    words, settings = words_at(desk.words, desk.count), words_at(desk.settings, desk.setting_count)
    wanted: Any = np.int64(0)
    while wanted < desk.setting_count and settings[wanted] < low:
        wanted += 1
    if wanted < desk.received:
        send_message(synth, frame, np.int64(0xB0), np.int64(127), np.int64(0))
        reset_settings(desk, synth, frame)
        desk.received = 0
    for k in range(max(desk.received, wanted - CHASED), wanted):
        push_whole(synth.midi_ring[SCORE_RING], synth.midi_ring_size[SCORE_RING], frame, words[settings[k]])
    desk.received = wanted


@jit
def reset_settings(desk, synth, frame):
    """Resets the ranges and tunings that the score has set to the channels' usual values."""
    words, settings = words_at(desk.words, desk.count), words_at(desk.settings, desk.setting_count)
    for channel in range(CHANNELS):
        rpn: Any = np.int64(NO_RPN)
        received: Any = np.int64(0)  # RPNs, a bit each
        for k in range(max(desk.received - CHASED, np.int64(0)), desk.received):
            status, number, value = unpack(words[settings[k]])
            if status != 0xB0 | channel:
                continue
            if number in (controls.DATA, controls.DATA_FINE):
                received |= 1 << rpn if rpn <= controls.COARSE_RPN else 0
            else:
                rpn = controls.rpn_with(rpn, number, value)
        if (received >> controls.BEND_RANGE_RPN) & 1:
            semitones = default_range(synth)
            fine = np.int64(np.rint(100.0 * (semitones - np.floor(semitones))))
            send_rpn(synth, frame, np.int64(channel), np.int64(controls.BEND_RANGE_RPN), np.int64(semitones), fine)
        if (received >> controls.FINE_RPN) & 1:
            send_rpn(synth, frame, np.int64(channel), np.int64(controls.FINE_RPN), np.int64(IN_TUNE >> 7), np.int64(0))
        if (received >> controls.COARSE_RPN) & 1:
            middle = np.int64(controls.COARSE_MIDDLE)
            send_rpn(synth, frame, np.int64(channel), np.int64(controls.COARSE_RPN), middle, np.int64(0))


@jit
def default_range(synth):
    """The wheel range, semitones, unless a controller has set another."""
    return performer_of(bass_at(synth.bass)).ranged if synth.bass != 0 else 2.0


@jit
def send_rpn(synth, frame, channel, rpn, whole, fine):
    """Sets a channel's registered parameter, then deselects it."""
    status = 0xB0 | channel
    send_message(synth, frame, status, np.int64(controls.RPN), np.int64(0))
    send_message(synth, frame, status, np.int64(controls.RPN_FINE), rpn)
    send_message(synth, frame, status, np.int64(controls.DATA), whole)
    send_message(synth, frame, status, np.int64(controls.DATA_FINE), fine)
    send_message(synth, frame, status, np.int64(controls.RPN), np.int64(NO_RPN >> 7))
    send_message(synth, frame, status, np.int64(controls.RPN_FINE), np.int64(NO_RPN & 127))


@jit
def go_to(desk, synth, place, frame):
    """Goes to a place of the score, in its frames: ends held notes and sets everything else to its value there.

    That is program, modes and bend ranges, and the last value of each channel's controllers and wheel.
    """
    release_score(desk, synth, frame)
    frames, words = words_at(desk.frames, desk.count), words_at(desk.words, desk.count)
    low = count_below(frames, desk.count, place)
    desk.next = low
    desk.position = place
    desk.due = ELSEWHERE
    program = words_at(desk.programs, desk.count + 1)[low]
    if program >= 0 and program != desk.program:
        desk.program = program
        send_message(synth, frame, np.int64(0xC0), program, np.int64(0))
    send_settings(desk, synth, low, frame)
    desk.met[:] = 0
    begin = max(low - CHASED, np.int64(0))
    for again in range(2):  # finds the last of each, then sends them in order
        for k in range(begin, low):
            status, first, second = unpack(words[k])
            kind, channel = status & 0xF0, status & 0x0F
            slot = first if kind == 0xB0 else np.int64(WHEEL)
            if kind != 0xE0 and not (kind == 0xB0 and is_chased(first)):
                continue
            if again == 0:
                desk.met[channel, slot] = k + 1
            elif desk.met[channel, slot] == k + 1:
                note_message(desk, status, first, second)
                send_message(synth, frame, status, first, second)


@jit
def follow_transport(desk, synth, step):
    """Follows JACK's transport; returns True if it rolls."""
    room = record_address(desk) + TRANSPORT
    rolling = status_from(desk.transport_query, desk.client, room, np.int64(0)) == ROLLING  # it takes two arguments
    there = ((desk.transport[POSITION_FRAME] >> 32) & 0xFFFFFFFF) * step
    gap = there - desk.position
    if gap < -step or gap > MISSED * desk.rate:
        go_to(desk, synth, there, synth.frame)
    elif abs(gap) > 0.5 * step:
        desk.position = there
        desk.due = ELSEWHERE
    return rolling


@jit
def set_anchor(desk, place, frame):
    """Anchors the score's `place` at the synth's `frame`: its other frames follow from this, for any block sizes."""
    desk.anchor = place
    desk.anchor_frame = frame


@jit
def play_score(desk, synth, n):
    """Sends the score's messages for the next n frames while it rolls: by itself, or with JACK's transport."""
    if desk.count == 0:
        return
    step = desk.speed * desk.rate / synth.rate
    rolling = desk.rolling != 0
    requested = load_acquire(record_address(desk) + SEEK_COUNT)
    if requested != desk.seek_seen:
        desk.seek_seen = requested
        go_to(desk, synth, np.float64(desk.seek), synth.frame)
    if desk.client != 0:
        rolling = follow_transport(desk, synth, step)
    if not rolling:
        if desk.running:
            release_score(desk, synth, synth.frame)
        desk.running = 0
        desk.due = ELSEWHERE
        return
    if desk.due != synth.frame or desk.step != step:
        set_anchor(desk, desk.position, synth.frame)
    desk.running = 1
    desk.step = step
    desk.due = synth.frame + n
    for _ in range(MAX_TURNS):
        turn = desk.anchor_frame + np.int64(np.ceil((desk.loop_to - desk.anchor) / step))
        if desk.loop_to <= desk.loop_from or desk.position > desk.loop_to or turn >= desk.due:
            break
        play_until(desk, synth, turn, desk.loop_to)
        place = desk.loop_from + (turn - desk.anchor_frame) * step + desk.anchor - desk.loop_to
        go_to(desk, synth, desk.loop_from, turn)
        if desk.once:
            desk.rolling = 0
            desk.running = 0
            return
        desk.due = synth.frame + n
        set_anchor(desk, place, turn)
    play_until(desk, synth, desk.due, np.inf)
    desk.position = desk.anchor + (desk.due - desk.anchor_frame) * step


@entry("void(int64, int64, int64)", SMALL)
def play_desk(address, synth, n):
    """C function: `play_score` for the addresses of a DESK and a SYNTH."""
    play_score(desk_at(address), synth_at(synth), n)


@jit
def play_until(desk, synth, until, end):
    """Sends the messages before the synth's frame `until` and the score's frame `end`."""
    frames, words = words_at(desk.frames, desk.count), words_at(desk.words, desk.count)
    while desk.next < desk.count and frames[desk.next] < end:
        k = desk.next
        frame = desk.anchor_frame + np.int64(np.floor((frames[k] - desk.anchor) / desk.step))
        if frame >= until:
            return
        status, first, second = unpack(words[k])
        frame = max(frame, desk.anchor_frame, synth.frame)
        if status == BEAT:
            if desk.click_period == BY_SCORE:
                desk.click_start = frame
                desk.click_level = 1.0 if first != 0 else WEAK
            desk.next = k + 1
            continue
        if not push_whole(synth.midi_ring[SCORE_RING], synth.midi_ring_size[SCORE_RING], frame, words[k]):
            return  # in the next block
        if plays_strings(kind_of(words[k])):
            desk.moved_strings |= 1 << field(words[k], STRING)
        else:
            note_message(desk, status, first, second)
        if desk.received < desk.setting_count and words_at(desk.settings, desk.setting_count)[desk.received] == k:
            desk.received += 1
        desk.next = k + 1


@jit
def add_clicks(desk, first, out, n):
    """Adds the metronome to n frames of sound from synth frame `first` on."""
    period = desk.click_period
    if not period > 1.0:
        return
    click = samples_at(desk.click, desk.click_frames)
    beat = max(np.int64(np.floor((first - desk.click_start - desk.click_frames) / period)), np.int64(0))
    while True:
        begin = desk.click_start + np.int64(np.ceil(beat * period)) - first
        if begin >= n:
            return
        for j in range(max(begin, np.int64(0)), min(begin + desk.click_frames, n)):
            out[j] += desk.click_level * click[j - begin]
        beat += 1
