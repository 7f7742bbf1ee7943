"""Quality chosen by the machine's capacity: measured once, kept, reported, and used for the choice."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.live import next_line

from livebass.compiling import library, store
from livebass.live import best_quality
from livebass.live.best_quality import MAXIMUM, best_qualities, kept_share, prepare_bass, worst_share
from livebass.live.fake import FakeDevice
from livebass.live.presets import PresetSwitch
from livebass.live.synth import LiveBass, Synth
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset

RATE = 48_000


@pytest.fixture(autouse=True)
def own_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty directory for compiled code; the kernels come from the usual one."""
    library.library()
    place = tmp_path / "kept"
    place.mkdir()
    monkeypatch.setattr(store, "directory", lambda name: place)
    return place


@cache
def bass(preset: str = "muted", rate: int = RATE) -> LiveBass:
    return LiveBass(load_preset(preset), QUALITIES["studio"], rate)


def test_a_share_is_measured_once_and_kept_by_bass_and_rate(own_directory: Path) -> None:
    measured: list[str] = []

    def measure(b: LiveBass) -> float:
        measured.append(f"{b.engine.instrument.name} {b.engine.rate}")
        return 0.25 * len(measured)

    assert [kept_share(bass(), measure) for _ in range(3)] == [0.25] * 3
    assert kept_share(bass(rate=44_100), measure) == 0.5
    assert kept_share(bass("slap"), measure) == 0.75
    assert kept_share(bass(), measure) == 0.25 and len(measured) == 3
    for file in own_directory.iterdir():
        file.write_bytes(b"damaged")
    assert kept_share(bass(), measure) == 1.0, "a damaged file is made again"
    assert kept_share(bass(), measure) == 1.0


def test_without_a_directory_a_share_is_measured_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "directory", lambda name: None)
    found = iter((0.1, 0.2))
    assert [kept_share(bass(), lambda _: next(found)) for _ in range(2)] == [0.1, 0.2]


@pytest.mark.parametrize(("share", "quality"), [(MAXIMUM, "studio"), (np.nextafter(MAXIMUM, 1), "live")])
def test_the_finest_quality_that_is_carried(monkeypatch: pytest.MonkeyPatch, share: float, quality: str) -> None:
    monkeypatch.setattr(best_quality, "worst_share", lambda _: share)
    assert prepare_bass(load_preset("muted"), None, RATE).engine.quality.name == quality
    for requested in QUALITIES.values():
        assert prepare_bass(load_preset("muted"), requested, RATE).engine.quality.name == requested.name


def test_of_several_basses_few_are_measured_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(best_quality, "worst_share", lambda b: 4.0 if b.engine.instrument.name == "Slap" else 0.1)
    basses = {name: load_preset(name) for name in ("slap", "fretless")}
    assert best_qualities(basses, RATE, enough=0.0) == {"slap": "live", "fretless": "live"}
    assert best_qualities(basses, RATE) == {"slap": "live", "fretless": "studio"}
    assert best_qualities(basses, RATE, enough=0.0) == {"slap": "live", "fretless": "studio"}, "they are known"


def test_what_is_measured_is_the_work_of_a_bass(monkeypatch: pytest.MonkeyPatch) -> None:
    """The share is taken from the quickest run of the worst block; a bass far too slow is played once."""
    blocks, requested = 7, []

    def times(*given: object) -> np.ndarray:
        requested.append(given[-1])
        found = np.full((given[-1], blocks), 100_000)  # type: ignore[call-overload]
        found[-1, 3] = 400_000  # ns; a block of 64 frames lasts 1.333 ms
        found[0, 4] = 200_000
        return found

    monkeypatch.setattr(best_quality, "block_times", times)
    assert worst_share(bass()) == pytest.approx(0.1e-3 * RATE / 64) and requested == [1, best_quality.RUNS]
    monkeypatch.setattr(best_quality, "block_times", lambda *given: times(*given) * 10)
    del requested[:]
    assert worst_share(bass()) == pytest.approx(4e-3 * RATE / 64) and requested == [1]


def test_a_share_as_measured_here() -> None:
    assert 0.0 < worst_share(bass("paper-g")) < 1000.0


def test_a_change_of_bass_chooses_again(monkeypatch: pytest.MonkeyPatch) -> None:
    shares = {"muted": 0.2, "slap": 3.0}
    by_name = {load_preset(preset).name: share for preset, share in shares.items()}
    monkeypatch.setattr(best_quality, "worst_share", lambda b: by_name[b.engine.instrument.name])
    synth = Synth(RATE)
    device = FakeDevice(synth)
    synth.switch_to(prepare_bass(load_preset("muted"), None, RATE))
    changes = PresetSwitch(synth, "muted", None)
    try:
        assert changes.quality == "studio"
        for wanted, said in (
            ({"preset": "slap"}, "preset slap, quality live"),
            ({"preset": "muted"}, "preset muted, quality studio"),
            ({"quality": "live"}, "preset muted, quality live"),
            ({"quality": "auto"}, "preset muted, quality studio"),
        ):
            changes.choose(**wanted)
            assert next_line(changes, device) == said
    finally:
        changes.close()
