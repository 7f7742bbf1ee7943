"""`livebass compare`: compares single notes of real basses with rendered ones, figure by figure."""

from __future__ import annotations

import os
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import click

from livebass.cli import options
from livebass.cli.groups import GroupedCommand
from livebass.cli.messages import say
from livebass.cli.progress import have_kernels, shown_progress
from livebass.cli.values import Parsed
from livebass.model.quality import QUALITIES
from livebass.report.progress import steps
from livebass.rows.units import is_number

TECHNIQUES = ("fingers", "pick", "slap", "pop", "mute")
GROUPS = {
    "Presets": "--preset --beside --quality --velocities --takes --seed",
    "Notes": "--technique",
    "Results": "--tell --hear --phrase --output --json",
    "Help": "--help",
}


def _velocities(text: str) -> tuple[int, ...]:
    """Comma-separated velocities, from soft to hard."""
    found = tuple(int(part) if is_number(part) else 0 for part in re.split(r"\s*,\s*", text))
    if any(not 1 <= v <= 127 for v in found) or any(b <= a for a, b in pairwise(found)):
        rule = "ascending velocities from 1 to 127 with commas, such as 30,60,90,127"
        raise ValueError(f"must be {rule}, not {text!r}")
    return found


@click.command(cls=GroupedCommand, groups=GROUPS)
@click.argument("recordings", nargs=-1, type=options.PATH, metavar="[REAL...]")
@options.preset_option("A preset that plays the same notes; repeatable.", "presets", multiple=True)
@options.option(
    "--beside",
    options.PATH,
    "Recordings, or a folder of them, to compare instead of presets; repeatable.",
    multiple=True,
    metavar="FILE|DIR",
)
@options.option("-q --quality", click.Choice(list(QUALITIES)), "Precision of the presets' strings.", default="studio")
@options.option(
    "--velocities",
    Parsed("n,n...", _velocities),
    "Velocities of a preset, soft to hard.  [default: 30 to 127, as many as the dynamics of REAL]",
)
@options.count_option("--takes", 16, "Number of times a preset plays each note.", default=2)
@options.seed_option()
@options.option(
    "--technique",
    click.Choice(TECHNIQUES),
    "Technique of all notes.  [default: by the file names, or fingers; each preset's own]",
)
@options.file_option("-o --output", "Write a page with spectrograms, decays, bands and players.", metavar="PAGE.html")
@options.flag("--tell", "Say how well each bass can be told from real ones, instead of comparing.")
@options.flag("--hear", "Say how like the nearest real note each note sounds, by a model of hearing, instead.")
@options.option(
    "--phrase",
    click.Choice(("line", "groove")),
    "Compare recordings of phrases with one that the presets play, instead.",
)
@options.file_option("--json json_file", "Write all figures, also for each note, as JSON.")
def compare(
    recordings: tuple[Path, ...], presets: tuple[str, ...], beside: tuple[Path, ...], technique: str | None,
    phrase: str | None, output: Path | None, json_file: Path | None, **how: Any,
) -> None:  # fmt: skip
    """Compare notes of real basses with rendered notes.

    REAL are sound files of single notes, or folders of them: each folder is a bass, single files together are another.
    The command hears the pitch. Words in file and folder names tell the dynamics (pp p mp mf f ff, soft medium hard, v1
    or v100, or a number that grows with the level), the technique (fingers, pick, slap, pop, mute), whether the string
    is open or stopped, and whether a file is the noise of a release. Without such words the level tells the dynamics.

    Prints rows for attack, touch, pitch and decay: medians over the notes of each bass, beside the range of real basses
    played with the same technique, and whether they lie inside. Then prints distances between notes of the same pitch,
    from each bass to each real bass; the differences within one bass give the scale. A dash marks a value that short or
    cut notes do not show; a line below the table gives the reason.

    Each preset is compared by its own technique, such as slap or pick; the titles of the columns name it.

    With --tell a small classifier learns to tell each bass from real ones: REAL, and those whose figures livebass has.
    The command prints how well it does (AUC: 0.5 is chance, 1 certainty), how well it tells real basses from each
    other, and which figures give the bass away first. The transfer AUC comes from a classifier that never heard the
    preset: it learns what the other presets share and no real bass has. This takes some minutes, since all of them
    play. Without REAL, presets choose the notes that they play.

    With --hear a model of hearing (Zimtohrli) finds the nearest note of REAL for each note: a MOS of 5 means no audible
    difference, 1 a bad one. With --phrase, REAL are recordings of a line or a groove, or of notes cut from one, and
    presets play one of their own; the rows are ends of notes, ghost notes, what sounds between notes, and how much
    repeated notes differ.

    \b
    Examples:
      livebass compare tests/recordings/growlybass --preset jazz-finger
      livebass compare my-bass other-bass --preset mine.toml --preset jazz-finger -o compared.html
      livebass compare my-bass --beside renders --json compared.json
      livebass compare --tell --preset jazz-finger
      livebass compare my-bass --hear --preset jazz-finger
      livebass compare my-groove.wav --phrase groove --preset jazz-finger
    """
    from livebass.preset.load import load_preset

    tell, hear = how.pop("tell"), how.pop("hear")
    judges = {"--tell": tell, "--hear": hear, "--phrase": phrase is not None}
    _check(judges, recordings, bool(beside or presets), output)
    places = options.files_to_write({"--output": output, "--json": json_file}, (*recordings, *beside))
    for name in presets:
        load_preset(name)  # before the work
    if phrase is not None:
        result, count = _phrases(phrase, recordings, presets, beside, how)
        options.write_results([(json_file, result.json)], result.table())
    else:
        count = _notes(recordings, presets, beside, technique, tell, hear, (output, json_file), how)
    say(count + (f" -> {', '.join(map(str, places))}" if places else ""))


