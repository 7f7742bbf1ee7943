"""SYNTH, the record that the audio thread and Python share, and access to the parts of its basses.

A SYNTH plays; a BASS (kernels/bass/records.py) is one prepared instrument in it. Compiled code uses the functions here
to turn an address into a record or an array, and then reads fields.
"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.bass.records import ANSWER_ROWS, EVENT_ROOM, SOUND_RING, VOICE_WORDS, WORD, ahead_at
from livebass.kernels.effects.records import KNOBS, effects_at
from livebass.kernels.machine.native import floats_at, record_at, records_at, words_at
from livebass.kernels.player.performer import CHANNELS, MAX_STRINGS, PERFORMER
from livebass.kernels.string.records import EVENT, MAX_ANSWERS, OPERATOR, SLOT_STATE, STRING, VOICE_SLOTS
from livebass.rows.techniques import PARAMETERS

RINGS = 3  # of messages: from Python's threads, the score, and JACK's MIDI ports
MAX_MESSAGES = 256  # per chunk, if their events fit; the others wait for the next
CHUNK = 1024  # frames computed at once, at most
HISTOGRAM = 64
MAX_HELPERS = MAX_STRINGS - 1
RINGING = -1  # instead of the frames left in a fade-out

# Running ahead of the clock
HORIZON = 768  # frames
SAVE_EVERY = 16  # frames between saved states, whole strides
assert CHUNK + HORIZON < SOUND_RING

# Strings that the audio thread and its helpers play in parallel (helpers.py)
TEAM = np.dtype(
    [
        ("before", "i8", (8,)),  # keeps other threads' words on other cache lines
        ("job", "i8"),  # strings not yet taken, a bit each, below the job's number
        ("done", "i8"),  # strings of this job that helpers have played
        ("bass", "i8"),  # address
        ("end", "i8"),  # the bass's frame to play to
        ("helpers", "i8"),  # threads that help now; 0, and no pool: the audio thread plays all strings
        ("stop", "i8"),  # raised by Python: helpers end
        ("helped", "i8"),  # strings that helpers have played, in all jobs
        ("pool", "i8"),  # address of a C function (owner, count) that makes a host's threads call help_now; 0: none
        ("owner", "i8"),  # its argument
        ("after", "i8", (8,)),
    ],
    align=True,
)

SYNTH = np.dtype(
    [
        ("process", "i8"),  # address of the C function block.process
        ("rate", "f8"),  # Hz
        ("frame", "i8"),  # the next to compute
        ("clock", "i8"),  # address of clock_gettime, 0: none
        ("clock_id", "i8"),  # of the time
        ("work_clock_id", "i8"),  # of the load: may count the thread's own time alone
        ("block_time", "i8"),  # ns, when the last block began
        ("block_frame", "i8"),  # its first frame
        ("block_frames", "i8"),
        ("adaptive", "i8"),  # 1: overload moves strings to the coarse operators
        # basses, as addresses of BASS
        ("bass", "i8"),  # playing, 0: none
        ("next_bass", "i8"),  # set by Python; taken at the start of a block
        ("old_bass", "i8"),  # was replaced and rings out; starts no notes
        ("faded_bass", "i8"),  # is silent or has faded out: Python may free it, and writes 0
        ("fade_left", "i8"),  # frames left of the old bass's fade-out; RINGING: it rings as long as its strings do ...
        ("fade_frames", "i8"),  # ... and of the whole fade-out
        ("carried", "i8"),  # 1: the old bass's notes go on in the present one, which fades in (carry.py)
        # rings
        ("midi_ring", "i8", (RINGS,)),  # addresses
        ("midi_ring_size", "i8", (RINGS,)),
        ("capture_ring", "i8"),  # address of the recorder's ring of sound, 0: not recording
        ("capture_size", "i8"),
        ("capture_lost", "i8"),  # frames
        ("played_ring", "i8"),  # address of the ring of played messages, 0: not recording them
        ("played_size", "i8"),
        ("played_lost", "i8"),  # messages
        # state of MIDI
        ("channel", "i8"),  # MIDI ports' channel, 0-15; -1: all
        ("banks", "i8", (CHANNELS,)),  # 1 + each channel's selected bank; 0: none
        ("program", "i8"),  # of the last program change that selects no drum kit, 0-127
        ("program_count", "i8"),
        ("panic", "i8"),  # raised by Python, lowered by the audio thread
        ("gain", "f8"),
        ("gain_target", "f8"),
        ("gains", "f8", (CHUNK,)),  # for the frames of this chunk ...
        ("gains_known", "i8"),  # ... number known so far
        ("fades", "f8", (CHUNK,)),  # levels of a bass that fades in or out, for these frames
        ("floor", "f8", (CHUNK,)),  # workspace: a bass's noise floor
        ("parameters", "f8", (PARAMETERS,)),  # as last set (player/parameters.py)
        ("apart", "i8", (MAX_STRINGS,)),  # address of float32, a block's frames, for each string's sound; 0: none
        ("ceiling", "f8"),  # samples beyond it are clipped: 1 if the sound goes to a device
        # meters
        ("blocks", "i8"),
        ("messages", "i8"),
        ("busy", "i8"),  # ns that the last block took, including running ahead
        ("load", "f8"),  # part of its time that the last block took, without running ahead
        ("load_worst", "f8"),  # since Python reset it
        ("late", "i8"),  # blocks that took longer than their duration
        ("underruns", "i8"),  # reported by the driver
        ("peak", "f8"),  # since Python reset it; 1 is full scale
        ("clipped", "i8"),  # frames beyond full scale
        ("faults", "i8"),  # frames of a string that were NaN or beyond 1e6, played as 0
        ("overload", "i8"),  # strings on coarse operators
        ("calm_frames", "i8"),  # since the load was last high
        ("histogram", "i8", (HISTOGRAM,)),  # blocks by load: bin 32 + 4 log2(load)
        ("team", TEAM),
        # effects
        ("effects", "f8", (KNOBS,)),  # their knobs as last set; 0: the bass's own ...
        ("knobs", "f8", (KNOBS, CHUNK)),  # ... and in the frames of this chunk ...
        ("knobs_known", "i8"),  # ... number known so far
        ("dry", "f4", (CHUNK,)),  # a bass's mix on its way through its effects
        ("before", "f4", (CHUNK,)),  # this chunk's sound before this bass
        ("heard", "f4", (CHUNK,)),  # 1 for frames of `dry` that an effect has changed, else 0
    ],
    align=True,
)


def field_offset(record: np.dtype, name: str) -> int:
    """Returns the offset of the field `name` in `record`, bytes, for atomic access."""
    return int(record.fields[name][1])  # type: ignore[index]


# Fields that one thread writes and another reads.
BLOCK_TIME, BLOCK_FRAME, BLOCK_FRAMES, NEXT_BASS, FADED_BASS, CAPTURE_RING, PLAYED_RING, PANIC = (
    field_offset(SYNTH, name)
    for name in (
        "block_time", "block_frame", "block_frames", "next_bass", "faded_bass", "capture_ring", "played_ring", "panic",
    )
)  # fmt: skip
KNOBS_PLACE = field_offset(SYNTH, "knobs")
TEAM_PLACE = field_offset(SYNTH, "team")
JOB, DONE, HELPERS, STOP, HELPED = (
    TEAM_PLACE + field_offset(TEAM, name) for name in ("job", "done", "helpers", "stop", "helped")
)


synth_at = record_at(SYNTH)
string_at = record_at(STRING)
performer_at = record_at(PERFORMER)
operators_at, events_at = records_at(OPERATOR, 2), records_at(EVENT)


@jit
def ahead_of(b, i):
    return ahead_at(b.ahead[i])


@jit
def string_of(b, i):
    return string_at(b.string[i])


@jit
def effects_of(b):
    return effects_at(b.effects)


@inlined
def operators_of(b, which):
    return operators_at(b.operators[which], b.strings, b.frets + 1)


@jit
def performer_of(b):
    return performer_at(b.performer)


@inlined
def events_of(b):
    return events_at(b.events, EVENT_ROOM)


@inlined
def string_events_of(b):
    return events_at(b.string_events, EVENT_ROOM)


@inlined
def sound_of(a):
    """The ring of sound, (SOUND_RING,)."""
    return floats_at(a.sound, SOUND_RING)


@inlined
def saved_voice(a, place):
    """Words of a saved VOICE, (VOICE_WORDS,)."""
    return words_at(a.voice + WORD * VOICE_WORDS * place, VOICE_WORDS)


@inlined
def saved_slot(a, place, k):
    """Words of slot `k`'s state in a saved string, (SLOT_STATE,)."""
    return words_at(a.slots + WORD * SLOT_STATE * (place * VOICE_SLOTS + k), SLOT_STATE)


@inlined
def saved_answers(a, place, which):
    """A saved string's answers: their lines (0), displacements (1) or the other half (2), (MAX_ANSWERS,)."""
    return floats_at(a.answers + WORD * MAX_ANSWERS * (ANSWER_ROWS * place + which), MAX_ANSWERS)


@inlined
def saved_motion(a, place, k, polarisation):
    """Address of slot `k`'s motion along u (0) or v (1) in a saved string."""
    return a.memory + (place * VOICE_SLOTS + k) * (a.kept_u + a.kept_v) + polarisation * a.kept_u
