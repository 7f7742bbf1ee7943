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
    """The bass that a session plays, and the devices to play through."""

    instrument: Instrument
    quality: Quality | None  # None: the one that the machine carries
    preset: str = ""  # the instrument's name or path as a preset, if it has one
    load: Callable[[str], Instrument] = load_preset  # of each preset that is chosen
    backend: str = "auto"  # "auto", "portaudio" or "jack"
    audio: int | str | None = None  # PortAudio device
    midi: str | None = None
    rate: int = 48000  # Hz, of PortAudio
    block: int = 128  # frames, of PortAudio and PipeWire
    latency: str | float = "low"  # s, or as PortAudio names it
    asked: tuple[str, ...] = ()  # of "rate", "block" and "latency", those that the player has chosen
    channel: int = -1  # 0-15; -1: all
    gain: float = 1.0
    record: Path | None = None
    record_midi: Path | None = None
    given: Callable[[str], Mapping[str, str]] = lambda preset: {}  # the options that change a preset, for the take
    read: Callable[[int], Score] | None = None  # returns the score to play at a rate
    programs: Mapping[int, str] = field(default_factory=dict)  # presets that programs of the score choose, from 0
    keyboard: bool = True  # play from the computer keyboard
    midi_if_there: bool = False  # without the port `midi`, play as if none had been named
    client: str = "livebass"  # name of the JACK client
    connect: bool = True  # to JACK's speakers and MIDI sources
    strings: bool = False  # a JACK port for each string, beside the mix
    transport: bool = False  # the score follows JACK's transport
    loop: tuple[float, float] | None = None  # s of the score, which are repeated; (0, 0): all
    tempo: float = 1.0  # part of the score's own
    controllers: Mapping[str, int] = field(default_factory=dict)  # learned, by the parameter's symbol
    learn: tuple[str, ...] = ()  # parameters to learn a controller for
    osc: int | None = None  # UDP port of the control socket; 0: any that is free
    metronome: float = 0.0  # beats a minute; 0: none
    metronome_port: bool = False  # in a JACK port of its own
    tuner: bool = False
    cores: int | None = None  # of the processor, that play strings; None: as many as there are


@dataclass(frozen=True)
class Summary:
    """The figures of a session that has ended."""

    output: str
    seconds: float
    meters: Meters
    worst: float  # load of a block, part of the time it lasts
    peak: float  # 1 is full scale
    recorded: tuple[Path, ...]  # the files
    short: str | None  # why not all was recorded
    lost: str | None  # the reason, if it ended because the output went away
    dropped: int  # notes that no string could play
    preset: str  # that played last
    audio: str | None  # the PortAudio device, by a name that it alone has
    midi: str | None  # the MIDI port
