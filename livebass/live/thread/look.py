"""LOOK, a synth's state for a plugin's window: moving strings, their contacts, hands, lamps.

`see_synth` fills a LOOK at the end of a block from the playing bass, and changes nothing else. It continues from the
LOOK's last contents: its own index counts the contacts, and each contact lights its place for a while: the fret it
hits, or over a board the place where that fret would be. Strings that run ahead of the clock appear some milliseconds
early. [audio thread]
"""

import numpy as np

from livebass.compiling import SMALL, entry, jit
from livebass.kernels.bass.records import bass_at
from livebass.kernels.machine.elementary import exp, log2
from livebass.kernels.machine.native import record_at, records_at
from livebass.kernels.player.performer import ANY, MAX_STRINGS
from livebass.kernels.string.operators import place_of
from livebass.kernels.string.records import CONTACT, MAX_NEAR
from livebass.live.thread.records import operators_of, performer_of, string_of, synth_at
from livebass.live.thread.sight import SIGHT, see_string
from livebass.rows.techniques import ACTIONS, TECHNIQUE

PLACES = 40  # number of lights along a neck, one per fret, from the nut on
LOGGED = 256  # contacts per string that a plugin has room for
FULL_SPEED = 4.0  # m/s of a hit that gives full light
GLOW = 0.11  # s in which a light fades to a third

STRING_LOOK = np.dtype(
    [
        ("sight", SIGHT),
        ("state", "i8"),  # of the hand: FREE, HELD or PEDALLED
        ("key", "i8"),  # that plays it; -1: none
        ("fret", "i8"),  # where the hand holds it; the sound may still be on its way there
        ("bend", "f8"),  # ratio of frequencies
        ("open", "i8"),  # note
        ("length", "f8"),  # m, open
        ("speed", "f8"),  # m/s of waves: at equal length and tension, the slower string is heavier
        ("pickups", "i8"),
        ("saddle", "f8", (4,)),  # m, of each pickup from the saddle
        ("aperture", "f8", (4,)),  # m
        ("mix", "f8", (4,)),  # level in the signal
        ("counted", "i8"),  # contacts seen so far
        ("light", "f4", (PLACES,)),  # 0 to 1, of each place [fret]: strength of its hit
    ],
    align=True,
)
LOOK = np.dtype(
    [
        ("bass", "i8"),  # address; 0: none
        ("frame", "i8"),  # of the synth
        ("strings", "i8"),
        ("frets", "i8"),
        ("fretless", "i8"),
        ("place", "f8", (PLACES,)),  # m from the nut, of each fret; 0 is the nut
        ("overload", "i8"),  # strings on coarse operators
        ("load", "f8"),  # part of its time that the last block took
        ("peak", "f8"),  # of the block's sound, written by the plugin
        ("technique", "f8"),  # the parameter of the stroke
        ("stroke", "i8"),  # FINGER, PICK, NAIL or POP
        ("slapped", "i8"),  # strings that the thumb strikes, from the lowest
        ("switched", "i8"),  # techniques that keys or hosts hold, a bit each
        ("forced", "i8"),  # string that plays all notes while its key is held; -1: none
        ("hand", "i8"),  # fret of the first finger
        ("position", "f8"),  # of a pluck, part of the open string from the nut
        ("nearest", "f8"),  # ... and its place for the parameter at 1 ...
        ("default_value", "f8"),  # ... 0 ...
        ("farthest", "f8"),  # ... and -1
        ("latest", "i8"),  # string plucked last; -1: none
        ("notes", "i8"),  # played so far
        ("palm", "f8"),  # 0 to 1
        ("vibrato", "f8"),  # 0 to 1
        ("pedal", "i8"),
        ("legato", "i8"),
        ("sliding", "i8"),
        ("string", STRING_LOOK, (MAX_STRINGS,)),
    ],
    align=True,
)
look_at = record_at(LOOK)
contacts_at = records_at(CONTACT)


