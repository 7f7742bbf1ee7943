"""Writes an LV2 bundle: the binary, instrument files, and Turtle files that describe plugin and presets to hosts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from livebass import __version__
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.live.parameters import GROUPS, OUTPUTS, PARAMETERS
from livebass.live.thread.look import LOOK
from livebass.model.instrument import Instrument
from livebass.plugin.bundle import LIST, SOUNDS, checked_name, distinct_titles, with_name, write_bundle_of, write_files
from livebass.plugin.instrument import ENDING, OLD_ENDING
from livebass.plugin.systems import SYSTEMS, System
from livebass.preset.sounds import sound_title, sound_values, sounds_of
from livebass.rows.techniques import SLIDER_ROWS, event

URI = "urn:livebass:bass"
STRINGS = "urn:livebass:bass-strings"  # with one output per string
TURTLE, PRESETS, MANIFEST = "livebass.ttl", "presets.ttl", "manifest.ttl"
PREFIXES = {
    "atom": "http://lv2plug.in/ns/ext/atom#",
    "doap": "http://usefulinc.com/ns/doap#",
    "lv2": "http://lv2plug.in/ns/lv2core#",
    "log": "http://lv2plug.in/ns/ext/log#",
    "midnam": "http://ardour.org/lv2/midnam#",
    "midi": "http://lv2plug.in/ns/ext/midi#",
    "foaf": "http://xmlns.com/foaf/0.1/",
    "owl": "http://www.w3.org/2002/07/owl#",
    "pg": "http://lv2plug.in/ns/ext/port-groups#",
    "pprops": "http://lv2plug.in/ns/ext/port-props#",
    "pset": "http://lv2plug.in/ns/ext/presets#",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "rdfs": "http://www.w3.org/2000/01/rdf-schema#",
    "state": "http://lv2plug.in/ns/ext/state#",
    "rsz": "http://lv2plug.in/ns/ext/resize-port#",
    "ui": "http://lv2plug.in/ns/extensions/ui#",
    "units": "http://lv2plug.in/ns/extensions/units#",
    "urid": "http://lv2plug.in/ns/ext/urid#",
    "work": "http://lv2plug.in/ns/ext/worker#",
    "xsd": "http://www.w3.org/2001/XMLSchema#",
}
HEAD = "".join(f"@prefix {name}: <{uri}> .\n" for name, uri in PREFIXES.items())


# Properties that states hold besides the ports.
KEPT = "".join(
    f'\n<{URI}#{key}> a rdf:Property , owl:DatatypeProperty ; rdfs:label "{label}" ; rdfs:range xsd:{kind} .\n'
    for key, label, kind in (
        ("bass", "Name of the bass", "string"),
        ("quality", "Quality", "long"),
        ("format", "Number of the state's format", "long"),
        ("made", "Version of livebass that made the state", "string"),
        ("instrument", "The bass itself", "base64Binary"),
        ("seed", "Seed of the player's unevenness", "long"),
        ("side", "A (0) or B (1) counts", "long"),
        ("technique", "Stroke, if a key has chosen it", "float"),
        ("response", "Impulse response, with its samples", "base64Binary"),
        *(
            (f"aside-{p.symbol}", f"{p.name}, of the other side", "float")
            for p in PARAMETERS
            if p.symbol != "bass" and p.group != "Processor"
        ),
    )
)
# Ardour's extension, which validators do not know
MIDNAM = "\nmidnam:interface a lv2:ExtensionData .\nmidnam:update a lv2:Feature .\n"
GROUPS_OF_PORTS = "".join(
    f'\n<{URI}#group-{name.lower()}> a pg:Group , pg:InputGroup ; lv2:symbol "{name.lower()}" ; lv2:name "{name}" .\n'
    for name in GROUPS
)
PROJECT = (
    '\n<urn:livebass:project> a doap:Project ; doap:name "livebass" ;'
    ' doap:maintainer [ a foaf:Organization ; foaf:name "livebass" ] .\n'
)
UNITS = {
    "dB": "units:db", "semitones": "units:semitone12TET", "mm": "units:mm", "%": "units:pc", "deg": "units:degree",
    "Hz": "units:hz", "ms": "units:ms",
    **{
        unit: f'[ a units:Unit ; rdfs:label "{unit}" ; units:symbol "{unit}" ; units:render "%f {unit}" ]'
        for unit in ("1/s", "pF")
    },
}  # fmt: skip
WINDOWS = {"so": "X11UI", "dylib": "CocoaUI", "dll": "WindowsUI"}  # by library extension
ROOM = 256  # bytes around a look
WINDOW = f"""
<{URI}#ui> lv2:requiredFeature urid:map , ui:idleInterface ; lv2:optionalFeature ui:parent , ui:resize , ui:touch ;
  lv2:extensionData ui:idleInterface , ui:resize ;
  ui:portNotification {
    " , ".join(f'[ ui:plugin <{uri}> ; lv2:symbol "look" ; ui:protocol atom:eventTransfer ]' for uri in (URI, STRINGS))
} .
"""
PLUGINS = {URI: ("Out",), STRINGS: OUTPUTS}  # names of their outputs


def controls(titles: Sequence[str], quality: int) -> list[str]:
    """Returns the control ports in Turtle, without index, for basses of these titles; `quality` is the first bass's."""
    ports = []
    for p in PARAMETERS:
        names = tuple(titles) if p.symbol == "bass" else p.points
        more = f" ; units:unit {UNITS[p.unit]}" if p.unit else ""
        properties = [
            *(["lv2:integer"] if p.whole else []),
            *(["lv2:enumeration"] if names else []),
            *(["pprops:notAutomatic"] if event(p) is None and p.symbol not in SLIDER_ROWS else []),
            *(["pprops:expensive"] if p.symbol in SLIDER_ROWS else []),
        ]
        more += f" ; lv2:portProperty {' , '.join(properties)}" if properties else ""
        if names:
            points = " , ".join(f"[ rdfs:label {quote(name)} ; rdf:value {k} ]" for k, name in enumerate(names))
            more += f" ; lv2:scalePoint {points}"
        more += f" ; pg:group <{URI}#group-{p.group.lower()}>"
        default = quality if p.symbol == "quality" else p.default
        ports.append(_control(p.symbol, p.name, default, p.minimum, p.maximum) + more)
    toggled = " ; lv2:portProperty lv2:integer , lv2:toggled , pprops:notOnGUI ; lv2:designation lv2:freeWheeling"
    overload = _control("overload", "Overload", 0, 0, MAX_STRINGS).replace("InputPort", "OutputPort")
    return [
        *ports,
        _control("freewheeling", "Freewheeling", 0, 0, 1) + toggled,
        f"{overload} ; lv2:portProperty lv2:integer",
    ]


