"""States of the plugins, as hosts of CLAP and VST3 keep them: texts that c/instance/session.c reads and writes."""

from __future__ import annotations

from collections.abc import Mapping

from livebass import __version__
from livebass.live.parameters import PARAMETERS

TITLE = "# A state of livebass\n"
FORMAT = 1  # of states: a new number is for what older versions must not read
PROCESSOR = "Processor"  # the group of parameters that A and B share


def state_of(bass: str, values: Mapping[str, float]) -> bytes:
    """Returns the state of a new instance that plays `bass`, by short name, with these parameters, by symbol.

    It does not keep the bass itself: the one of that name plays.
    """
    default = {p.symbol: p.default for p in PARAMETERS if p.symbol != "bass"}
    shared = {p.symbol for p in PARAMETERS if p.group == PROCESSOR}
    played = {**default, **values}
    sections = {
        "A": {symbol: value for symbol, value in played.items() if symbol not in shared},
        "B": {symbol: value for symbol, value in default.items() if symbol not in shared},
        "processor": {symbol: value for symbol, value in played.items() if symbol in shared},
    }
    text = f'{TITLE}format = {FORMAT}\nmade = "{__version__}"\nbass = "{bass}"\nseed = 0\nside = "A"\n'
    for name, rows in sections.items():
        text += f"\n[{name}]\n" + "".join(f"{symbol} = {value:.17g}\n" for symbol, value in rows.items())
    return seal(text)


def seal(text: str) -> bytes:
    """The words of a state, followed by their checksum: FNV-1a."""
    total = 0xCBF29CE484222325
    for byte in text.encode():
        total = (total ^ byte) * 0x100000001B3 % (1 << 64)
    return f"{text}sum = {total:016x}\n".encode()
