"""Writes kernels.h, which describes the kernels to the plugins' C code, from the records and entries themselves.

Each record becomes a struct, with assertions that C lays it out as numpy does. Each entry that the plugins call becomes
a member of `lb_kernels`; each processor level has its own table of entries.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import numpy as np

from livebass import __version__
from livebass.compiling import SMALL, Entry, emitter
from livebass.files.formats import FORMATS
from livebass.files.kinds import MIDI_ENDINGS
from livebass.kernels.bass import bench, change, check, instrument, kept, pool
from livebass.kernels.bass import setup as bass
from livebass.kernels.effects import records as effects
from livebass.kernels.effects import response
from livebass.kernels.pickup import coil
from livebass.kernels.player import constants, parameters, performer, words
from livebass.kernels.player.touches import KEY_PALM
from livebass.kernels.score import choosing, lines, low_keys, memory, reading, remarks, smf
from livebass.kernels.score import records as score_records
from livebass.kernels.string import board, frets, note, preparing, records
from livebass.live import priority
from livebass.live.parameters import GROUPS, OUTPUTS, PARAMETERS
from livebass.live.thread import ahead, block, desk, helpers, look, ring, setup, sight
from livebass.live.thread import records as live
from livebass.model.keymap import KEYS
from livebass.plugin import names, state
from livebass.preset.programs import PROGRAMS
from livebass.rows import techniques
from livebass.rows.techniques import (
    FRETS,
    HAND_AT,
    ON_STRING,
    PALM,
    PARAMETER_ROWS,
    RENAMED,
    SLIDER_ROWS,
    STROKE_OF,
    TECHNIQUE,
    TECHNIQUE_ROWS,
    event,
)
from livebass.rows.units import note_name, pitch_name
from livebass.score import tracknames
from livebass.score.reading import TAKE
from livebass.score.sentences import CHOICE, ERRORS, NO_BASS, REMARKS, TOO_MUCH

# Records that others contain come first.
RECORDS = {
    "LB_TIER": instrument.TIER,
    "LB_CIRCUIT": coil.CIRCUIT,
    "LB_PLAYER": constants.PLAYER,
    "LB_KEY_MAP": constants.KEY_MAP,
    "LB_STROKE": constants.STROKE,
    "LB_INSTRUMENT": instrument.INSTRUMENT,
    "LB_FILE": instrument.FILE,
    "LB_OPERATOR": records.OPERATOR,
    "LB_NOTE": preparing.NOTE,
    "LB_PREPARING": preparing.PREPARING,
    "LB_POOL": pool.POOL,
    "LB_BENCH_STRING": bench.BENCH_STRING,
    "LB_BENCH": bench.BENCH,
    "LB_KEPT": kept.KEPT,
    "LB_HEAD": kept.HEAD,
    "LB_CHANGE": change.CHANGE,
    "LB_COIL": coil.COIL,
    "LB_BUILDING": bass.BUILDING,
    "LB_TEAM": live.TEAM,
    "LB_SYNTH": live.SYNTH,
    "LB_SLOT_SIGHT": sight.SLOT_SIGHT,
    "LB_SIGHT": sight.SIGHT,
    "LB_STRING_LOOK": look.STRING_LOOK,
    "LB_LOOK": look.LOOK,
    "LB_DESK": desk.DESK,
    "LB_SCORE_FILE": score_records.FILE,
    "LB_TEXT": score_records.TEXT,
    "LB_REMARK": score_records.REMARK,
    "LB_SMF": score_records.SMF,
    "LB_CLEANING": memory.CLEANING,
    "LB_SCORE": memory.SCORE,
    "LB_LISTED": memory.LISTED,
    "LB_PLAYED": memory.PLAYED,
    "LB_FITTING": low_keys.FITTING,
}
OF_MODULES: tuple[tuple[Any, str], ...] = (
    (instrument, "TIERS LIVE STUDIO COARSE"), (check, "GOOD FOREIGN DAMAGED LATER"), (note, "MADE"),
    (preparing, "DONE"), (performer, "FREE CHANNELS"), (constants, "FINGER PICK POP"), (sight, "SEEN"),
    (look, "PLACES LOGGED"), (live, "RINGS CHUNK MAX_MESSAGES"), (techniques, "MAX_BASSES CC_PLACE"),
    (effects, "LONGEST MIN_RATE MAX_RATE"), (priority, "PRIORITY"),
    (parameters, "MAX_UNEVENNESS"), (words, "VALUE_BIT NUMBER"),
    (memory, "IS_BASS IS_OTHER IS_DRUMS BASS_INSTRUMENT NAMED TRACK_NAME NAMES TOO_LONG"), (choosing, "AUTO"),
    (score_records, "MESSAGES TEMPOS EXCLUSIVES TEXTS REMARKS"), (low_keys, "FITTING_WORDS"),
    (smf, "META_TEXT META_TRACK_NAME META_INSTRUMENT"),
)  # fmt: skip
KINDS = ("NOTE_PLACE", "NOTE_STRING", "NOTE_BEND", "NOTE_VIBRATO", "NOTE_CUT")  # of events in words.py
NUMBERS = {
    **{f"LB_{name}": getattr(module, name) for module, names in OF_MODULES for name in names.split()},
    **{f"LB_KIND_{name}": getattr(words, name) for name in KINDS},
    **{f"LB_STEP_{name}": number for name, number in names.STEPS.items()},
    **{f"LB_REMARK_{name}": getattr(remarks, name) for name in ("CALLED", "ONLY_PART", "LOWEST_PART", "DOUBLES")},
    "LB_MIN_GAME": tracknames.MIN_GAME,
    "LB_GAME_REFUSAL": json.dumps(tracknames.GAME_REFUSAL),
    "LB_TAKE": json.dumps(TAKE),
    "LB_MIDI_ENDINGS": ", ".join(map(json.dumps, MIDI_ENDINGS)),
    "LB_NO_BASS": json.dumps(NO_BASS),
    "LB_MAX_HOURS": lines.LONGEST // 3600,
    "LB_TOO_MUCH": json.dumps(TOO_MUCH),
    "LB_TOP_KEYS": techniques.TOP_KEYS,
    "LB_KEY_COUNT": KEYS,
    "LB_STRINGS": performer.MAX_STRINGS,
    "LB_SLOTS": records.VOICE_SLOTS,
    "LB_RESERVED": ", ".join(map(str, techniques.RESERVED)),
    "LB_CONTROLLERS": techniques.CHANNEL_MODES,
    "LB_BUILT": techniques.SLIDERS,
    "LB_STATE_TITLE": json.dumps(state.TITLE),
    "LB_STATE_FORMAT": state.FORMAT,
    "LB_TEXT_FORMAT": FORMATS["link"],
    "LB_GROUPS": len(GROUPS),
    "LB_RELEASE": json.dumps(__version__),
    "LB_MAX_BYTES": preparing.MAX_WORDS * instrument.WORD,
}
WORDS = {  # of names of tracks, as programs
    "bass_words": names.program(tracknames.BASS_WORD),
    "other_words": names.program(tracknames.OTHER_WORD),
    "drum_words": names.program(tracknames.DRUM_WORD),
    "game_track": names.program(tracknames.GAME_TRACK, whole=True),
}
TEXTS = ("symbol", "name", "unit", "group")  # of a parameter
ENTRIES: tuple[Entry, ...] = (
    check.check_file, check.checksum, pool.measure_pool, pool.fill_pool, bass.measure_bass,
    bass.fill_bass, setup.ring_bytes, setup.fill_synth, ring.push_message, ring.push_event, block.process,
    block.return_to_clock, block.is_still, ahead.play_string, helpers.help_now, helpers.help_out, frets.over_frets,
    board.over_board, look.see_synth, change.measure_change, change.make_change,
    response.cut_response, desk.load_desk, desk.play_desk, smf.measure_smf, smf.fill_smf, reading.measure_lines,
    reading.read_lines, reading.read_parts_of, reading.choose_notes, reading.describe_part, low_keys.leave_switches,
    low_keys.raise_notes,
)  # fmt: skip
C_TYPES = {"i8": "int64_t", "u8": "uint64_t", "f8": "double", "f4": "float", "i4": "int32_t", "u1": "uint8_t"}
C_RESULTS = {"void": "void", "int64": "int64_t", "uint64": "uint64_t", "float64": "double"}


def entries_of(level: str) -> tuple[Entry, ...]:
    """Returns the entries compiled for a processor `level`.

    Entries that run once per bass or message exist only at the lowest level and serve all levels: their results are
    the same bit for bit, because nothing in them is reassociated or contracted.
    """
    return ENTRIES if level == lowest(level) else tuple(entry for entry in ENTRIES if entry.attributes != SMALL)


def lowest(level: str) -> str:
    """Returns the lowest level for the same kind of processor as `level`."""
    machine = emitter.LEVELS[level].machine
    return next(name for name, other in emitter.LEVELS.items() if other.machine == machine)


def suffix(level: str) -> str:
    """Returns the suffix of entry names in code for a processor `level`."""
    return f"_{level.replace('-', '_')}"


def header(levels: Iterable[str]) -> str:
    """Returns the text of kernels.h, with tables of kernels for `levels`."""
    lines = ["/* Written by livebass/plugin/header.py. */", "#ifndef LB_KERNELS_H", "#define LB_KERNELS_H"]
    lines += ["#include <stddef.h>", "#include <stdint.h>"]
    lines += [f"#define {name} {value}" for name, value in NUMBERS.items()]
    lines += _table("char *const lb_groups[LB_GROUPS]", [", ".join(map(json.dumps, GROUPS))])  # of parameters
    lines += _table("char lb_note_names[128][5]", [", ".join(json.dumps(note_name(key)) for key in range(128))])
    lines += _table("char *const lb_outputs[LB_STRINGS]", [", ".join(map(json.dumps, OUTPUTS))])  # one per string
    rows = ", ".join(f"{{{number - 1}, {json.dumps(preset)}}}" for number, preset in PROGRAMS.items())
    lines += ["typedef struct {", "    int number;", "    const char *preset;", "} lb_program;"]
    lines += ["#ifdef LB_TABLES", f"static const lb_program lb_programs[] = {{{rows}}};", "#endif"]
    for name, steps in WORDS.items():
        lines += _table(f"int32_t lb_{name}[{len(steps)}]", [", ".join(map(str, steps))])
    lines += _sentences()
    lines += _switches()
    lines += _parameters()
    for name, record in RECORDS.items():
        lines += _struct(name, record)
    lines += ["typedef struct {", *(f"    {_function(e, f'(*{e.name})')};" for e in ENTRIES), "} lb_kernels;"]
    for level in levels:
        end, own = suffix(level), entries_of(level)
        lines += [f"extern {_function(e, f'lb_{e.name}{end}')};" for e in own]
        members = ", ".join(f"lb_{e.name}{end if e in own else suffix(lowest(level))}" for e in ENTRIES)
        lines += ["#ifdef LB_TABLES", f"static const lb_kernels kernels{end} = {{{members}}};", "#endif"]
    return "\n".join([*lines, "#endif", ""])


def _sentences() -> list[str]:
    """Returns the table of what a MIDI file is, and what of it plays, in words: of two, one for one and for several."""
    rows = []
    for code, form in ({-code: form for code, form in ERRORS.items()} | REMARKS | CHOICE).items():
        one, several = (form, None) if isinstance(form, str) else form
        rows.append(f"    {{{code}, {json.dumps(one)}, {json.dumps(several) if several else 0}}},")
    return [
        f"enum {{ LB_SENTENCES = {len(rows)} }};",
        "typedef struct {", "    int code; /* of a remark; of an error, negative */",
        "    const char *one, *several;", "} lb_sentence;",
        *_table("lb_sentence lb_sentences[LB_SENTENCES]", rows),
    ]  # fmt: skip


def _switches() -> list[str]:
    """Returns the table of key switches: their names, and the parameters that switch the same techniques."""
    values = {
        ON_STRING: {pitch: pitch_name(pitch).replace("#", " sharp") for pitch in range(12)},
        HAND_AT: {fret: str(fret) for fret in range(1, FRETS + 1)},
    }
    rows, names = list[str](), list[str]()
    for row in TECHNIQUE_ROWS.values():
        stroke, parameter = STROKE_OF[row.number], PARAMETER_ROWS.get(row.symbol)
        moved = TECHNIQUE if stroke else parameter.number if parameter else -1
        on = stroke or (KEY_PALM if row.number == PALM else 1)
        for value, called in values.get(row.number, {-1: ""}).items():
            names.append(row.name.format(called))
            rows.append(f"    {{{row.number}, {value}, {moved}, {on}, {json.dumps(names[-1])}}},")
    numbers = ", ".join(f"LB_SWITCH_{symbol.upper()} = {row.number}" for symbol, row in TECHNIQUE_ROWS.items())
    return [
        f"enum {{ {numbers} }}; /* actions */",
        f"enum {{ LB_SWITCHES = {len(rows)} }};",
        "typedef struct {", "    int action, value; /* -1: any */",
        "    int parameter; /* that does the same; -1: none */", "    double on; /* its value then */",
        f"    char name[{longest(names)}];", "} lb_switch;",
        *_table("lb_switch lb_switches[LB_SWITCHES]", rows),
    ]  # fmt: skip


def _parameters() -> list[str]:
    """Returns the table of parameters, and their numbers."""
    lines = ["typedef struct {", *(f"    char {k}[{longest(getattr(p, k) for p in PARAMETERS)}];" for k in TEXTS)]
    lines += ["    const char *help; /* 0: none */"]
    lines += ["    double minimum, maximum, default_value;"]
    lines += ["    int whole;", "    const char *const *points; /* names of the values from 0 on, then 0; or 0 */"]
    lines += ["    int kind, number; /* of the synth's event that sets it; kind -1: none does */"]
    lines += [
        "} lb_parameter;",
        f"enum {{ {', '.join(f'LB_{p.symbol.upper()}' for p in PARAMETERS)}, LB_PARAMETERS }};",
    ]
    renamed = [f"    {{{json.dumps(before)}, {json.dumps(now)}}}," for before, now in RENAMED.items()]
    lines += ["typedef struct { const char *before, *symbol; } lb_rename;"]
    lines += ["static const lb_rename lb_renamed[] = {", *renamed, '    {"", ""},', "};"]
    lines += [f"enum {{ LB_PLAYED_PARAMETERS = {techniques.PARAMETERS} }}; /* those that controllers learn */"]
    rows, points = list[str](), dict[tuple[str, ...], str]()  # points: their names in C
    for p in PARAMETERS:
        named = points.setdefault(p.points, f"lb_points_{p.symbol}") if p.points else "0"
        called = ", ".join(map(json.dumps, (p.symbol, p.name, p.unit, p.group)))
        called += f", {json.dumps(SLIDER_ROWS[p.symbol].help)}" if p.symbol in SLIDER_ROWS else ", 0"
        kind, number = event(p) or (-1, 0)
        limits = f"{float(p.minimum)}, {float(p.maximum)}, {float(p.default)}, {int(p.whole)}"
        rows.append(f"    {{{called}, {limits}, {named}, {kind}, {number}}},")
    sliders = ", ".join(str(row.parameter.number) for row in SLIDER_ROWS.values())
    lines += _table("int lb_sliders[LB_BUILT]", [sliders])  # their parameters
    lists = []
    for texts, name in points.items():
        lists.append(f"static const char *const {name}[] = {{{', '.join(map(json.dumps, texts))}, 0}};")
    return [*lines, *_table("lb_parameter lb_parameters[LB_PARAMETERS]", rows, lists)]


def longest(texts: Iterable[str]) -> int:
    """The bytes for the longest text. Tables hold texts as arrays: a pointer takes 32 bytes of the binary."""
    return max(len(text.encode()) for text in texts) + 1


def _table(declared: str, rows: list[str], before: Iterable[str] = ()) -> list[str]:
    """Returns a table defined once, in core.c, after the definitions `before` that its rows use."""
    made = [*before, f"const {declared} = {{", *rows, "};"]
    return ["#ifdef LB_TABLES", *made, "#else", f"extern const {declared};", "#endif"]


def _struct(name: str, record: np.dtype[np.void]) -> list[str]:
    """Returns a struct, and assertions that its layout matches the record."""
    fields, checks = [], [f'_Static_assert(sizeof({name}) == {record.itemsize}, "{name}");']
    assert record.fields
    for field, (kind, offset, *_) in record.fields.items():
        base, shape = kind.subdtype or (kind, ())
        known = next((other for other, dtype in RECORDS.items() if dtype == base), None) or C_TYPES[base.str[1:]]
        fields.append(f"    {known} {field}{''.join(f'[{n}]' for n in shape)};")
        checks.append(f'_Static_assert(offsetof({name}, {field}) == {offset}, "{name}.{field}");')
    return ["typedef struct {", *fields, f"}} {name};", *checks]


def _function(entry: Entry, name: str) -> str:
    """Returns the declaration of an entry."""
    return f"{C_RESULTS[entry.result]} {name}({', '.join(C_RESULTS[kind] for kind in entry.arguments)})"
