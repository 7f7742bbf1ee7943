"""The page's stories: steps of a bass, its bench and a note, with a sentence about what it shows.

A sentence may say {hits}: the page replaces it by the contacts that it has counted.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple


class Note(NamedTuple):
    """A note on a string, by number, stopped at a fret."""

    string: int
    fret: int
    velocity: int


class Step(NamedTuple):
    """A step: `notes`, the first of them shown, on a bass with these values of its sliders."""

    says: str
    bass: str
    notes: tuple[Note, ...] = ()
    values: Mapping[str, float] = {}


class Story(NamedTuple):
    """Steps under a title; a link names the story by its key in STORIES."""

    title: str
    steps: tuple[Step, ...]


HARD = Note(0, 3, 127)
STORIES = {
    "buzz": Story(
        "Show me",
        (
            Step("A soft note swings freely over its frets: {hits}.", "jazz-finger", (Note(0, 3, 30),)),
            Step(
                "The same note, hard. The wave comes back from the bridge and lands on the frets: {hits}. "
                "You hear them as bite.",
                "jazz-finger",
                (HARD,),
            ),
            Step(
                "Lower the strings from 2.4 to 1 mm, same hand: {hits}. That is fret buzz.",
                "jazz-finger",
                (HARD,),
                {"action": -1.4},
            ),
            Step(
                "Fret 7 stands 0.3 mm too high. A gentle note at fret 5 rattles on it: {hits}.",
                "jazz-finger",
                (Note(0, 5, 60),),
                {"fret": 7, "fret_height": 0.3},
            ),
            Step(
                "Slap: the thumb drives the string onto the last frets, and the wave runs down the neck: {hits}.",
                "slap",
                (Note(0, 0, 120),),
            ),
            Step(
                "Your turn: press a string, move Action on the bench, then press Same pluck, new bass.", "jazz-finger"
            ),
        ),
    ),
    "paper": Story(
        "The paper",
        (
            Step(
                "A hard note begins sharp and falls as it fades: its motion stretches the string. Listen.",
                "jazz-finger",
                (Note(0, 0, 127),),
            ),
            Step(
                "A dead spot: the neck swings at the pitch of fret 6 on the G string and takes its fundamental over "
                "twice as fast as fret 5's, heard next.",
                "jazz-finger",
                (Note(3, 6, 90), Note(3, 5, 90)),
            ),
            Step(
                "A bare board: the string lands all along the wood and growls: {hits}.", "fretless", (Note(0, 5, 120),)
            ),
            Step(
                "Frets that take four times the energy at each hit: {hits}, and less bite.",
                "jazz-finger",
                (HARD,),
                {"contact_loss": 300},
            ),
        ),
    ),
}


def shown_stories(changeable: Collection[str]) -> list[dict[str, Any]]:
    """Returns the stories whose basses are all among the page's basses with a bench, by name, as data for the page."""
    return [
        {"name": name, "title": story.title, "steps": [step._asdict() for step in story.steps]}
        for name, story in STORIES.items()
        if {step.bass for step in story.steps} <= set(changeable)
    ]
