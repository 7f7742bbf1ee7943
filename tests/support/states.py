"""States that hosts of CLAP and VST3 keep, for tests that read and change them."""

from __future__ import annotations

import base64
from collections.abc import Mapping

from livebass.live.parameters import PARAMETERS
from livebass.plugin.state import PROCESSOR, seal

Words = dict[str, dict[str, str]]  # by section ("": the head) and name


def read(state: bytes) -> Words:
    """The words of a state."""
    found: Words = {"": {}}
    section = ""
    for line in state.decode().splitlines()[1:-1]:
        if line.startswith("["):
            section = line.strip("[]")
            found.setdefault(section, {})
        elif line:
            name, _, value = line.partition(" = ")
            found[section][name] = value
    return found


def state_of(words: Words) -> bytes:
    """The state with these words."""
    text = "# A state of livebass\n"
    for section, rows in words.items():
        text += f"\n[{section}]\n" if section else ""
        text += "".join(f"{name} = {value}\n" for name, value in rows.items())
    return seal(text)


def bass_of(state: bytes) -> str:
    return read(state)[""]["bass"].strip('"')


def file_of(state: bytes, section: str) -> bytes:
    """The response or the instrument that a state keeps; b"": none."""
    return base64.b64decode(read(state).get(section, {}).get("file", '""').strip('"'))


def with_file(state: bytes, section: str, file: bytes) -> bytes:
    """A state that keeps another response or instrument."""
    words = read(state)
    words[section] = {"file": f'"{base64.b64encode(file).decode()}"'}
    return state_of(words)


def values_of(state: bytes, aside: bool = False) -> dict[str, float]:
    """The values of the side that plays, or of the other one, and the processor's, by symbol."""
    words = read(state)
    side = "AB".replace(words[""]["side"].strip('"'), "") if aside else words[""]["side"].strip('"')
    return {name: float(value) for name, value in (words[side] | words["processor"]).items()}


def without_instrument(state: bytes) -> bytes:
    """A state that names its bass and does not keep it, as factory presets."""
    return state_of({section: rows for section, rows in read(state).items() if section != "instrument"})


def with_sides(state: bytes, side: int, aside: Mapping[int, float]) -> bytes:
    """A state with other values, by parameter number, on the side that does not play."""
    words = read(state)
    before = words[""]["side"].strip('"')
    other = "AB".replace(before, "")
    if "AB"[side] != before:
        words[before], words[other] = words[other], words[before]
        words[""]["side"] = f'"{"AB"[side]}"'
        other = before
    for number, value in aside.items():
        words[other][PARAMETERS[number].symbol] = f"{value:.17g}"
    return state_of(words)


def with_fewer(state: bytes, parameters: int) -> bytes:
    """A state of a plugin that has only the first parameters."""
    words = read(state)
    for p in PARAMETERS[parameters:]:
        if p.symbol == "bass":
            continue
        for section in ("processor",) if p.group == PROCESSOR else ("A", "B"):
            del words[section][p.symbol]
    return state_of(words)


def with_learned(state: bytes, learned: Mapping[int, int]) -> bytes:
    """A state with the parameters, by number, that controllers have learned."""
    words = read(state)
    words["controllers"] = {str(k): f'"{PARAMETERS[number].symbol}"' for k, number in sorted(learned.items())}
    return state_of(words)
