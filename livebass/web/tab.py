"""A tablature on the page: the rows that play it, and the strokes that the neck shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from livebass.files.kinds import is_tab
from livebass.model.instrument import Instrument
from livebass.plugin.bundle import instrument_files
from livebass.plugin.instrument import ENDING
from livebass.score.reading import ScoreError
from livebass.tab.perform import HARMONIC
from livebass.tab.reading import Arrangement, TabRequest, arrange
from livebass.web.export import BASSES, bass_data

NODES = {2: 12, 3: 7, 4: 5, 5: 4, 6: 3, 7: 3, 8: 2}  # frets at which a finger touches, by partial of the open string


def tab_data(song: Arrangement, title: str, bass: str) -> dict[str, Any]:
    """Returns the page's data of a tablature that the bass with this short name plays. Times are in s."""
    performance, seconds = song.performance, song.performance.tempos.seconds
    strokes = [
        [
            round(s.time, 4), round(s.end, 4), s.string,
            NODES[s.partial] if s.kind == HARMONIC and s.fret == 0 else s.fret, s.kind,
        ]
        for s in performance.strokes
        if s.fret <= song.bass.frets
    ]  # fmt: skip
    bars = [[round(seconds(begin), 4), number + 1, song.tab.bars[number].name] for begin, number in performance.bars]
    return {
        "title": title,
        "said": song.remark,
        "bass": bass,
        "rows": [[float(performance.tempos.time(tick)), *event] for tick, event in song.rows],
        "strokes": strokes,
        "bars": bars,
        "end": round(seconds(performance.end), 4),
    }


@dataclass
class Opener:
    """Opens tablature for a page that a server serves: adds the basses that play it to the page's `files`."""

    basses: dict[str, Instrument]  # of the page, by short name
    files: dict[str, bytes]
    load: Callable[..., Instrument]
    titles: dict[str, str] = field(default_factory=dict)  # of the added basses

    def open(self, data: bytes, name: str) -> dict[str, Any]:
        """Returns `tab_data` of a file, and the data of its bass. Raises ScoreError, LookupError and ValueError."""
        if not is_tab(data):
            raise ScoreError(f"{name}: is not a tablature")
        song = arrange(data, Path(name), TabRequest(), self.load)
        short = next((known for known, bass in self.basses.items() if bass == song.bass), "")
        if not short:
            short = f"{Path(song.preset).stem}-{len(self.basses) + 1}"
            made = instrument_files({short: song.bass})
            self.files[f"{BASSES}/{short}{ENDING}"] = made[f"{short}{ENDING}"]
            self.basses[short] = song.bass
            self.titles[short] = f"{song.bass.name}, {song.given['tuning']}"
        bass = bass_data(short, song.bass) | {"bench": None, "cases": []}
        return tab_data(song, name, short) | {"shown": bass | {"title": self.titles.get(short, song.bass.name)}}
