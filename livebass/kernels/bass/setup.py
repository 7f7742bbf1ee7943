"""Sets up a bass in the caller's memory: everything that playing needs is made here, nothing later.

`measure_bass` sets the bytes a bass needs. `fill_bass` makes the bass there, silent, and writes to every page so the
audio thread is not the first to touch it; calling it again resets the bass. Engine, synth, plugins and page all do
this. [any thread but the playing one]
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.bass import strings
from livebass.kernels.bass.floor import make_floor
from livebass.kernels.bass.instrument import (
    answers_of,
    clear_memory,
    file_at,
    lines,
    response_of,
    whole_steps,
)
from livebass.kernels.bass.records import (
    AHEAD,
    ANSWER_ROWS,
    BASS,
    EVENT_ROOM,
    SAVES,
    SOUND_RING,
    VOICE_WORDS,
    WORD,
    ahead_at,
    bass_at,
    saved_bytes,
)
from livebass.kernels.effects.chain import bytes_of_effects, make_effects, take_amp
from livebass.kernels.machine.native import record_at, records_at
from livebass.kernels.pickup.coil import COIL
from livebass.kernels.pickup.tone import ROW, TONES, fit_tones
from livebass.kernels.player.performer import PERFORMER, performer_at
from livebass.kernels.string.answers import fill_answers as connect_answers
from livebass.kernels.string.glide import BETWEEN_BYTES
from livebass.kernels.string.records import (
    CONTACT,
    EVENT,
    MAX_ANSWERS,
    MAX_NEAR,
    OPERATOR,
    SLOT_STATE,
    STRING,
    VOICE_SLOTS,
)
from livebass.kernels.string.reports import REPORTS_BYTES
from livebass.rows.units import OFF

jit = compiled(attributes=SMALL)

# Running ahead: share of a block's time if contact ends soon, share if it does not, and frames between looks at the
# clock. Contact with lossy frets ends soon and leaves most of the time to other programs; other contact comes in
# bursts, and a heavy quality's bursts need all the time there is.
LIGHT_SHARES, LIGHT_STRIDE = (0.1, 0.38), 2
HEAVY_SHARES, HEAVY_STRIDE = (0.3, 0.7), 1

BUILDING = np.dtype(
    [
        ("file", "i8"),  # address of a file that `check_file` accepts
        ("tier", "i8"),
        ("rate", "f8"),  # audio, Hz
        ("seed", "i8"),  # for the player's unevenness and noises
        ("ahead", "i8"),  # 1: strings can run ahead of the clock (takes memory)
        ("operators", "i8", (2,)),  # addresses: OPERATOR (strings, frets + 1), fine and coarse
        # addresses of these C functions
        ("over_frets", "i8"),
        ("over_board", "i8"),
        ("play_string", "i8"),
        ("memory", "i8"),  # address, on a cache line; a BASS comes first
        ("bytes", "i8"),  # of memory: `measure_bass` sets it
        ("clean", "i8"),  # 1: memory holds zeros, and nothing plays the bass here: its zeros are not written
        ("coil", COIL),  # workspace
        # an impulse response replacing the file's: address of float64, count (0: the file's), and rate, Hz
        ("response", "i8"),
        ("response_count", "i8"),
        ("response_rate", "f8"),
        ("of", "i8"),  # versions of the same bass have the same number, and carry on each other's notes; 0: none
        # for displays (reports.py): contacts and events that each string keeps; 0: none
        ("log_room", "i8"),
        ("report_room", "i8"),
    ],
    align=True,
)

building_at = record_at(BUILDING)
operators_at = records_at(OPERATOR, 2)
BASS_BYTES, PERFORMER_BYTES, STRING_BYTES, AHEAD_BYTES = (r.itemsize for r in (BASS, PERFORMER, STRING, AHEAD))
EVENT_BYTES, CONTACT_BYTES = EVENT.itemsize, CONTACT.itemsize
TONES_BYTES = WORD * ROW * TONES


@jit
def bytes_kept(building, i):
    """Bytes that save u and v of string `i`, for either set of operators; 0: nothing is saved."""
    of_u, of_v = np.int64(0), np.int64(0)
    if not building.ahead:
        return of_u, of_v
    instrument = file_at(building.file).instrument
    for which in range(2):
        ops = operators_at(building.operators[which], instrument.strings, instrument.frets + 1)
        for fret in range(instrument.frets + 1):
            u, v = saved_bytes(ops[i, fret])
            of_u, of_v = max(of_u, u), max(of_v, v)
    return of_u, of_v


@jit
def bytes_ahead(saved, answers):
    """Bytes of an AHEAD and its data, if a saved motion takes so many bytes; 0: only its sound.

    `answers`: number of modes that may answer the string.
    """
    if saved == 0:
        return lines(AHEAD_BYTES) + lines(WORD * SOUND_RING)
    states = lines(WORD * SAVES * VOICE_WORDS) + lines(WORD * SAVES * VOICE_SLOTS * SLOT_STATE)
    motion = lines(SAVES * VOICE_SLOTS * saved)
    answering = lines(WORD * SAVES * ANSWER_ROWS * MAX_ANSWERS) if answers > 0 else 0
    return lines(AHEAD_BYTES) + states + motion + answering + lines(WORD * SOUND_RING)


@entry("void(int64)", SMALL)
def measure_bass(address):
    """Sets the `bytes` that the BUILDING at an address needs."""
    building = building_at(address)
    needed = lines(BASS_BYTES) + lines(PERFORMER_BYTES) + 2 * lines(EVENT_BYTES * EVENT_ROOM) + lines(TONES_BYTES)
    instrument = file_at(building.file).instrument
    for i in range(instrument.strings):
        of_u, of_v = bytes_kept(building, i)
        needed += bytes_of_string(instrument, i) + bytes_ahead(of_u + of_v, answers_of(instrument, i))
        needed += report_bytes(building)
    take_response_of_file(building)
    needed += lines(bytes_of_effects(building.response_count, building.response_rate, building.rate))
    building.bytes = needed


@jit
def bytes_of_string(instrument, i):
    """Bytes of string `i` itself, with operators to glide on if a finger slides along it without steps."""
    return lines(STRING_BYTES) + (VOICE_SLOTS * BETWEEN_BYTES if instrument.fretless[i] else 0)


@jit
def report_bytes(building):
    """Bytes that a string keeps for displays."""
    kept = lines(CONTACT_BYTES * building.log_room)
    if building.report_room > 0:
        kept += REPORTS_BYTES + lines(EVENT_BYTES * building.report_room)
    return kept


@jit
def take_response_of_file(building):
    """Gives a BUILDING without a response its file's response, if any."""
    instrument = file_at(building.file).instrument
    if building.response_count == 0 and instrument.response_count > 0:
        building.response_count = instrument.response_count
        building.response_rate = instrument.response_rate
        building.response = response_of(building.file)


