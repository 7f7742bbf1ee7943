"""Instrument files outlive versions: fields are found by name, and what another version wrote is played or refused."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.command import module_paths, python_output
from support.kept import Refused, image_made, read_kept
from support.own_basses import load_preset

from livebass.engine.image import image_of, seal
from livebass.kernels.bass.check import DAMAGED, FOREIGN, LATER
from livebass.kernels.bass.instrument import WORD
from livebass.kernels.bass.kept import FIELDS, FORMAT, HEAD, KEPT, LISTS_KEPT, NAMES, RENAMED
from livebass.plugin.instrument import file_of, image_file, instrument_file


@pytest.fixture(scope="module")
def whole() -> bytes:
    return instrument_file(load_preset("slap"))


def words(*numbers: float) -> bytes:
    return np.array(numbers).tobytes()


def test_each_number_of_a_bass_has_its_name() -> None:
    """No word of the record is left out or written twice, but for what a computation sets."""
    places = [place for of in FIELDS.values() for place in of]
    assert len(set(places)) == len(places) and len(set(NAMES)) == len(NAMES)
    bench = KEPT.fields["bench"][1] // WORD  # type: ignore[index]
    assert set(range(bench)) <= set(places)
    assert FIELDS["bench.string.length"] == sorted(FIELDS["bench.string.length"]) and "bench.note.length" not in FIELDS
    assert not set(RENAMED) & set(NAMES) and set(RENAMED.values()) <= set(NAMES)


def test_the_order_of_fields_is_free(whole: bytes) -> None:
    bass, fields = load_preset("slap"), read_kept(whole)
    assert list(fields) == NAMES and image_made(whole) == image_file(bass)
    for order in (reversed(NAMES), sorted(NAMES), [*NAMES[7:], *NAMES[:7]]):
        assert image_made(file_of({name: fields[name] for name in order})) == image_file(bass)


def test_a_later_versions_fields_are_left_out_and_counted(whole: bytes) -> None:
    more = {"bench.string.colour": words(1, 2, 3, 4), "aroma": b"", "taste.of.its": words(np.nan)}
    fields = read_kept(whole)
    for made in ({**more, **fields}, {**fields, **more}):
        unknown: list[int] = []
        assert image_made(file_of(made), unknown=unknown) == image_file(load_preset("slap"))
        assert unknown == [3]


def test_longer_arrays_of_a_later_version_are_cut(whole: bytes) -> None:
    """As with a ninth string, which no bass of this one has."""
    fields = read_kept(whole)
    fields["bench.string.length"] = fields["bench.string.length"].ljust(8 * WORD, b"\0") + words(0.8)
    assert image_made(file_of(fields)) == image_file(load_preset("slap"))


def test_a_field_that_is_missing_is_zero(whole: bytes) -> None:
    fields = read_kept(whole)
    del fields["instrument.gain"]
    made = image_of(image_made(file_of(fields)))
    assert made.numbers["gain"][0] == 0 and image_of(image_made(whole)).numbers["gain"][0] > 0


PLAIN_RENAMED = """
import sys
from livebass.kernels.bass import kept
import numpy as np
kept.DIGESTS = np.append(kept.DIGESTS, np.uint64(kept.name_digest("instrument.loudness")))
kept.NUMBER = np.append(kept.NUMBER, kept.NAMES.index("instrument.gain"))
from support.kept import image_made, read_kept
from livebass import load_preset
from livebass.plugin.instrument import file_of, image_file, instrument_file
bass = load_preset("paper-g")
fields = read_kept(instrument_file(bass))
fields["instrument.loudness"] = fields.pop("instrument.gain")
assert image_made(file_of(fields)) == image_file(bass)
"""


def test_a_field_that_was_renamed_is_found_by_its_old_name() -> None:
    python_output("-c", PLAIN_RENAMED, env={"LIVEBASS_PLAIN": "1"} | module_paths())


def why(data: bytes) -> int:
    """Why a file is refused before its bass is made."""
    with pytest.raises(Refused) as caught:
        image_made(data)
    return int(caught.value.args[1])


def test_a_later_format_is_refused_as_such(whole: bytes) -> None:
    later = file_of(read_kept(whole), "9.1", FORMAT + 1)
    assert why(later) == LATER
    assert why(later[:1000] + b"?" + later[1001:]) == LATER, "whatever it holds"
    assert why(file_of(read_kept(whole), format=0)) == DAMAGED


def damage(whole: bytes) -> Iterator[tuple[int, bytes]]:
    """Files that are no instrument files, with what the kernels find."""
    yield from ((FOREIGN, data) for data in (b"", b"livebass", whole[: HEAD.itemsize], b"RIFF" + whole[4:], whole[:-1]))
    yield from ((DAMAGED, data) for data in (whole[:-WORD], whole + bytes(WORD), whole[:-800] + whole[-792:]))
    rng = np.random.default_rng(5)
    for place in rng.integers(2 * WORD, len(whole), 200).tolist():
        yield DAMAGED, whole[:place] + bytes([whole[place] ^ 1 << int(rng.integers(8))]) + whole[place + 1 :]


def test_damaged_files_are_refused(whole: bytes) -> None:
    assert [(state, why(data)) for state, data in damage(whole)] == [(state, state) for state, _ in damage(whole)]


def is_real(name: str) -> bool:
    """True for float64, False for whole numbers."""
    if name in LISTS_KEPT:
        return True
    kind: Any = KEPT
    for part in name.split("."):
        kind = kind.fields[part][0].base
    return bool(kind == np.float64)


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("bench.") or name in LISTS_KEPT])
def test_absurd_numbers_are_refused_or_harmless(whole: bytes, name: str) -> None:
    """No kernel computes with what is not finite; whole numbers beyond their limits lead it to no other memory."""
    fields, real = read_kept(whole), is_real(name)
    for value in (np.nan, np.inf, -np.inf, 1e300) if real else (-1, 1 << 20, 1 << 40, -(1 << 62), 1 << 62):
        made = np.frombuffer(fields[name] or bytes(WORD), float if real else np.int64).copy()
        made[0] = value
        assert isinstance(refusal_of(file_of(fields | {name: made.tobytes()})), int) or not real, value


def refusal_of(data: bytes) -> int | bytes:
    try:
        return image_made(data)
    except Refused as error:
        return int(error.args[1])


def test_random_words_under_a_valid_checksum_never_crash(whole: bytes) -> None:
    rng, played = np.random.default_rng(6), 0
    for case in range(400):
        data = np.frombuffer(whole, np.int64).copy()
        place = int(rng.integers(HEAD.itemsize // WORD, len(data) - 1))
        if case % 2:
            data[place] = rng.choice([-1, 0, 1, 2, 7, 1 << 20, 1 << 40, -(1 << 62), 1 << 62])
        else:
            data.view(float)[place] = rng.choice([np.nan, np.inf, -1.0, 0.0, 1e-300, 1e-9, 1e9, 1e300, rng.normal()])
        played += isinstance(refusal_of(seal(data[:-1].tobytes())), bytes)
    assert 50 < played < 350
