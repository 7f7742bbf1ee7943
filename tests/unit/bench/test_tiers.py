"""`livebass bench fidelity`: bias by band, contacts and the judge, of made-up notes and of a few real ones."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import Run, cli_text, refusal

from livebass.lab.bench import live, tiers
from livebass.lab.bench.fidelity import SPAN, Heard, Note
from livebass.lab.bench.tiers import CENTRES, Extent, band_levels, bench_fidelity, bias, by_preset, score
from livebass.lab.comparison import hearing
from livebass.rows.arrays import Floats

RATE = 48_000
FEW = Extent(
    qualities=("live",), plucks=2,
    notes=(
        Note("jazz-finger", 1, 3, "hard", 120, 44_100), Note("jazz-finger", 0, 5, "soft", 30, RATE),
        Note("jazz-finger", 2, 3, "hard", 127, RATE, "pop"),
    ),
)  # fmt: skip


def noise(seed: int, rate: int = RATE) -> Floats:
    return np.random.default_rng(seed).standard_normal((2, round(SPAN * rate)))


def brightened(sounds: Floats, rate: int, by_db: float, above: float) -> Floats:
    """`sounds` with what is above a frequency (Hz) louder."""
    spectrum = np.fft.rfft(sounds)
    spectrum[:, np.fft.rfftfreq(sounds.shape[1], 1 / rate) > above] *= 10 ** (by_db / 20)
    return np.fft.irfft(spectrum, sounds.shape[1])


@pytest.fixture(scope="module")
def measured() -> dict[str, Any]:
    return bench_fidelity(extent=FEW)


@pytest.mark.parametrize("rate", [44_100, RATE, 96_000])
def test_a_tone_lies_in_its_band(rate: int) -> None:
    """And at its level, wherever it lies in the band."""
    t = np.arange(round(SPAN * rate)) / rate
    for k in (6, 14, 26):
        low, middle, high = (
            band_levels(np.sin(2 * np.pi * x * CENTRES[k] * t)[None], rate)[0] for x in (0.93, 1.0, 1.08)
        )
        assert low.argmax() == middle.argmax() == high.argmax() == k
        np.testing.assert_allclose([low[k], high[k]], middle[k], atol=0.3)
        assert np.delete(middle, [k - 1, k, (k + 1) % len(CENTRES)]).max() < middle[k] - 15


def test_the_bias_is_the_median_over_notes_of_what_is_heard() -> None:
    """One wild note of five says nothing. A band far below the loudest is not heard."""
    notes = []
    for k in range(5):
        rate = (44_100, RATE, 96_000)[k % 3]
        wanted = brightened(noise(k, rate), rate, -100.0, 6000.0)
        notes.append((brightened(wanted, rate, 20.0 if k == 2 else 0.8, 2000.0), wanted, rate))
    found = bias(notes)
    assert [band["notes"] for band in found] == [5] * len(found)
    hz, db = (np.array([band[key] for band in found]) for key in ("hz", "db"))
    assert hz.max() == pytest.approx(6310, rel=1e-3)
    np.testing.assert_allclose(db[hz < 1700], 0.0, atol=0.05)
    np.testing.assert_allclose(db[(hz > 2400) & (hz < 5500)], 0.8, atol=0.05)


def test_a_preset_and_each_stroke_of_a_guest_have_a_row() -> None:
    own, guest = Note("slap", 0, 0, "hard", 110, RATE), Note("slap", 0, 0, "hard", 110, RATE, "pick")
    wanted = [Heard(noise(k), 9, (9, 3)) for k in range(3)]
    ours = [Heard(brightened(noise(k), RATE, -1.5, 900.0), 9, (9, 6 * k)) for k in range(3)]
    asked: list[tuple[int, int]] = []

    def mos(one: Floats, other: Floats) -> float:
        asked.append((one.size, other.size))
        return 5.0 if np.array_equal(one, other) else 4.0 - len(asked) / 100

    rows = by_preset([own, own, guest], ours, wanted, mos)
    assert [(row["preset"], row["stroke"], row["notes"]) for row in rows] == [("slap", "", 2), ("slap", "pick", 1)]
    assert [(row["contacts"], row["contacts_wanted"]) for row in rows] == [(24, 24), (21, 12)]
    for row in rows:
        assert row["worst_band"] in row["bands"] and row["worst_band"]["db"] == pytest.approx(-1.5, abs=0.05)
        assert row["worst_band"]["hz"] > 900
    assert set(asked) == {(round(SPAN * RATE),) * 2} and rows[0]["worst_mos"] == pytest.approx((3.97 + 3.96) / 2)
    assert rows[0]["mos"] == pytest.approx((3.99 + 3.98 + 3.97 + 3.96) / 4)
    assert all(row["mos"] == 5.0 for row in by_preset([own], wanted[:1], wanted[:1], mos))
    assert by_preset([own], [Heard(noise(0), 0)], [Heard(noise(0), 0)])[0].keys().isdisjoint({"mos", "worst_mos"})


def test_the_judge_hears_both_equally_amplified_at_its_rate() -> None:
    """A louder sound stays louder: loudness is part of the difference."""
    wanted = 1e-3 * noise(1, 96_000)
    heard = []

    def mos(one: Floats, other: Floats) -> float:
        heard.append((one, other))
        return 4.5

    pytest.importorskip("scipy")
    assert score(mos, 2 * wanted, wanted, 96_000) == 4.5 and len(heard) == 2
    for one, other in heard:
        assert one.size == other.size == round(SPAN * hearing.RATE)
        np.testing.assert_allclose(one, 2 * other)
        assert 0.02 < np.sqrt(np.mean(other**2)) < 0.1


def test_a_few_notes(measured: dict[str, Any]) -> None:
    """`live` is near; so is `reference` by other plucks. Each names what it compares."""
    assert list(measured["tiers"]) == list(measured["fidelity"]) == ["live", live.NULL]
    assert list(measured["waveforms"]) == ["live"]
    for rows in measured["tiers"].values():
        assert [(row["preset"], row["stroke"], row["notes"]) for row in rows] == [
            ("jazz-finger", "", 2), ("jazz-finger", "pop", 1)
        ]  # fmt: skip
        for row in rows:
            assert row["contacts_wanted"] > 0 and abs(row["contacts"] / row["contacts_wanted"] - 1) < 0.3
            assert abs(row["worst_band"]["db"]) < 3.0 and len(row["bands"]) > 15


def test_the_table_has_every_row(measured: dict[str, Any]) -> None:
    lines = tiers.table(measured).splitlines()
    assert max(map(len, lines)) <= 130
    start = next(k for k, line in enumerate(lines) if line.startswith("from reference") and "bias" in line)
    rows = [(quality, row) for quality, found in measured["tiers"].items() for row in found]
    for line, (quality, row) in zip(lines[start + 1 :], rows, strict=False):
        assert line.startswith(quality) and f"{row['worst_band']['db']:+.2f} dB" in line and "MOS" not in line
        assert ("pop" in line) == (row["stroke"] == "pop")
    rows[0][1].update(mos=4.987, worst_mos=4.2)
    rows[1][1].update(mos=5.0, worst_mos=5.0)
    text = tiers.table({**measured, "tiers": {"live": [row for _, row in rows[:2]]}})
    assert "MOS" in text and " 4.99  " in text and " 4.20" in text


def test_files_from_the_command_line(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "ALL", replace(FEW, qualities=("live", "studio"), plucks=1))
    file = tmp_path / "fidelity.json"
    text = cli_text(run, "bench", "fidelity", "-q", "live", "--json", file)
    result = json.loads(file.read_text())
    assert text == tiers.table(result) + "\n" and list(result["tiers"]) == ["live", live.NULL]


def test_only_some_presets() -> None:
    notes = tiers.notes_of(["jazz-finger", "slap"])
    assert {note.preset for note in notes} == {"jazz-finger", "slap"} and {note.stroke for note in notes} > {"", "pop"}
    assert {note.stroke for note in tiers.notes_of(["slap"])} == {""}
    assert {note.preset for note in tiers.notes_of([])} > {"jazz-finger", "slap", "upright"}


def test_the_judge_is_an_extra(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "zimtohrli", None)
    assert "zimtohrli" in refusal(run, "bench", "fidelity", "--hear", status=1)


def test_the_judge_hears_a_difference_only_where_one_is() -> None:
    pytest.importorskip("zimtohrli")
    pytest.importorskip("scipy")
    t = np.arange(round(SPAN * RATE)) / RATE
    tone = np.exp(-4 * t) * sum(np.sin(2 * np.pi * 98 * k * t) / k for k in range(1, 30))
    mos = hearing.judge()
    same, duller = (score(mos, brightened(tone[None], RATE, db, 800.0), tone[None], RATE) for db in (1e-3, -12.0))
    assert same > 4.95 and duller < same - 0.2