@jit
def ends_soon(b):
    """True if all strings lie over frets that lose energy on contact."""
    ops, lasting = operators_at(b.operators[0], b.strings, b.frets + 1), 0
    for i in range(b.strings):
        lasting += ops[i, 0].points > MAX_NEAR or ops[i, 0].loss == 0.0
    return lasting == 0


@entry("void(int64)", SMALL)
def fill_bass(address):
    """Makes a bass in the memory of the BUILDING at an address, after `measure_bass`."""
    building = building_at(address)
    if not building.clean:
        clear_memory(building.memory, building.bytes)
    instrument, b = file_at(building.file).instrument, bass_at(building.memory)
    tier, place = instrument.tiers[building.tier], building.memory + lines(BASS_BYTES)
    b.play_string = building.play_string
    b.strings = instrument.strings
    b.frets = instrument.frets
    b.of = building.of
    b.operators[0] = building.operators[0]
    b.operators[1] = building.operators[1]
    if building.ahead:
        soon, later = HEAVY_SHARES if tier.heavy else LIGHT_SHARES
        b.share = soon if ends_soon(b) else later
    b.stride = HEAVY_STRIDE if tier.heavy else LIGHT_STRIDE
    b.performer = place
    strings.make_performer(performer_at(place), instrument, building.seed)
    b.events = b.performer + lines(PERFORMER_BYTES)
    performer_at(place).out.events = b.events
    b.string_events = b.events + lines(EVENT_BYTES * EVENT_ROOM)
    b.tones = b.string_events + lines(EVENT_BYTES * EVENT_ROOM)
    place = b.tones + lines(TONES_BYTES)
    strings.take_circuit(building.coil, instrument, building.rate)
    fit_tones(b.tones, building.coil, instrument.gain)
    note = 0.0  # signal of a medium pluck, on average
    steps = np.int64(whole_steps(tier.contact_rate, building.rate))
    for i in range(instrument.strings):
        b.string[i] = place
        string = strings.string_at(place)
        strings.reset_string(string, building.rate, steps, 1, building.over_frets, building.over_board)
        strings.connect_pickups(string, instrument, i, building.coil)
        ops = operators_at(building.operators[0], instrument.strings, instrument.frets + 1)
        connect_answers(string, i, instrument, ops)
        strings.fit_noises(string, i, instrument, performer_at(b.performer), ops, building.seed)
        note += strings.signal_of_medium(string.voice) / instrument.strings
        string.voice.tones = b.tones
        string.between = place + lines(STRING_BYTES) if instrument.fretless[i] else 0
        b.ahead[i] = place + bytes_of_string(instrument, i)
        of_u, of_v = bytes_kept(building, i)
        others = answers_of(instrument, i)
        lay_out_ahead(b.ahead[i], of_u, of_v, others)
        place = b.ahead[i] + bytes_ahead(of_u + of_v, others)
        string.voice.log = place
        string.voice.log_room = building.log_room
        string.voice.reports = place + lines(CONTACT_BYTES * building.log_room)
        string.voice.report_room = building.report_room
        place += report_bytes(building)
    player = instrument.player
    if (player.floor_noise > OFF or player.hum > OFF) and note > 0.0:
        pole = strings.string_at(b.string[0]).voice.gain_pole
        make_floor(b.floor, player, note, building.rate, pole, building.seed)
    b.effects = place
    count, given = building.response_count, building.response_rate
    compression, drive = instrument.compression, instrument.drive
    make_effects(place, building.rate, compression, drive, building.response, count, given)
    take_amp(place, instrument)


@jit
def lay_out_ahead(address, of_u, of_v, answers):
    """Lays out the memory after the AHEAD at an address.

    A saved motion takes `of_u` and `of_v` bytes; `answers` as for `bytes_ahead`.
    """
    a = ahead_at(address)
    a.sound = address + lines(AHEAD_BYTES)
    if of_u + of_v == 0:
        return
    a.kept_u = of_u
    a.kept_v = of_v
    a.voice = address + lines(AHEAD_BYTES)
    a.slots = a.voice + lines(WORD * SAVES * VOICE_WORDS)
    a.memory = a.slots + lines(WORD * SAVES * VOICE_SLOTS * SLOT_STATE)
    a.answers = a.memory + lines(SAVES * VOICE_SLOTS * (of_u + of_v))
    a.sound = a.answers + (lines(WORD * SAVES * ANSWER_ROWS * MAX_ANSWERS) if answers > 0 else 0)
