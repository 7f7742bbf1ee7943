"""The transfer AUC: what all other presets share gives a preset away, and nothing else does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.command import Run, cli_text
from support.places import GROWLY

from livebass.lab.comparison.classifier import auc
from livebass.lab.comparison.groups import FIGURES, Group
from livebass.lab.comparison.notes import own_technique
from livebass.lab.comparison.transfer import other_presets, play_others, transfer
from livebass.preset.load import load_preset

KEYS = np.repeat([28, 33, 36, 40, 45], 8)
WIDE = len(FIGURES)


def group(name: str, seed: int, technique: str = "fingers", keys: np.ndarray = KEYS, **moved: float) -> Group:
    """Notes whose figures are noise around values of their bass and its pitches; `moved` figures are off by so much."""
    rng = np.random.default_rng(seed)
    figures = 3.0 + 0.5 * rng.normal(size=WIDE) + rng.normal(size=(keys.size, WIDE)) + 0.2 * (keys[:, None] - 36)
    for key, by in moved.items():
        figures[:, FIGURES.index(key)] += by
    return Group(name, name, technique, 440 * 2 ** ((keys - 69) / 12), figures)


REAL = [group(f"real {k}", k) for k in range(6)]
SHARED = [group(f"preset {k}", 20 + k, hiss=6.0) for k in range(6)]


def test_what_presets_share_gives_one_away() -> None:
    """Hiss that no real bass has is known without hearing this preset; a preset without it is not known by it."""
    found = transfer(group("mine", 40, hiss=6.0), SHARED, REAL)
    assert found.auc["all"] > 0.95 and found.auc["no timbre"] > 0.95
    assert found.presets == 6 and len(found.families) == 6 and found.technique == "fingers" and not found.needed
    hissing = [transfer(group("mine", seed, hiss=6.0), SHARED, REAL).auc for seed in range(40, 46)]
    clean = [transfer(group("mine", seed), SHARED, REAL).auc for seed in range(40, 46)]
    assert 0.3 < np.mean([each["all"] for each in clean]) < 0.7 < 0.9 < np.mean([each["all"] for each in hissing])
    assert [each["no noise"] for each in clean] == [each["no noise"] for each in hissing]


def test_what_one_preset_has_alone_does_not() -> None:
    """A figure off in this preset alone is not what the classifier learnt; the pooled AUC is there for it."""
    others = [group(f"preset {k}", 20 + k) for k in range(6)]
    assert 0.3 < transfer(group("mine", 40, hiss=6.0), others, REAL).auc["all"] < 0.7


def test_pitches_are_alike_on_both_sides() -> None:
    """Presets that play low notes more often are not told by their pitch, and notes of other pitches do not count."""
    lower = np.concatenate([np.repeat(28, 40), KEYS])
    others = [group(f"preset {k}", 20 + k, keys=lower) for k in range(6)]
    found = [transfer(group("mine", seed, keys=lower), others, REAL).auc["all"] for seed in range(40, 46)]
    assert abs(np.mean(found) - 0.5) < 0.08, found
    high = [replace(g, figures=g.figures + 50, pitch=8 * g.pitch) for g in REAL]
    both = [
        Group(g.name, g.bass, g.technique, np.append(g.pitch, h.pitch), np.vstack([g.figures, h.figures]))
        for g, h in zip(REAL, high, strict=True)
    ]
    mine = group("mine", 40, hiss=6.0)
    assert transfer(mine, SHARED, both) == transfer(mine, SHARED, REAL)


def test_families_of_the_same_technique_are_asked() -> None:
    mine = group("mine", 40, "pick", hiss=6.0)
    few = transfer(mine, SHARED, [*REAL[:4], replace(REAL[4], technique="pick")])
    assert few.technique == "" and len(few.families) == 5
    assert few.needed == "too few: 1 family of real basses played with pick, 2 are needed to ask beside them alone"
    assert few.needed in "\n".join(few.lines())
    two = transfer(mine, SHARED, [*REAL[:4], *(replace(g, technique="pick") for g in REAL[4:])])
    assert two.technique == "pick" and two.families == ("real 4", "real 5") and not two.needed


def test_too_few_families() -> None:
    """Two sets of one instrument are one family: what is learnt from it is not asked about it."""
    strings = replace(REAL[1], name="other strings", bass="real 0")
    found = transfer(SHARED[0], SHARED[1:], [REAL[0], strings, REAL[2]])
    assert not found.auc and "3 families of real basses with its pitches are needed, not 2" in found.lines()[0]
    assert not transfer(group("mine", 1, keys=KEYS + 24), SHARED, REAL).auc
    assert "no other preset" in transfer(SHARED[0], [], REAL).lines()[0]


def test_weighted_auc() -> None:
    a, b = np.array([1.0, 2.0]), np.array([0.0, 1.5, 2.0])
    assert auc(a, b) == pytest.approx((1 + 2.5) / 6)
    assert auc(a, b, np.array([0.0, 1.0])) == pytest.approx(2.5 / 3)
    assert auc(a, b, np.array([1.0, 3.0]), np.array([0.0, 0.0, 1.0])) == pytest.approx(0.375)


@pytest.mark.parametrize(
    ("preset", "technique"),
    [("slap", "slap"), ("precision-pick", "pick"), ("short-scale", "pick"), ("muted", "mute"), ("upright", "fingers")],
)
def test_presets_have_techniques_of_their_own(preset: str, technique: str) -> None:
    assert own_technique(load_preset(preset)) == technique


def test_a_preset_is_compared_by_its_own_technique(run: Run) -> None:
    note = GROWLY / "C2_ff_rr1.flac"
    arguments = ("compare", note, "-p", "precision-pick", "-q", "live", "--takes", 1)
    assert "precision-pick as pick" in cli_text(run, *arguments).splitlines()[0]
    assert "precision-pick as fingers" in cli_text(run, *arguments, "--technique", "fingers").splitlines()[0]


@pytest.mark.slow
def test_other_presets_play_the_same_notes() -> None:
    names = other_presets()
    assert {"jazz-finger", "slap"} < set(names) and not {"drop-d", "paper-g", "paper-bass"} & set(names)
    called: list[int] = []
    played = play_others(["muted", "slap"], [28, 100, 36], 2, "live", print, lambda: called.append(1))
    assert [(g.bass, g.technique, g.keys.tolist()) for g in played] == [
        ("muted", "mute", [28, 28, 36, 36]), ("slap", "slap", [28, 28, 36, 36])
    ]  # fmt: skip
    assert len(called) == 2 and all(np.isfinite(g.figures).mean() > 0.7 for g in played)
    again = play_others(["slap"], [36], 2, "live", print, lambda: None)
    assert np.array_equal(again[0].figures, played[1].figures[2:], equal_nan=True)