def _check(judges: dict[str, bool], recordings: tuple[Path, ...], others: bool, output: Path | None) -> None:
    """Refuses options that do not go together, and what their packages lack."""
    chosen = [name for name, given in judges.items() if given]
    if len(chosen) > 1:
        raise click.UsageError(f"{' and '.join(reversed(chosen[-2:]))}: choose one")
    judge = chosen[0] if chosen else ""
    if not recordings and judge not in ("--tell", "--phrase"):
        raise click.UsageError("Missing argument 'REAL...'.")
    if not recordings and not others:
        raise click.UsageError(f"{judge}: name recordings, or a preset with -p")
    if judge and output is not None:
        raise click.UsageError(f"-o: {judge} has no page; use --json")
    if judge == "--phrase":
        for name in ("technique", "velocities", "takes"):
            if options.is_given(name):
                raise click.UsageError(f"--{name}: it has no use with --phrase")
    if judge == "--hear":
        from livebass.lab.comparison.hearing import check_hearing

        check_hearing()
    if output is not None:
        from livebass.report.picture import check_plots

        if output.suffix.lower() not in (".html", ".htm"):
            raise click.UsageError(f"-o {os.fspath(output)}: a page's name ends in .html")
        check_plots("-o")


def _phrases(
    kind: str, recordings: tuple[Path, ...], presets: tuple[str, ...], beside: tuple[Path, ...], how: dict[str, Any]
) -> tuple[Any, str]:
    """Compares phrases; returns the result, and how many they are, as text."""
    from livebass.lab.comparison.phrases import Phrases, played_bass, read_phrases

    found = read_phrases(recordings) + read_phrases(beside, rendered=True)
    if presets:
        have_kernels()
    with shown_progress("playing") as progress:
        step = steps(progress, max(1, len(presets)))
        for name in presets:
            found.append(played_bass(name, kind, how["quality"], how["seed"]))
            step()
    count = f"{kind}{'s' * (len(found) != 1)} of {len(found)} bass{'es' * (len(found) != 1)}"
    return Phrases(kind, tuple(found)), count


def _notes(
    recordings: tuple[Path, ...], presets: tuple[str, ...], beside: tuple[Path, ...], technique: str | None,
    tell: bool, hear: bool, written: tuple[Path | None, Path | None], how: dict[str, Any],
) -> str:  # fmt: skip
    """Compares notes and writes the result; returns how many they are, as text."""
    from livebass.lab.comparison.comparing import Comparison, compare_basses
    from livebass.lab.comparison.hearing import hearing
    from livebass.lab.comparison.recordings import play_presets, read_basses
    from livebass.lab.comparison.telling import telling

    found, left_out = read_basses(recordings, beside, technique)
    if recordings and all(bass.rendered for bass in found):
        raise click.UsageError(f"{recordings[0]}: only noises of hands are there; at least one plucked note is needed")
    if left_out:
        more = f" and {len(left_out) - 1} more" if len(left_out) > 1 else ""
        say(f"left out, as no note with a pitch is heard: {left_out[0]}{more}")
    if presets:
        have_kernels()
    try:
        found += play_presets(presets, found, technique=technique, taken=[*recordings, *beside], **how)
    except ValueError as error:
        raise click.UsageError(f"--preset {error}") from None
    with shown_progress("telling" if tell else "hearing" if hear else "measuring") as progress:
        result = (
            telling(found, progress, how["quality"], say) if tell
            else hearing(found, progress) if hear
            else compare_basses(found, progress)
        )  # fmt: skip

    def drawn() -> str:
        from livebass.lab.comparison.page import page

        assert isinstance(result, Comparison)
        return page(result)

    output, json_file = written
    options.write_results([(json_file, result.json), (output, drawn)], result.table())
    count = sum(len(bass.notes) for bass in found)
    return f"{count} note{'s' * (count != 1)} of {len(found)} bass{'es' * (len(found) != 1)}"
