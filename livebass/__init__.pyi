"""The public names of livebass and where each is defined; read by `__init__.py`, which loads them lazily, and mypy."""

from .engine.engine import Engine as Engine
from .engine.render import RenderReport as RenderReport
from .engine.render import render_to_array as render_to_array
from .engine.render import render_to_file as render_to_file
from .files import OutputError as OutputError
from .model.instrument import Instrument as Instrument
from .model.quality import QUALITIES as QUALITIES
from .model.quality import Quality as Quality
from .model.quality import quality_with as quality_with
from .preset.build import PresetError as PresetError
from .preset.load import load_preset as load_preset
from .preset.load import preset_names as preset_names
from .score import Score as Score
from .score import ScoreError as ScoreError
from .score import demo_score as demo_score
from .score import read_score as read_score
from .score import score_of as score_of
from .score import single_note as single_note

__version__: str
