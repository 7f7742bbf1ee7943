"""The basses and the score that `livebass play` plays, chosen by options, memory and the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import click

from livebass.cli.demos import demo_for, ready_for
from livebass.cli.effects import EffectOptions
from livebass.cli.hands import Hands, Loader
from livebass.cli.messages import say, say_choked
from livebass.cli.options import DEFAULT_PRESET
from livebass.cli.play_settings import Memory
from livebass.cli.score_bass import beyond_range, later_presets, preset_of, programs_of, remarks
from livebass.cli.song import AUTO, Song
from livebass.cli.tabs import TabOptions
from livebass.cli.take_bass import load_take_basses, take_options
from livebass.cli.tuning import TUNING_KEYS, load_tuned, tuning_of_options
from livebass.live.desk import with_beats
from livebass.model.instrument import Instrument
from livebass.preset.load import load_preset
from livebass.score.low_keys import with_low_notes
from livebass.score.score import Score


class Music:
    """Loads basses with the hands, tuning and effects of the options; reads --file or --demo.

    `requested` are the sound options on the command line, without remembered ones. Takes the tuning out of `options`.
    Raises PresetError and ScoreError.
    """

    def __init__(
        self, options: dict[str, Any], requested: dict[str, Any], hands: Hands, behind: EffectOptions, memory: Memory
    ) -> None:
        self.demo, self.wanted = options["demo"], options["preset"]
        self.requested, self.hands, self.behind, self.memory = requested, hands, behind, memory
        tab = TabOptions.from_options(options, requested)
        self.song = options["song"] and Song(options["song"], AUTO, self.wanted, tab, Loader(requested.copy()))
        self.tuning = tuning_of_options(options)
        self.clicks, self.count_in = options["metronome"] == "file", options["count_in"]
        self._command = click.get_current_context().command
        self._of_take: dict[str, Mapping[str, str]] = {}  # options by preset, for presets that a take names
        self._load_of_take: Callable[[str], Instrument] = load_preset
        self.score = self._read_song(options["rate"]) if self.song else None  # reports errors in the file now
        if self.clicks and not (self.score and self.score.beats):
            raise click.UsageError("--metronome file is for a --file with bars: a tablature")
        if self.score:
            self._of_take = {bass.preset: bass.given for bass in self.score.basses}
        self.preset, self.bass = self._first()
        say_choked([self.bass])
        if self.score:
            lines = remarks(self.score, self.wanted, DEFAULT_PRESET)
            for line in [*lines, *beyond_range(self.bass, self.score, DEFAULT_PRESET)]:
                say(f"{self.song.path}: {line}")

    def load(self, preset: str) -> Instrument:
        """Loads a preset as the take names it, or with the options."""
        if preset in self._of_take:
            return self._load_of_take(preset)
        bass = self.hands.play(load_tuned(preset, self.tuning, self.memory.given))
        return ready_for(self.demo, self.behind.put(bass))

    def given(self, preset: str) -> Mapping[str, str]:
        """The options that change a preset, for writing a take."""
        if preset in self._of_take:
            return {**self._of_take[preset], **take_options(self.requested)}
        found = take_options(self.requested | dict.fromkeys(TUNING_KEYS) | self.tuning)
        return found | {"keys": "modo"} if self.demo == "techniques" else found

    @property
    def read(self) -> Callable[[int], Score] | None:
        """Reads the file or the demo at a given rate; None if there is neither."""
        if self.song:
            return lambda rate: with_low_notes(self._with_beats(self._read_song(rate)), self.bass)
        return (lambda rate: demo_for(self.bass, rate, self.demo)) if self.demo else None

    @property
    def programs(self) -> dict[int, str]:
        """The presets that the file's programs choose, by program from 0."""
        return programs_of(self.score) if self.score else {}

    @property
    def unchosen(self) -> set[str | None]:
        """The presets that the player did not choose: the first one, and those from the file."""
        later = later_presets(self.score, DEFAULT_PRESET) if self.score else []
        return {self.preset, *(name for _, _, name in later)}

    def _read_song(self, rate: int) -> Score:
        """Reads the file; its program changes change the bass unless the player asked for one."""
        score, self.wanted = self.song.read(rate)
        if self.wanted:
            return score.on_one_bass()
        if score.basses:
            score, self._load_of_take = load_take_basses(score, self.song.load, DEFAULT_PRESET, self._command)
        return score

    def _with_beats(self, score: Score) -> Score:
        """The score with the beats that the metronome clicks, and a bar to count in, as the options ask."""
        return with_beats(score, self.count_in) if self.clicks else score

    def _first(self) -> tuple[str, Instrument]:
        """The preset that plays first, and its bass.

        Reports and drops remembered values that do not fit, in the tuning too. Raises PresetError.
        """
        preset, used = self.wanted or preset_of(self.score, DEFAULT_PRESET), self.memory.used
        recalled = [name for name in self.tuning if name in used]
        try:
            return preset, self.load(preset)
        except ValueError as error:
            if not recalled and ("preset" not in used or self.tuning):
                raise
            problem = error
        for name in recalled:
            del self.tuning[name], used[name]
        try:
            bass = self.load(preset)
            say(f"as remembered: {problem}; {', '.join(recalled)} left out")
            return preset, bass
        except ValueError:
            if "preset" not in used or self.tuning:
                raise
        left = f", {', '.join(recalled)} left out" if recalled else ""
        say(f"as remembered: {problem}; {DEFAULT_PRESET} plays{left}")
        return DEFAULT_PRESET, self.load(DEFAULT_PRESET)
