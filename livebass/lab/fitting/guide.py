"""The notes to play for a fit, string by string."""

from __future__ import annotations

from dataclasses import dataclass

from livebass.model.instrument import Instrument
from livebass.rows.units import note_name

FRETS = (0, 5, 12)
FORCES = ("soft", "medium", "hard")
TAKES = 2
SECONDS = 3.0  # s that a note rings before it is stopped
SILENCE = 5.0  # s


@dataclass(frozen=True)
class Step:
    """One note of the guide."""

    string: str  # name
    fret: int
    place: str  # the fret in words
    key: int  # MIDI
    force: str
    take: int  # from 1

    @property
    def rank(self) -> int:
        """The layer of its force, 0 the softest."""
        return FORCES.index(self.force)

    @property
    def file(self) -> str:
        """The name of its recording, which tells all of it."""
        place = "open" if self.fret == 0 else f"fret{self.fret:02}"
        return f"string{self.string}_{place}_{self.force}_take{self.take}.flac"

    @property
    def title(self) -> str:
        """The note in words."""
        return f"{self.string} string, {self.place} ({note_name(self.key)}), {self.force}, take {self.take}"


def steps(bass: Instrument) -> list[Step]:
    """The notes to play on a bass, from the lowest string: each fret soft, medium and hard, twice each."""
    return [
        Step(s.name, fret, neck.note_text(fret), s.open_note + fret, force, take)
        for s, neck in zip(bass.strings, bass.necks, strict=True)
        for fret in FRETS
        if fret <= len(neck.fret_positions)
        for force in FORCES
        for take in range(1, TAKES + 1)
    ]


def guide_text(bass: Instrument) -> str:
    """The guide for people: how to set up, and a line for each place to play."""
    all_steps = steps(bass)
    rows = []
    for s in bass.strings:
        names = ", ".join(dict.fromkeys(step.place for step in all_steps if step.string == s.name))
        rows.append(f"  {s.name} string ({note_name(s.open_note)}): {names}; soft, medium, hard, twice each")
    minutes = round(len(all_steps) * (SECONDS + 1) / 60)
    example = all_steps[1].file
    return "\n".join([
        f"{len(all_steps)} notes, about {minutes} minutes:",
        *rows,
        "",
        "- Plug in directly. Volume and tone full up, no effects, no compressor. Note which pickups are on,",
        "  and how far they are from the bridge: a fit cannot tell place of pluck and pickup apart.",
        "- Set the level once, so that the hardest note peaks below -3 dBFS. Never normalise.",
        "- Play string after string from the lowest, in the order above. Damp the other strings.",
        f"- Let each note ring for {SECONDS:g} s, then stop it with the hand. The second take shows how far two",
        "  strokes of yours differ, which is the scale for the result.",
        f"- Record {SILENCE:g} s of silence too, with the strings damped: it tells the noise of the electronics.",
        "",
        f"Save each note as its own file with a name such as {example}, and the silence as",
        "silence.flac; or record all notes in this order into one file.",
        "`livebass fit --guide --record DIR` asks for each note and saves it.",
    ])  # fmt: skip
