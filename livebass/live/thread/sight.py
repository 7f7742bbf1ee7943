"""Data for drawing a bass: the amplitudes of each string's lowest modes, as they are between two blocks.

`see_bass` and `see_contact` only read. A slot has the shape u(x) = sqrt(2 / length) sum_j u[j - 1]
sin(j pi x / length) + stop (1 - x / length), m, x from its stop to the saddle, over the rest line from there; v has the
same form. Contacts and events come from kernels/string/reports.py. [audio thread]
"""

import numpy as np

from livebass.compiling import SMALL, entry, jit
from livebass.kernels.bass.records import bass_at
from livebass.kernels.hands.noise import is_pulling
from livebass.kernels.hands.pulling import pull_profile
from livebass.kernels.machine.native import record_at
from livebass.kernels.string import draped, glide, modal
from livebass.kernels.string.operators import place_of
from livebass.kernels.string.records import CONTACT, VOICE_SLOTS
from livebass.live.thread.records import operators_of, string_of

SEEN = 96  # modes at most: the paper's case B lacks 20 um at 5 ms, and less before

SLOT_SIGHT = np.dtype(
    [
        ("on", "i8"),  # 0 silent, 1 sounding
        ("fret", "i8"),
        ("lies", "i8"),  # the higher fret that the string lies on at rest; 0: none
        ("length", "f8"),  # m, from the stop to the saddle
        ("stop", "f8"),  # m, displacement of the string's end at its stop ...
        ("stop_across", "f8"),  # ... and across
        ("modes", "i8"),  # number of valid entries here:
        ("u", "f4", (SEEN,)),  # m^1.5
        ("v", "f4", (SEEN,)),
    ],
    align=True,
)
SIGHT = np.dtype(
    [
        ("frame", "i8"),  # of the bass, up to which this is seen; beyond the clock if strings run ahead
        ("pulling", "i8"),  # frames left until a finger lets go; its shape is included
        ("logged", "i8"),  # contacts so far
        ("slot", SLOT_SIGHT, (VOICE_SLOTS,)),
    ],
    align=True,
)
SIGHT_BYTES = SIGHT.itemsize
sight_at = record_at(SIGHT)
contact_at = record_at(CONTACT)


@entry("void(int64, int64)")
def see_bass(bass, sights):
    """Fills SIGHT (strings,) at the address `sights` from the BASS at an address."""
    b = bass_at(bass)
    for i in range(b.strings):
        see_string(string_of(b, i), operators_of(b, (b.coarse >> i) & 1)[i], sight_at(sights + SIGHT_BYTES * i))


@entry("float64(int64, int64, int64)", SMALL)
def see_contact(bass, i, contact):
    """Returns the place of the CONTACT at an address, on string `i` of the BASS at an address, as `place_of` does."""
    b = bass_at(bass)
    return place_of(contact_at(contact), operators_of(b, (b.coarse >> i) & 1)[i])


@jit
def see_string(string, ops, sight):
    """Fills a SIGHT from a STRING with the operators `ops`."""
    voice = string.voice
    sight.frame = voice.frame
    sight.pulling = voice.pulling
    sight.logged = voice.logged
    for k in range(VOICE_SLOTS):
        slot, seen = string.slots[k], sight.slot[k]
        seen.on = slot.on
        seen.modes = 0
        if not slot.on:
            continue
        op = glide.current_operator(string, ops, k)
        up = 0.0
        if k == voice.slot and is_pulling(voice):
            up, _ = pull_profile(voice, voice.pulling)
        n = min(op.modes, SEEN)
        seen.fret = slot.fret
        seen.lies = np.int64(0) if slot.between else draped.lies_on(slot, ops)
        seen.length = op.length
        seen.stop = slot.stop_u.place
        seen.stop_across = slot.stop_v.place
        seen.modes = n
        for j in range(n):
            seen.u[j] = amplitude_of(slot.u, j, slot.active, up)
            seen.v[j] = amplitude_of(slot.v, j, slot.v_active, up if slot.v_ready else 0.0)


@jit
def amplitude_of(w, j, active, up):
    """Amplitude of a polarisation's mode `j`, with `up` of the held shape; `active`: number of active modes."""
    x = 0.0
    if j < active:
        x, _ = modal.state_of(w, j)
    if up != 0.0:
        x += up * w.held[j]
    return x
