"""A physical-model electric bass whose strings hit their frets.

    import livebass
    bass = livebass.load_preset("jazz-finger")                      # or a path to a TOML file
    score = livebass.read_score("song.mid", rate=48000)             # or livebass.single_note(...)
    sound = livebass.render_to_array(bass, score, livebass.QUALITIES["studio"])

`sound` is float64 of shape (n_strings, n_frames), lowest string first, full scale 1; its sum over strings is
what `render_to_file` writes. Units are SI throughout (m, s, Hz, kg/m, N); pitches are MIDI note numbers
(C4 is 60); times in a `Score` are sample frames at its `rate`. Bad data raise ValueError (PresetError,
ScoreError), a file that cannot be written raises OutputError, an OSError; each message is one line that says
what is allowed.

    preset_names() -> list[str]                    the basses that come with livebass
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

from lazy_loader import attach_stub

__version__ = "0.1.0"

# __init__.pyi is the one list of public names. Each is imported at its first use: numba alone takes half a second,
# which `livebass --help` need not wait for.
__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
