"""The public names of livebass and where each is defined; read by `__init__.py`, which loads them lazily, and mypy."""

from .analysis.motion import Solved as Solved
from .analysis.motion import decay_rates as decay_rates
from .analysis.motion import string_shape as string_shape
from .analysis.motion import t60 as t60
from .analysis.sound import Contactogram as Contactogram
from .analysis.sound import Pitch as Pitch
from .analysis.sound import Spectrogram as Spectrogram
from .analysis.sound import characteristic_frequencies as characteristic_frequencies
from .analysis.sound import contactogram as contactogram
from .analysis.sound import fundamental as fundamental
from .analysis.sound import loudness as loudness
from .analysis.sound import relative_variation as relative_variation
from .analysis.sound import resampled as resampled
from .analysis.sound import spectrogram_db as spectrogram_db
from .engine.engine import Engine as Engine
from .engine.render import RenderReport as RenderReport
from .engine.render import render_to_array as render_to_array
from .engine.render import render_to_file as render_to_file
from .experiment.simulate import simulate as simulate
from .experiment.sweep import Sweep as Sweep
from .experiment.sweep import sweep as sweep
from .files import OutputError as OutputError
from .identification.identify import identify as identify
from .identification.result import Identified as Identified
from .model.instrument import Instrument as Instrument
from .model.quality import QUALITIES as QUALITIES
from .model.quality import Quality as Quality
from .model.quality import quality_with as quality_with
from .preset.load import load_preset as load_preset
from .preset.load import preset_names as preset_names
from .preset.source import PresetError as PresetError
from .score.phrases import demo_score as demo_score
from .score.reading import ScoreError as ScoreError
from .score.reading import read_score as read_score
from .score.score import Score as Score
from .score.score import score_of as score_of
from .score.score import single_note as single_note
from .tab.reading import read_tab as read_tab

__version__: str