def _control(symbol: str, name: str, default: float, minimum: float, maximum: float) -> str:
    limits = f"lv2:default {default:g} ; lv2:minimum {minimum:g} ; lv2:maximum {maximum:g}"
    return f'a lv2:InputPort , lv2:ControlPort ; lv2:symbol "{symbol}" ; lv2:name "{name}" ; {limits}'


def bundle_files(
    basses: dict[str, Instrument], instruments: dict[str, bytes], code: bytes, system: System
) -> dict[str, bytes]:
    """Returns the files of a bundle, as `clap.bundle_files` does."""
    titles = distinct_titles(basses)
    qualities = [" " in line for line in instruments[LIST].decode().splitlines()]  # 1: studio
    rows = [(uri, short, titles[k], k, qualities[k]) for uri in PLUGINS for k, short in enumerate(basses)]
    return instruments | {
        binary_name(system): code,
        TURTLE: (
            HEAD
            + KEPT
            + MIDNAM
            + GROUPS_OF_PORTS
            + PROJECT
            + WINDOW
            + "".join(plugin(uri, titles, qualities[0]) for uri in PLUGINS)
        ).encode(),
        PRESETS: (HEAD + "".join([*(preset(*row) for row in rows), *(sound(*row) for row in rows)])).encode(),
        MANIFEST: (HEAD + manifest(list(basses), binary_name(system))).encode(),
    }


def is_bundle(entries: list[Path]) -> bool:
    """True if these are the entries of a bundle that this module wrote: they may be replaced."""
    names, always = {entry.name for entry in entries} - {SOUNDS}, {LIST, TURTLE, PRESETS, MANIFEST}
    binaries = {binary_name(system) for system in SYSTEMS.values()}
    return always <= names and all(name in always | binaries or name.endswith((ENDING, OLD_ENDING)) for name in names)


write_bundle = partial(write_bundle_of, bundle_files, is_bundle)


def binary_name(system: System) -> str:
    """Names the binary in a bundle for `system`."""
    return f"livebass.{system.ending}"


