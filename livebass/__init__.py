"""A physical-model electric bass whose strings hit their frets.

    import livebass
    bass = livebass.load_preset("jazz-finger")                      # or a path to a TOML file
    score = livebass.read_score("song.mid", rate=48000)             # or livebass.single_note(...)
    sound = livebass.render_to_array(bass, score, livebass.QUALITIES["studio"])

`sound` is float64 of shape (n_strings, n_frames), lowest string first, full scale 1; its sum over strings is
what `render_to_file` writes. Units are SI throughout (m, s, Hz, kg/m, N); pitches are MIDI note numbers
(C4 is 60); times in a `Score` are sample frames at its `rate`. Bad data raise ValueError (PresetError,
ScoreError) and files that cannot be written OutputError, an OSError, each with one line that says what is
allowed.

    preset_names() -> list[str]                    the basses that come along
    load_preset(name_or_path) -> Instrument        strings, necks, pickups, player
    read_score(path, rate, channel="auto") -> Score
    single_note(note, velocity, duration, rate) -> Score
    score_of([(start_s, length_s, note, velocity), ...], rate) -> Score
    demo_score(rate, style="finger") -> Score      "finger" or "slap"
    quality_with("studio", modes=None, contact_rate=None) -> Quality
    render_to_array(instrument, score, quality, tail=None, seed=0) -> (n_strings, n_frames)
    render_to_file(instrument, score, path, quality=..., rate=..., ...) -> RenderReport
    Engine(instrument, quality, rate, seed=0)      .play(score, tail) yields (n_strings, n_block) arrays
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from livebass.engine.engine import Engine
    from livebass.engine.render import RenderReport, render_to_array, render_to_file
    from livebass.files import OutputError
    from livebass.model.instrument import Instrument
    from livebass.model.quality import QUALITIES, Quality, quality_with
    from livebass.preset.load import PresetError, load_preset, preset_names
    from livebass.score import Score, ScoreError, demo_score, read_score, score_of, single_note

__version__ = "0.1.0"

# Loaded when asked for: numba alone takes half a second that `livebass --help` need not wait for.
_HOMES = {
    "files": ("OutputError",),
    "engine.engine": ("Engine",),
    "model.instrument": ("Instrument",),
    "preset.build": ("PresetError",),
    "preset.load": ("load_preset", "preset_names"),
    "model.quality": ("QUALITIES", "Quality", "quality_with"),
    "engine.render": ("RenderReport", "render_to_array", "render_to_file"),
    "score": ("Score", "ScoreError", "demo_score", "read_score", "score_of", "single_note"),
}
__all__ = [
    "QUALITIES", "Engine", "Instrument", "OutputError", "PresetError", "Quality", "RenderReport", "Score",
    "ScoreError", "demo_score", "load_preset", "preset_names", "quality_with", "read_score",
    "render_to_array", "render_to_file", "score_of", "single_note",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"livebass.{module}"), name)
    raise AttributeError(f"module 'livebass' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