@entry("void(int64, int64)", SMALL)
def see_synth(synth, look):
    """Fills the LOOK at an address from the SYNTH at an address; a new LOOK must be zeroed."""
    s, seen = synth_at(synth), look_at(look)
    bass = s.bass if s.bass != 0 else s.next_bass
    known = bass == seen.bass and s.frame >= seen.frame
    fades = exp((seen.frame - s.frame) / (GLOW * s.rate)) if known else 0.0
    seen.bass = bass
    seen.frame = s.frame
    seen.overload = s.overload
    seen.load = s.load
    if bass == 0:
        seen.strings = 0
        return
    b = bass_at(bass)
    if not known:
        see_neck(b, seen)
    see_player(performer_of(b), seen)
    for i in range(b.strings):
        see_hand(performer_of(b), i, seen.string[i])
        string, ops = string_of(b, i), operators_of(b, (b.coarse >> i) & 1)[i]
        see_lane(string, ops, seen.string[i])
        for k in range(PLACES):
            seen.string[i].light[k] *= fades
        if not known:
            seen.string[i].counted = string.voice.logged
        see_contacts(string.voice, ops, seen.string[i])


@jit
def see_neck(b, seen):
    """Measures a bass's neck."""
    ops = operators_of(b, 0)
    seen.strings = b.strings
    seen.frets = min(b.frets, PLACES - 1)
    seen.fretless = string_of(b, 0).voice.fretless
    for k in range(PLACES):
        seen.place[k] = ops[0, 0].length - ops[0, min(k, b.frets)].length
    for i in range(b.strings):
        lane = seen.string[i]
        lane.open = performer_of(b).open[i]
        lane.length = ops[i, 0].length
        lane.speed = ops[i, 0].speed


@jit
def see_player(p, seen):
    """Copies the state of the player's hands, keys and controllers."""
    controls, hands, bass = p.controls, p.hands, p.controls.channel[ANY]
    seen.technique = controls.adjusted[TECHNIQUE]
    seen.stroke = p.stroke
    seen.slapped = p.slapped
    seen.switched = 0
    for k in range(ACTIONS):
        if p.switched[k] > 0:
            seen.switched |= 1 << k
    seen.forced = p.forced
    seen.hand = hands.place
    seen.position = p.position
    seen.nearest = p.player.pluck_nearest
    seen.default_value = p.player.pluck_position
    seen.farthest = p.player.pluck_farthest
    seen.latest = hands.latest
    seen.notes = p.notes
    seen.palm = controls.palm
    seen.vibrato = bass.vibrato
    seen.pedal = bass.pedal
    seen.legato = controls.legato
    seen.sliding = controls.sliding


@jit
def see_hand(p, i, lane):
    """Copies the hands' state on string `i`."""
    lane.state = p.hands.state[i]
    lane.key = p.hands.key[i]
    lane.fret = p.hands.fret[i]


@jit
def see_lane(string, ops, lane):
    """Copies one string's shape and pickups."""
    voice = string.voice
    see_string(string, ops, lane.sight)
    lane.bend = voice.tuned
    lane.pickups = voice.pickups
    for k in range(4):
        lane.saddle[k] = voice.saddle[k]
        lane.aperture[k] = voice.aperture[k]
        lane.mix[k] = voice.mix[k]


@jit
def see_contacts(voice, ops, lane):
    """Lights the places of a string's contacts since the last look."""
    if voice.log_room == 0:
        return
    log = contacts_at(voice.log, voice.log_room)
    for k in range(max(min(lane.counted, voice.logged), voice.logged - voice.log_room), voice.logged):
        contact = log[k % voice.log_room]
        place = light_of(contact, ops)
        hard = min(1.0, np.sqrt(max(contact.speed, 0.0) / FULL_SPEED))
        light = hard * exp(min(0.0, (contact.step - voice.step) * ops[contact.fret].fine / GLOW))
        if 0 <= place < PLACES:
            lane.light[place] = max(lane.light[place], light)
    lane.counted = voice.logged


@jit
def light_of(contact, ops):
    """The place that a contact lights: the fret it hits, or on a board the fret that would be nearest."""
    place, length = place_of(contact, ops), ops[0].length
    if ops[contact.fret].points <= MAX_NEAR:
        return np.int64(place)
    return np.int64(np.rint(12.0 * log2(length / max(length - place, 1e-3))))
