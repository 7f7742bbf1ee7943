"""The settings of a live session, and the figures of one that has ended."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from livebass.live.synth import Meters
from livebass.model.instrument import Instrument
from livebass.model.quality import Quality
from livebass.preset.load import load_preset
from livebass.score.score import Score


@dataclass(frozen=True)
class Settings:
    """The bass of a session, and the devices to play through."""

    instrument: Instrument
    quality: Quality | None  # None: the best for this machine
    preset: str = ""  # the instrument's preset, a name or path, if it has one
    load: Callable[[str], Instrument] = load_preset  # loads each chosen preset
    backend: str = "auto"  # "auto", "portaudio" or "jack"
    audio: int | str | None = None  # PortAudio device
    midi: str | None = None
    rate: int = 48000  # Hz, for PortAudio
    block: int = 128  # frames, for PortAudio and PipeWire
    latency: str | float = "low"  # s, or a PortAudio name
    requested: tuple[str, ...] = ()  # which of "rate", "block" and "latency" the player set
    channel: int = -1  # 0-15; -1: all
    gain: float = 1.0
    record: Path | None = None
    record_midi: Path | None = None
    given: Callable[[str], Mapping[str, str]] = lambda preset: {}  # options that change a preset, for the take
    read: Callable[[int], Score] | None = None  # reads the score at a rate
    programs: Mapping[int, str] = field(default_factory=dict)  # presets that the score's programs choose, from 0
    keyboard: bool = True  # play from the computer keyboard
    midi_if_there: bool = False  # if the port `midi` is missing, play as if none had been named
    client: str = "livebass"  # name of the JACK client
    connect: bool = True  # to JACK's speakers and MIDI sources
    strings: bool = False  # a JACK port for each string, beside the mix
    transport: bool = False  # the score follows JACK's transport
    loop: tuple[float, float] | None = None  # repeated part of the score, s; (0, 0): all
    tempo: float = 1.0  # part of the score's own
    controllers: Mapping[str, int] = field(default_factory=dict)  # learned, by parameter symbol
    learn: tuple[str, ...] = ()  # parameters to learn a controller for
    osc: int | None = None  # UDP port of the control socket; 0: any that is free
    metronome: float = 0.0  # beats per minute; 0: off; FILE of desk.py: the file's
    metronome_port: bool = False  # give it its own JACK port
    tuner: bool = False
    cores: int | None = None  # processor cores that play strings; None: all


@dataclass(frozen=True)
class Summary:
    """The figures of a session that has ended."""

    output: str
    seconds: float
    meters: Meters
    worst: float  # load of a block, relative to its duration
    peak: float  # 1 is full scale
    recorded: tuple[Path, ...]  # the files
    short: str | None  # why the recording is incomplete
    lost: str | None  # the reason, if it ended because the output went away
    dropped: int  # notes that no string could play
    preset: str  # the last one played
    audio: str | None  # the PortAudio device, by a name that only it has
    midi: str | None  # the MIDI port