def quote(text: str) -> str:
    """Returns `text` as a Turtle string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'


def plugin(uri: str, titles: Sequence[str], quality: int) -> str:
    """Describes a plugin whose bundle has basses of these titles and which begins in this quality."""
    strings = uri == STRINGS
    ports = [
        'a lv2:InputPort , atom:AtomPort ; lv2:symbol "midi" ; lv2:name "MIDI" ;'
        " atom:bufferType atom:Sequence ; atom:supports midi:MidiEvent ; lv2:designation lv2:control",
        *(
            "a lv2:OutputPort , lv2:AudioPort ; "
            + f'lv2:symbol "{f"string_{k}" if strings else "out"}" ; lv2:name {quote(name)}'
            for k, name in enumerate(PLUGINS[uri], 1)
        ),
        *controls(titles, quality),
        'a lv2:OutputPort , atom:AtomPort ; lv2:symbol "look" ; lv2:name "Look" ; atom:bufferType atom:Sequence ;'
        f" rsz:minimumSize {LOOK.itemsize + ROOM} ; lv2:portProperty lv2:connectionOptional , pprops:notOnGUI",
    ]
    described = " ,\n    ".join(f"[ lv2:index {index} ; {port} ]" for index, port in enumerate(ports))
    _, minor, micro = (int(part) for part in __version__.split(".")[:3])
    return f"""
<{uri}> a lv2:Plugin , lv2:InstrumentPlugin ;
  doap:name "livebass{" strings" if strings else ""}" ; doap:license <https://spdx.org/licenses/MIT> ;
  lv2:project <urn:livebass:project> ;
  lv2:minorVersion {2 * minor} ; lv2:microVersion {micro} ;
  lv2:requiredFeature urid:map ; lv2:optionalFeature lv2:hardRTCapable , work:schedule , log:log , midnam:update ;
  lv2:extensionData state:interface , work:interface , midnam:interface ;
  ui:ui <{URI}#ui> ;
  lv2:port {described} .
"""


def preset(uri: str, short: str, title: str, number: int | None = None, quality: int = 0) -> str:
    """Returns a preset: the bass `short`, with default parameters; `number` is its index in the bundle."""
    return describe_preset(uri, short, title, {"quality": quality} | ({} if number is None else {"bass": number}))


def sound(uri: str, short: str, _title: str, number: int, quality: int) -> str:
    """Returns the factory sounds of the bass `short` as presets."""
    return "".join(
        describe_preset(uri, short, sound_title(name), {"quality": quality, "bass": number, **sound_values(name)}, name)
        for name in sounds_of(short)
    )


def describe_preset(uri: str, short: str, title: str, given: Mapping[str, float], name: str = "") -> str:
    """Returns a preset of the bass `short` with the `given` values; `name`: the factory sound that it is, if any."""
    values = {p.symbol: p.default for p in PARAMETERS if p.symbol != "bass"} | dict(given)
    quality = int(values["quality"])
    ports = " , ".join(f'[ lv2:symbol "{symbol}" ; pset:value {value:g} ]' for symbol, value in values.items())
    kept = f'<{URI}#bass> {quote(short)} ; <{URI}#quality> "{quality:d}"^^xsd:long'
    place = f"sound-{name}" if name else f"preset-{short}"
    return f"""
<{uri}#{place}> a pset:Preset ; lv2:appliesTo <{uri}> ; rdfs:label {quote(title)} ;
  lv2:port {ports} ;
  state:state [ {kept} ] .
"""


def manifest(shorts: Sequence[str], binary: str | None = None) -> str:
    """Returns the manifest of a bundle with presets for these basses, and with the plugins if there is a `binary`."""
    made = ""
    if binary:
        kind = WINDOWS[binary.rpartition(".")[2]]
        made += f"\n<{URI}#ui> a ui:{kind} ; lv2:binary <{binary}> ; ui:binary <{binary}> ; rdfs:seeAlso <{TURTLE}> .\n"
    for uri in PLUGINS:
        if binary:
            made += f"\n<{uri}> a lv2:Plugin ; lv2:binary <{binary}> ; rdfs:seeAlso <{TURTLE}> .\n"
        sounds = [f"sound-{name}" for short in shorts for name in sounds_of(short) if binary]
        for place in [*(f"preset-{short}" for short in shorts), *sounds]:
            made += f"<{uri}#{place}> a pset:Preset ; lv2:appliesTo <{uri}> ; rdfs:seeAlso <{PRESETS}> .\n"
    return made


def write_preset(short: str, title: str, folder: Path) -> None:
    """Writes a bundle with a preset alone, which puts a bass from the user's folder into hosts' preset menus.

    Written to ~/.lv2/livebass-SHORT.lv2, it makes an instrument file from `export instrument` appear in Ardour and
    jalv. The short name is included because others may have the same title. Raises ValueError for an unsuitable name,
    OutputError.
    """
    checked_name(short)
    files = {
        PRESETS: (HEAD + "".join(preset(uri, short, with_name(title, short)) for uri in PLUGINS)).encode(),
        MANIFEST: (HEAD + manifest([short])).encode(),
    }
    write_files(folder, files, lambda entries: {entry.name for entry in entries} == set(files))
