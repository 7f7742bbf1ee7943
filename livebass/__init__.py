"""A physical-model electric bass whose strings hit their frets.

    import livebass
    bass = livebass.load_preset("jazz-finger")                      # or a path to a TOML file
    score = livebass.read_score("song.mid", rate=48000)             # or livebass.single_note(...)
    sound = livebass.render_to_array(bass, score, livebass.QUALITIES["studio"])

`sound` is float64 of shape (n_strings, n_frames), lowest string first, full scale 1; `render_to_file` writes its
sum over strings. Units are SI; pitches are MIDI note numbers (C4 is 60); times in a `Score` are frames at its
`rate`. Bad values raise ValueError (PresetError, ScoreError ...), an unwritable file OutputError, an OSError;
messages are one line and say what is allowed. Nothing prints or exits. For more, see help(livebass.NAME).

    preset_names()  load_preset(name_or_path) -> Instrument         strings, necks, pickups, player
                    load_preset(..., tuning="drop-d", capo=2, a4=442, temperament="just")
    read_score(path, rate, channel="auto") -> Score                 or demo_score(rate, "finger" or "slap")
    read_tab(path, rate, track="", bars=None, ...) -> (Instrument, Score)       Guitar Pro, MusicXML
    single_note(note, velocity, duration, rate) -> Score    score_of([(start_s, length_s, note, velocity)], rate)
    QUALITIES  quality_with("studio", modes=None, contact_rate=None) -> Quality
    render_to_array(instrument, score, quality, ...) -> (n_strings, n_frames)
    render_to_file(instrument, score, path, quality=..., rate=..., ...) -> RenderReport
    Engine(instrument, quality, rate, seed=0)                       .play(score) yields (n_strings, n_block)
    simulate(instrument, string="G", apex=3.6e-3, ...) -> Solved    one pluck: motion, contacts, energies
    sweep(preset, "pluck.apex=1mm:7mm:13", ...) -> Sweep            .values("contacts"), .table()
    identify("g-string.wav", instrument, ...) -> Identified         partials and law of a recorded string
    fit(["my-bass"], Fit(trials=600)) -> Fitted                     fitted_preset(fitted, "mine.toml") is its text
    compare(["my-bass"], ["slap"]) -> Comparison                    check_claims() -> [ClaimResult]  bench_latency()
    export_plugin("vst3", {"slap": bass}, folder)                   export_page({"slap": bass}, folder)
    export_sfz(bass, folder, name, PackSettings(...)) -> PackReport

For sounds (n,), float, and motions:

    fundamental(sound, rate) -> Pitch                               over time, by YIN
    spectrogram_db(sound, rate) -> Spectrogram                      characteristic_frequencies(sound, rate), Hz
    resample(sound, rate, to)    loudness(sound, rate), LUFS       relative_variation(frequencies, reference)
    contactogram(times, indices, frets) -> Contactogram             string_shape(speaking, q, x), m
    decay_rates(times, energies), 1/s                               t60(dampings), s
"""

from lazy_loader import attach_stub

__version__ = "0.1.0"

# __init__.pyi alone lists the public names. Each is imported at its first use: `livebass --help` need not wait for
# numpy and the rest.
__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
