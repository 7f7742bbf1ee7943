"""The page's stories: each step is a link that the page can follow."""

from __future__ import annotations

from livebass import load_preset
from livebass.web.bench import Source
from livebass.web.link import check_link
from livebass.web.stories import STORIES, shown_stories


def test_steps_are_links_that_the_page_could_follow() -> None:
    names = {one.bass for story in STORIES.values() for one in story.steps}
    basses = {name: load_preset(name) for name in names}
    for story in STORIES.values():
        for one in story.steps:
            values = "".join(f"&{symbol}={value}" for symbol, value in one.values.items())
            check_link(f"like={one.bass}{values}", basses, {name: Source(name) for name in names})
            assert all(note.fret <= basses[one.bass].frets and note.velocity <= 127 for note in one.notes)
    assert [story["name"] for story in shown_stories(names)] == list(STORIES)
    assert shown_stories(["jazz-finger"]) == []
