"""A user's program with every public name, which mypy checks: tools/check against the checkout, a test against a wheel.

Nobody runs it. Each result goes to a variable with the type that the documentation promises.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import livebass

Floats = NDArray[np.float64]

names: list[str] = livebass.preset_names()
bass: livebass.Instrument = livebass.load_preset("slap@1", tuning="drop-d", capo=2, a4=442, temperament="just")
qualities: dict[str, livebass.Quality] = livebass.QUALITIES
quality: livebass.Quality = livebass.quality_with("studio", modes=64, contact_rate=2e6)

score: livebass.Score = livebass.read_score(Path("song.mid"), 48000, "all")
scores: list[livebass.Score] = [
    livebass.demo_score(48000, "slap"),
    livebass.single_note(28, 100, 0.5, 48000),
    livebass.score_of([(0.0, 0.5, 28, 100)], 48000, bends=[(0.1, 0.5)], controls=[(0.0, 1, 64)]),
]
tab_bass, tab_score = livebass.read_tab("song.gp5", 48000, track="Bass", bars=range(4), tuning="drop-d")
scores.append(tab_score)

sound: Floats = livebass.render_to_array(bass, score, quality, tail=0.5, seed=1, basses={36: tab_bass})
report: livebass.RenderReport = livebass.render_to_file(
    bass, score, "song.flac", quality=quality, rate=48000, stems=True, normalize=-16.0, progress=print
)
written: tuple[Path, ...] = report.files
engine: livebass.Engine = livebass.Engine(bass, quality, 48000, seed=1, workers=2)
engine.send(np.array([0]), np.array([[0x90, 28, 100]], np.uint8))
block: Floats = engine.process(64)
blocks: list[Floats] = list(engine.play(score, tail=0.0)) if engine.sounding() else []

moved: livebass.Solved = livebass.simulate(bass, string="E", fret=3, apex=2e-3, at=0.5, quality=qualities["live"])
motion: Floats = moved.displacement()
times, modes, energy = moved.energies()
shape: Floats = livebass.string_shape(moved.speaking, [1e-3, 0.0], [0.0, 0.4])
decays: Floats = livebass.decay_rates(times, modes)
lasting: Floats = livebass.t60(decays)
swept: livebass.Sweep = livebass.sweep("slap", ["pluck.apex=1mm:2mm:3", "pluck.fret=0:2:3"], workers=2, progress=print)
contacts: Floats = swept.values("contacts")
table: str = swept.table()
found: livebass.Identified = livebass.identify(["e1.wav", Path("e2.wav")], bass, string="E", note=28, duration=2.0)

pitch: livebass.Pitch = livebass.fundamental(sound[0], 48000, hop=0.01)
picture: livebass.Spectrogram = livebass.spectrogram_db(sound[0], 48000, range_db=60.0)
centre: Floats = livebass.characteristic_frequencies(livebass.resample(sound[0], 48000), 51_200)
variation: Floats = livebass.relative_variation(pitch.frequency_hz, 41.2)
level: float = livebass.loudness(sound.sum(0), 48000)
touched: livebass.Contactogram = livebass.contactogram([0.1, 0.2], [0, 1], [5, 6])

compared: livebass.Comparison = livebass.compare(["recordings"], ["slap"], technique="slap", quality="live", takes=1)
fitted: livebass.Fitted = livebass.fit(
    ["recordings"], livebass.Fit(like="slap", trials=100), directory="fit", say=print
)
toml: str = livebass.fitted_preset(fitted, "mine.toml")
plugin: Path = livebass.export_plugin("vst3", {"slap": bass}, "plugins", system="windows-x86_64")
page: Path = livebass.export_page({"slap": bass}, "page", single=True)
pack: livebass.PackReport = livebass.export_sfz(bass, "pack", "slap", livebass.PackSettings(quality, layers=3), print)
claims: list[livebass.ClaimResult] = livebass.check_claims(["4.1"], plucks=0)
passed: bool = all(claim.passed for claim in claims)
latency = livebass.bench_latency(print)
rows = latency["rows"]

try:
    livebass.load_preset("mine.toml")
except livebass.PresetError as error:
    print(error)
try:
    livebass.read_score("mine.mid", 48000)
except (livebass.ScoreError, livebass.OutputError) as error:
    print(error)
