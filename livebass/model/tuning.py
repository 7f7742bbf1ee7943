"""Tunes a bass: changes its strings' tension and puts a capo on its neck. For the physics see `tension_string`."""

from __future__ import annotations

from dataclasses import replace

from livebass.kernels.bass.change import MAX_SLACK
from livebass.model.exact import exp2
from livebass.model.instrument import Neck, Pick, Player, String, tension_string
from livebass.model.neck import FREE_PART, surface_beyond

MIN_PLACE, MAX_PLACE = 0.01, 0.99  # of a pluck, fractions of the open string


def tune_string(string: String, note: int, offsets: tuple[float, ...] = ()) -> String:
    """`string` tuned to the MIDI `note`; `offsets` (12,), cents, C first, shift all its notes from equal temperament.

    The same force pulls it 1 / r^2 as far if it sounds r times as high, at most MAX_SLACK times.
    """
    wanted = replace(string, open_note=note, offsets=offsets if any(offsets) else (), own_note=string.open_note)
    if (wanted.open_note, wanted.offsets) == (string.open_note, string.offsets):
        return string
    ratio = wanted.frequency(note) / string.frequency(string.open_note)
    return replace(tension_string(wanted, ratio), slack=min(string.slack / (ratio * ratio), MAX_SLACK))


def with_capo(string: String, neck: Neck, fret: int) -> tuple[String, Neck]:
    """String and neck with a capo at `fret`: a permanent stop from which frets, notes and places count."""
    if not fret:
        return string, neck
    x, h, total = neck.fret_positions, neck.fret_heights, string.length
    start, height = x[fret - 1], h[fret - 1]
    length = total - start
    heights = (hk - height * (total - xk) / length for xk, hk in zip(x[fret:], h[fret:], strict=True))
    note = string.open_note + fret
    if string.offsets:
        cents = string.offsets[note % 12] - string.offsets[string.open_note % 12]
        string = tension_string(string, exp2(cents / 1200))
    part = total / length
    shorter = replace(
        string,
        open_note=note,
        own_note=string.open_note if string.own_note is None else string.own_note,
        length=length,
        inharmonicity=string.inharmonicity * (part * part),
        law_fundamental=0.0,
        measured_frequencies=(),
        measured_dampings=(),
    )
    beyond = replace(
        neck,
        fret_positions=tuple(xk - start for xk in x[fret:]),
        fret_heights=tuple(heights),
        surface=surface_beyond(neck.surface, start, height, total),
        free_length=neck.free_length or FREE_PART * total,
        capo=neck.capo + start,
    )
    return shorter, beyond


def over_same_body(player: Player, part: float) -> Player:
    """`player` with the hand at the same place over the body, for strings of this `part` of their length."""
    if part == 1:
        return player
    places = {
        name: min(max(1 - (1 - getattr(player, name)) / part, MIN_PLACE), MAX_PLACE)
        for name in ("pluck_position", "pluck_nearest", "pluck_farthest", "strike_position")
    }
    pick = player.pick
    if pick.place != Pick.place:
        pick = replace(pick, place=min(max(1 - (1 - pick.place) / part, MIN_PLACE), MAX_PLACE))
    return replace(player, pick=pick, **places)
