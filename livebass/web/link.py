"""Checks links before the page is made, by the rules of static/bench/bench.js (`fromLink`), cases.js and story.js."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from urllib.parse import parse_qsl

from livebass.files.formats import FORMATS, KEY
from livebass.live.parameters import PARAMETERS
from livebass.model.instrument import Instrument
from livebass.rows.techniques import event
from livebass.web.bench import Source, bench
from livebass.web.export import revisions_of, shown_cases
from livebass.web.stories import STORIES

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)")


def check_link(link: str, basses: Mapping[str, Instrument], sources: Mapping[str, Source]) -> None:
    """Raises ValueError, one line, for a link that a page with `basses`, by short name, cannot follow.

    link: "case=b", "story=buzz&step=3", "like=slap&action=-0.5", or a page's address with one of them after its #.
    """
    said = parse_qsl(link.rpartition("#")[2], keep_blank_values=True)
    if not said:
        raise ValueError("a link must be case=b, story=buzz, or copied from the bench of a page")
    (key, name), *values = said
    if key == "case":
        cases = [case["symbol"] for short, bass in basses.items() for case in shown_cases(bass, sources.get(short))]
        if name not in cases:
            there = f"it has {', '.join(cases)}" if cases else "none of its basses has cases, as paper-g does"
            raise ValueError(f"the link names no case of this page: case={name[:20]}; {there}")
        return
    if key == "story":
        step = dict(values).get("step", "1")
        if name not in STORIES or step not in map(str, range(1, len(STORIES[name].steps) + 1)):
            there = ", ".join(STORIES)
            raise ValueError(f"the link names no step of a story: {name[:20]}, {step[:20]}; stories: {there}")
        missing = sorted({one.bass for one in STORIES[name].steps} - set(basses))
        if missing:
            raise ValueError(f"the page lacks a bass of the story {name}: {', '.join(missing)}")
        return
    known = bench(basses[name], sources[name]) if key == "like" and name in basses else None
    if known is None:
        raise ValueError(f"the link names no bass of this page that can be changed: {f'{key}={name}'[:40]}")
    limits = {slider["symbol"]: (slider["minimum"], slider["maximum"], slider["unit"]) for slider in known["sliders"]}
    limits |= {p.symbol: (p.minimum, p.maximum, p.unit) for p in PARAMETERS if event(p)}
    for written, value in values:
        symbol = known["renamed"].get(written, written)
        if symbol == KEY and value != str(FORMATS["link"]):
            raise ValueError(f"the link was made for a later livebass: this one reads format {FORMATS['link']}")
        if symbol == "revision":
            _check_revision(name, basses[name].name, value, sources[name])
        if symbol not in limits:  # such as a mail program's
            continue
        minimum, maximum, unit = limits[symbol]
        if not minimum <= (float(value) if NUMBER.fullmatch(value.strip()) else math.nan) <= maximum:
            wanted = f"it must be from {minimum:g} to {maximum:g} {unit}".rstrip()
            raise ValueError(f"the link says {symbol} = {value[:20]}: {wanted}")


def _check_revision(name: str, title: str, number: str, source: Source) -> None:
    """Raises ValueError for a revision of a bass, by short name and title, that the page does not have."""
    there = revisions_of(source, name)
    if number not in map(str, [*there.get("earlier", ()), there.get("revision")]):
        has = f"has revisions up to {there['revision']}" if there else "has no revisions"
        raise ValueError(f"the link is of revision {number[:9]} of {title}, which {has} on this page")
