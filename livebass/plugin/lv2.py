"""Writes an LV2 bundle: the binary, instrument files, and the Turtle by which hosts know the plugin and its presets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from livebass import __version__
from livebass.files import whole_directory
from livebass.model.instrument import Instrument
from livebass.plugin.build import binary
from livebass.plugin.instrument import ENDING, instrument_file
from livebass.plugin.systems import System, this_system

URI = "urn:livebass:bass"
BINARY, LIST, TURTLE, PRESETS, MANIFEST = (
    "livebass.so",
    "instruments.txt",
    "livebass.ttl",
    "presets.ttl",
    "manifest.ttl",
)
MOST_INSTRUMENTS, LONGEST_NAME = 128, 63  # of c/lv2.c
PREFIXES = {
    "atom": "http://lv2plug.in/ns/ext/atom#",
    "doap": "http://usefulinc.com/ns/doap#",
    "lv2": "http://lv2plug.in/ns/lv2core#",
    "log": "http://lv2plug.in/ns/ext/log#",
    "midi": "http://lv2plug.in/ns/ext/midi#",
    "pg": "http://lv2plug.in/ns/ext/port-groups#",
    "pset": "http://lv2plug.in/ns/ext/presets#",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "rdfs": "http://www.w3.org/2000/01/rdf-schema#",
    "state": "http://lv2plug.in/ns/ext/state#",
    "units": "http://lv2plug.in/ns/extensions/units#",
    "urid": "http://lv2plug.in/ns/ext/urid#",
    "work": "http://lv2plug.in/ns/ext/worker#",
    "xsd": "http://www.w3.org/2001/XMLSchema#",
}
HEAD = "".join(f"@prefix {name}: <{uri}> .\n" for name, uri in PREFIXES.items())


@dataclass(frozen=True)
class Control:
    """A control port of c/lv2.c."""

    symbol: str
    name: str
    usual: float
    least: float
    most: float
    more: str = ""  # Turtle
    points: tuple[str, ...] = ()  # names of the values 0, 1 ...


def controls(names: Sequence[str]) -> list[Control]:
    """The control ports, where the basses have these names."""
    listed = "lv2:portProperty lv2:integer, lv2:enumeration"
    return [
        Control("gain", "Gain", 0, -60, 20, "units:unit units:db"),
        Control("instrument", "Instrument", 0, 0, max(1, len(names) - 1), listed, tuple(names)),
        Control("quality", "Quality", 0, 0, 1, listed, ("live", "studio")),
    ]


def write_bundle(basses: dict[str, Instrument], folder: Path, system: System | None = None) -> None:
    """Writes a bundle of `basses`, by short name; the folder appears complete, over an older bundle, or not at all.

    `system`: the one that it is for, None: this one. Raises ValueError for names or basses that do not fit,
    OutputError, BuildError.
    """
    if not 1 <= len(basses) <= MOST_INSTRUMENTS:
        raise ValueError(f"{len(basses)} instruments: allowed are 1 to {MOST_INSTRUMENTS}")
    for name in basses:
        if not 1 <= len(name.encode()) <= LONGEST_NAME or set(name) & set('/\\"<>{}|^`\n\r') or " " in name:
            raise ValueError(f"instrument {name!r}: allowed are 1 to {LONGEST_NAME} letters, digits, - and _")
    files = {f"{name}{ENDING}": instrument_file(bass) for name, bass in basses.items()}
    built = binary(system or this_system())
    with whole_directory(folder, is_bundle) as temporary:
        for name, data in files.items():
            (temporary / name).write_bytes(data)
        (temporary / BINARY).write_bytes(built)
        (temporary / LIST).write_text("".join(f"{name}\n" for name in basses))
        names = {short: bass.name for short, bass in basses.items()}
        (temporary / TURTLE).write_text(HEAD + plugin(list(names.values())))
        (temporary / PRESETS).write_text(HEAD + presets(names))
        (temporary / MANIFEST).write_text(HEAD + manifest(list(names)))


def is_bundle(entries: list[Path]) -> bool:
    """True if these are the entries of a bundle that this file wrote: they may be replaced."""
    names = {entry.name for entry in entries}
    known = {BINARY, LIST, TURTLE, PRESETS, MANIFEST}
    return known <= names and all(name in known or name.endswith(ENDING) for name in names)


def quoted(text: str) -> str:
    """`text` as a string of Turtle."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'


def plugin(names: Sequence[str]) -> str:
    """The description of the plugin."""
    ports = [
        'a lv2:InputPort, atom:AtomPort ; lv2:index 0 ; lv2:symbol "midi" ; lv2:name "MIDI" ;'
        " atom:bufferType atom:Sequence ; atom:supports midi:MidiEvent ; lv2:designation lv2:control",
        'a lv2:OutputPort, lv2:AudioPort ; lv2:index 1 ; lv2:symbol "out" ; lv2:name "Out" ; lv2:designation pg:center',
    ]
    for index, c in enumerate(controls(names), len(ports)):
        points = " , ".join(f"[ rdfs:label {quoted(p)} ; rdf:value {k} ]" for k, p in enumerate(c.points))
        more = "".join(f" ; {text}" for text in (c.more, points and f"lv2:scalePoint {points}") if text)
        ports.append(
            f'a lv2:InputPort, lv2:ControlPort ; lv2:index {index} ; lv2:symbol "{c.symbol}" ; lv2:name "{c.name}" ;'
            f" lv2:default {c.usual:g} ; lv2:minimum {c.least:g} ; lv2:maximum {c.most:g}{more}"
        )
    _, minor, micro = (int(part) for part in __version__.split(".")[:3])
    described = " ,\n    ".join(f"[ {port} ]" for port in ports)
    return f"""
<{URI}> a lv2:Plugin, lv2:InstrumentPlugin ;
  doap:name "livebass" ; doap:license <https://spdx.org/licenses/MIT> ;
  lv2:minorVersion {2 * minor} ; lv2:microVersion {micro} ;
  lv2:requiredFeature urid:map ; lv2:optionalFeature lv2:hardRTCapable, work:schedule, log:log ;
  lv2:extensionData state:interface, work:interface ;
  lv2:port {described} .
"""


def presets(names: dict[str, str]) -> str:
    """The presets: each bass, by its short name."""
    made = ""
    for number, (short, name) in enumerate(names.items()):
        values = {c.symbol: number if c.symbol == "instrument" else c.usual for c in controls(list(names.values()))}
        ports = " , ".join(f'[ lv2:symbol "{symbol}" ; pset:value {value:g} ]' for symbol, value in values.items())
        kept = f'<{URI}#instrument> {quoted(short)} ; <{URI}#quality> "0"^^xsd:long'
        made += f"""
<{URI}#preset-{short}> a pset:Preset ; lv2:appliesTo <{URI}> ; rdfs:label {quoted(name)} ;
  lv2:port {ports} ;
  state:state [ {kept} ] .
"""
    return made


def manifest(shorts: Sequence[str]) -> str:
    """What the bundle has."""
    made = f"\n<{URI}> a lv2:Plugin ; lv2:binary <{BINARY}> ; rdfs:seeAlso <{TURTLE}> .\n"
    for short in shorts:
        made += f"<{URI}#preset-{short}> a pset:Preset ; lv2:appliesTo <{URI}> ; rdfs:seeAlso <{PRESETS}> .\n"
    return made
