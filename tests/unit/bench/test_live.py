"""`livebass bench live`: its rows, table and files. No test knows the machine's speed."""

from __future__ import annotations

import json
import os
import shlex
import sys
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import Run, cli_text, refusal
from support.live import bass_of, synth_and_device
from support.own_basses import load_preset

from livebass.engine.engine import Engine
from livebass.lab.bench import fidelity, measure
from livebass.lab.bench import live as bench
from livebass.lab.bench.fidelity import (
    Heard,
    Note,
    distance,
    play_plucks,
    representative_notes,
    waveform_error,
    waveforms,
)
from livebass.lab.bench.live import EDGES, Extent, block_figures, max_that_fit
from livebass.lab.bench.measure import OtherLoad
from livebass.live import worst
from livebass.live.worst import even, worst_case
from livebass.model.quality import QUALITIES, Quality
from livebass.preset.load import preset_names
from livebass.sound.analysis import characteristic_frequencies
from livebass.system.cores import core_count

RATE = 48_000
ROUGH = Quality("rough", 20, 192e3)
FEW = (
    Note("jazz-finger", 0, 5, "soft", 30, RATE),
    Note("jazz-finger", 1, 3, "hard", 120, 44_100),
    Note("slap", 0, 5, "hard", 110, RATE),
    Note("slap-impulse", 0, 5, "hard", 110, RATE),
    Note("muted", 3, 7, "medium", 70, RATE),
)
TINY = Extent(
    blocks=(128, 1024), qualities=("live", "studio"), runs=1, other_runs=1, fit_runs=1, line=0.3, notes=FEW, plucks=1
)


@pytest.fixture(scope="module")
def measured() -> tuple[dict[str, Any], list[str]]:
    said: list[str] = []
    return bench.bench_live("jazz-finger", said.append, TINY), said


def test_all_is_measured_and_named(measured: tuple[dict[str, Any], list[str]]) -> None:
    result, said = measured
    assert [(row["tier"], row["block"]) for row in result["rows"]] == [
        (tier, block) for tier in TINY.qualities for block in TINY.blocks
    ]
    assert [(row["tier"], row["block"], row["cores"]) for row in result["team"]] == [
        (tier, 64, min(core_count(), 4)) for tier in TINY.qualities if (core_count()) > 1
    ]
    assert len(said) == len(set(said)) == 9 + len(result["team"])
    for row in [*result["rows"], *result["team"], result["moonshot"]]:
        assert 0 < row["median"] <= row["p999"] <= row["worst"]
        assert row["quiet_p999"] <= row["quiet_worst"] <= row["worst"]
        assert 0 <= row["late"] <= 1 and sum(row["histogram"]) == row["blocks"]
        assert len(row["histogram"]) == len(EDGES) - 1
        seconds = 1 + 2 * worst.SIXTEENTH + 5 * worst.HANDS_APART
        assert row["blocks"] == row["runs"] * -(-round(seconds * RATE) // row["block"])
        assert row["popped"]["worst"] <= row["worst"]
        assert list(row["each_hand"]) == list(worst.HAND_NAMES)
        assert all(hand["worst"] <= row["hands"]["worst"] for hand in row["each_hand"].values())
    for row in result["rows"]:
        assert 0 <= row["fit"] <= row["quiet_fit"] <= row["strings"] == 4
        assert row["fit"] < 4 or row["worst"] < 1
    assert list(result["fidelity"]) == ["live", "studio", bench.NULL]
    for found in result["fidelity"].values():
        assert found["notes"] == len(found["each"]) == 5
        assert {"no contact", "contact", "slap", "thumb"} <= set(found["groups"])
        assert found["groups"]["no contact"]["frequency"] < 1e-3 and found["plucks"] == TINY.plucks
    for target in result["wanted"]:
        name, _, rest = target["what"].partition(" from reference, ")
        group, _, kind = rest.partition(": characteristic frequency, ")
        if kind:
            null, bias = result["fidelity"][bench.NULL]["groups"][group], bench.MAX_BIAS[kind == "worst note"]
            key = "worst_frequency" if kind == "worst note" else "frequency"
            assert target["limit"] == null[key] + (bias if group != "no contact" else 0.001)
            assert target["value"] == result["fidelity"][name]["groups"][group][key]
            assert target["met"] == (target["value"] <= target["limit"])
    assert sum(" from reference, contact: " in target["what"] for target in result["wanted"]) == 4
    assert list(result["waveforms"]) == ["live", "studio"]
    for quality, kinds in result["waveforms"].items():
        assert list(kinds) == ["frets with loss", "thumb", "lossless"]
        for kind, row in kinds.items():
            assert (row["notes"], row["plucks"]) == (1, TINY.plucks) and row["median_db"] <= row["worst_db"] < 0
            label = f"{quality} from reference, {kind}: waveform of hard notes, "
            wanted = [target for target in result["wanted"] if target["what"].startswith(label)]
            if kind == "lossless":
                assert not wanted
                continue
            assert [target["value"] for target in wanted] == [row["median_db"], row["worst_db"]]
            assert [target["limit"] for target in wanted] == [-45.0, -35.0]
            assert all(target["met"] == (target["value"] <= target["limit"]) for target in wanted)
    for share in ("stolen", "others"):
        assert result[share] is None or 0 <= result[share] <= 1


def test_one_string_has_all_modes(measured: tuple[dict[str, Any], list[str]]) -> None:
    moonshot = measured[0]["moonshot"]
    assert (moonshot["modes"], moonshot["strings"], moonshot["block"]) == (862, 1, 128)
    assert moonshot["contact_rate_hz"] >= 4e6


def test_the_script_gives_each_string_its_note() -> None:
    """Pops on open strings, then sixteenths on one string after the other, whatever still sounds."""
    bass = load_preset("jazz-finger")
    script = worst_case(bass, RATE, 4)
    synth, device = synth_and_device(bass, ROUGH, adaptive=False)
    live, notes, frets = bass_of(synth), [], [0, 0, 0, 0]
    for frame, *message in script.messages:
        if frame >= script.hands:
            break
        while synth.frame <= frame:
            device.block(64)
        synth.send(*message)
        device.block(64)
        if message[0] == 0x90:
            notes.append((round(frame / RATE, 3), message[2], [fret for _, fret, _, _ in live.fingers()]))
    assert [n for n in notes if n[0] < worst.LINE_FROM] == [(0.0, 127, [0] * 4)] * 4 + [(0.5, 127, [0] * 4)] * 4
    line = notes[8:]
    assert len(line) == 16
    for k, (when, velocity, fingers) in enumerate(line):
        frets[k % 4], hard = worst.ROUNDS[k // 4]
        assert (when, velocity) == (round(worst.LINE_FROM + k * worst.SIXTEENTH, 3), hard)
        assert fingers == frets
    assert live.engine.report().notes == 24 and script.messages == tuple(sorted(script.messages, key=lambda m: m[0]))


def test_each_hand_plays_on_every_string() -> None:
    """Before the next hand begins, all strings sound at the fret it chose."""
    script = worst_case(load_preset("jazz-finger"), RATE, 4, 0.3)
    synth, device = synth_and_device(even(load_preset("jazz-finger")), ROUGH, adaptive=False)
    live, messages = bass_of(synth), list(script.messages)
    for k, (_, _, ((fret, _),)) in enumerate(worst.HANDS):
        while synth.frame < script.hands + round((k + 1) * worst.HANDS_APART * RATE) - 64:
            while messages and messages[0][0] < synth.frame + 64:
                frame, *message = messages.pop(0)
                synth.send(*message, frame)
            device.block(64)
        playing = [voice.slots[int(voice.record["slot"][0])] for voice in live.engine.voices]
        assert [(int(slot["on"]), int(slot["fret"])) for slot in playing] == [(1, fret)] * 4, worst.HAND_NAMES[k]


def test_runs_are_alike() -> None:
    """A device plays the same sound the second time."""
    bass = even(load_preset("jazz-finger"))
    smooth = tuple(replace(string, winding=0.0) for string in bass.strings)  # fingers scrape at random
    bass = replace(bass, strings=smooth)
    script = worst_case(bass, RATE, 4, 0.3)
    synth, device = synth_and_device(bass, ROUGH, adaptive=False)
    sounds = []
    for _ in range(2):
        synth.start_recording()
        assert (worst.play_script(device, script, 64) > 0).all()
        sounds.append(synth.recorded())
        worst.silence(device, 64)
        assert np.abs(device.block(64)).max() < 1e-6
    assert np.abs(sounds[0]).max() > 0.05
    np.testing.assert_allclose(sounds[0], sounds[1], atol=2e-3)


def test_figures_of_made_up_times() -> None:
    deadline = 64 / RATE * 1e9
    times = np.full((3, 1000), 0.1 * deadline)
    times[1, 10] = 3.0 * deadline  # once: not the callback's fault
    times[:, 20] = 0.9 * deadline
    figures = block_figures(times.astype(np.int64), 64, RATE)
    assert figures["median"] == pytest.approx(0.1, abs=1e-4) and figures["worst"] == pytest.approx(3.0, abs=1e-4)
    assert figures["quiet_worst"] == pytest.approx(0.9, abs=1e-4)
    assert figures["quiet_worst_at_s"] == 20 * 64 / RATE
    assert figures["late"] == pytest.approx(1 / 3000) and 0.1 < figures["p999"] <= 0.9001


@pytest.mark.parametrize("loads, fits", [
    ([0.2, 0.4, 0.6, 0.9], 4), ([0.2, 0.4, 0.6, 1.0], 3), ([0.5, 0.9, 1.1, 2.0], 2), ([0.9, 1.1, 1.5, 2.0], 1),
    ([1.1, 1.2, 1.3, 1.4], 0), ([0.5], 1), ([1.5], 0),
])  # fmt: skip
def test_strings_that_fit(loads: list[float], fits: int) -> None:
    assert max_that_fit(len(loads), lambda n: loads[n - 1]) == fits


def test_the_notes_that_are_compared_represent_all() -> None:
    """Every preset and string at every dynamic, every fret to 19, and three audio rates over touching strings."""
    notes = representative_notes()
    assert notes == representative_notes() and len(notes) >= 120
    for preset in preset_names():
        for i in range(len(load_preset(preset).strings)):
            mine = [note for note in notes if (note.preset, note.string) == (preset, i)]
            assert {note.dynamics for note in mine} == set(fidelity.DYNAMICS)
    assert {note.fret for note in notes} == set(range(fidelity.FRETS))
    for preset in preset_names():
        mine = [note for note in notes if note.preset == preset]
        assert len({note.fret for note in mine}) >= 9 and max(note.fret for note in mine) > 16
        assert {note.rate for note in mine} == set(fidelity.RATES)
    for note in notes:
        minimum, maximum = fidelity.DYNAMICS[note.dynamics]
        assert minimum <= note.velocity <= maximum


def test_guests_play_the_notes_of_their_strokes() -> None:
    """Each stroke on each string of two basses; the player of a note plucks with it, and straight up for that.

    And straight up on the highest strings of six.
    """
    kinds = {kind: [n for n in fidelity.guest_notes() if fidelity.guest_kind(n) == kind] for kind in fidelity.KINDS}
    assert {(n.preset, n.string, n.stroke) for n in kinds["thin"]} == {("six-string", i, "straight") for i in (4, 5)}
    notes = [*kinds["guests"], *kinds["straight"]]
    assert {n.preset for n in notes} == {*fidelity.VISITED}
    assert {(n.string, n.stroke) for n in notes} == {(i, stroke) for i in range(4) for stroke in fidelity.STROKES}
    bass = load_preset("jazz-finger")
    one = [replace(FEW[1], rate=RATE, stroke=stroke) for stroke in ("", *fidelity.STROKES)]
    assert [fidelity.with_stroke(bass, n.stroke).player.stroke for n in one] == ["finger", "pick", "pop", "finger"]
    own, *others = (heard.sounds for heard in play_plucks(one, QUALITIES["live"], [1.0]))
    assert min(waveform_error(other, own)[0] for other in others) > -20


@pytest.mark.parametrize("preset", ["slap", "slap-impulse"])
def test_a_string_alone_is_played_as_on_its_bass(preset: str) -> None:
    """The thumb strikes E and A; D and G are popped. A thumb with mass touches the string at once, and sounds."""
    bass, live = even(load_preset(preset)), QUALITIES["live"]
    assert (bass.player.thumb_mass > 0) == (preset == "slap")
    for i, string in enumerate(bass.strings):
        ((sound, _),) = fidelity.play_notes(bass, live, [Note(preset, i, 0, "hard", 120, RATE)])
        engine = Engine(bass, live, RATE, workers=1)
        engine.send(np.array([0]), np.array([[0x90, string.open_note, 120]], np.uint8))
        strike = 0.0 if bass.player.thumb_mass > 0 else bass.player.strike_time
        engine.process(round((strike if i < 2 else bass.player.pull_time) * RATE))
        np.testing.assert_array_equal(sound, engine.process(sound.size)[i], string.name)


def test_the_plucks_of_a_note_differ_by_what_no_ear_tells() -> None:
    """Each has its own force, in order; the null's plucks differ, and are as near to the note's own."""
    mine, others, within = fidelity.forces(), fidelity.forces(other=True), fidelity.WITHIN
    assert len(set(mine + others)) == 2 * fidelity.PLUCKS == 12
    assert max(abs(x - 1) for x in mine + others) == pytest.approx(within)
    assert abs(np.mean(mine) - np.mean(others)) < within / 4 and abs(20 * np.log10(1 + within)) < 0.03  # dB
    live, soft, hard = QUALITIES["live"], FEW[0], FEW[1]
    heard = play_plucks([soft, hard], live, mine[:2])
    for k, force in enumerate(mine[:2]):
        alone = play_plucks([soft, hard], live, [force], workers=1)
        for one, two in zip(heard, alone, strict=True):
            np.testing.assert_array_equal(one.sounds[k], two.sounds[0])
    plain, stronger = (play_plucks([soft], live, [force])[0].sounds[0] for force in (1.0, 1 + within))
    np.testing.assert_allclose(stronger, (1 + within) * plain, atol=0.1 * within * np.abs(plain).max())
    assert heard[0].contacts == 0 < heard[1].contacts


def test_one_wild_pluck_does_not_judge_a_note() -> None:
    """The medians compared are signed, frame by frame; the contacts of `wanted` define the group."""
    t, note = np.arange(RATE // 4) / RATE, replace(FEW[0], rate=RATE)

    def heard(*hertz: float) -> list[Heard]:
        return [Heard(np.array([np.sin(2 * np.pi * nu * t) for nu in hertz]), 1)]

    result = distance([note], heard(1000, 1010, 3000), heard(400, 1000, 1000))
    assert result["plucks"] == 3
    (row,) = result["each"]
    assert row["frequency"] == row["brighter"] == pytest.approx(0.01, rel=1e-3) and row["group"] == "contact"
    (row,) = distance([note], heard(400, 1000, 1000), heard(1000, 1010, 3000))["each"]
    assert row["frequency"] == -row["brighter"] == pytest.approx(0.01 / 1.01, rel=1e-3)


def far_off(notes: list[Note], *qualities: Quality) -> list[tuple[float, float, float]]:
    """Distance from `reference` of each quality and, last, of its other plucks: mean, worst note, audible dB."""
    wanted = play_plucks(notes, QUALITIES["reference"])
    touching = [bool(heard.contacts) for heard in wanted]  # near the body even hard notes may touch nothing
    assert sum(touching) >= 0.6 * len(notes)
    notes, wanted = list(compress(notes, touching)), list(compress(wanted, touching))
    sounds = [play_plucks(notes, quality) for quality in qualities]
    out = []
    for heard in (*sounds, play_plucks(notes, QUALITIES["reference"], fidelity.forces(other=True))):
        each = distance(notes, heard, wanted)["each"]
        off = [row["frequency"] for row in each]
        out.append((float(np.mean(off)), max(off), float(np.mean([row["heard_db"] for row in each]))))
    return out


def test_live_is_near_to_reference_and_a_coarse_quality_is_far() -> None:
    """On two hard notes, compared with the spread of `reference`; so few may exceed the mean twofold."""
    notes = [
        Note("precision-finger", 2, 5, "hard", 90, RATE), Note("slap-impulse", 1, 2, "hard", 110, 44_100),
    ]  # fmt: skip
    live, coarse, null = far_off(notes, QUALITIES["live"], Quality("coarse", 60, 96e3))
    assert live[0] <= null[0] + 2 * bench.MAX_BIAS[0] and live[1] <= null[1] + bench.MAX_BIAS[1]
    assert coarse[0] > null[0] + 2 * bench.MAX_BIAS[0] and coarse[1] > null[1] + bench.MAX_BIAS[1]
    assert coarse[2] > 2 * max(live[2], null[2]) > 0 and live[2] < 1.5 * null[2]


def test_a_waveform_that_is_off_by_a_thousandth_is_60_db_away() -> None:
    """Every pluck shows a known error, each kind of string has its own row; soft notes and the paper's have none."""
    rng = np.random.default_rng(5)
    sounds = rng.standard_normal((3, 4800))
    louder = np.array([[1 + 1e-3], [1 + 1e-3], [1 - 1e-2]])
    np.testing.assert_allclose(waveform_error(louder * sounds, sounds), [-60, -60, -40], atol=1e-9)
    np.testing.assert_allclose(waveform_error(sounds, sounds), -240, atol=1e-9)
    assert waveform_error(-sounds[0], sounds[0]) == pytest.approx(20 * np.log10(2))
    with pytest.raises(ValueError, match="nothing sounds"):
        waveform_error(sounds, 0 * sounds)
    hard = {
        "frets with loss": ("jazz-finger", 1, ""), "thumb": ("slap", 1, ""), "pops": ("slap", 2, ""),
        "guests": ("jazz-finger", 2, "pick"), "straight": ("jazz-finger", 3, "straight"),
        "boards": ("upright", 0, ""), "lossless": ("slap-impulse", 2, ""),
    }  # fmt: skip
    notes = [Note(preset, i, 3, "hard", 110, RATE, stroke) for preset, i, stroke in hard.values()]
    aside = [replace(FEW[0], string=1), Note("paper-bass", 0, 5, "hard", 120, RATE), replace(notes[0], fret=4)]
    wanted = [*[Heard(sounds, 4)] * 9, Heard(sounds, 0)]  # the last one touched nothing
    found = waveforms(notes + aside, [Heard(louder * sounds, 4)] * 7 + [Heard(2 * sounds, 4)] * 3, wanted)
    assert list(found) == list(hard)
    for kind, row in found.items():
        assert (row["notes"], row["plucks"], row["median_db"]) == (1, 3, pytest.approx(-60))
        assert row["worst_db"] == pytest.approx(-40) and row["worst"].startswith(f"{hard[kind][0]} ")
    far = waveforms(2 * notes[:1], [Heard(louder * sounds, 1), Heard(1.1 * sounds, 1)], wanted[:2])
    assert far["frets with loss"]["worst_db"] == pytest.approx(-20) and far["frets with loss"]["notes"] == 2
    assert far["frets with loss"]["median_db"] == pytest.approx(-30)


def test_where_contact_loses_the_waveform_of_live_is_that_of_reference() -> None:
    """Over frets, by a thumb and over a board. A coarse quality sounds different, and so do lossless frets."""
    notes = [
        Note("precision-finger", 2, 5, "hard", 90, RATE), Note("slap", 1, 2, "hard", 110, 44_100),
        Note("upright", 3, 2, "hard", 127, RATE), Note("slap-impulse", 3, 3, "hard", 107, 96_000),
    ]  # fmt: skip
    wanted, live, coarse = (
        play_plucks(notes, quality, [1.0])
        for quality in (QUALITIES["reference"], QUALITIES["live"], Quality("c", 60, 96e3))
    )
    near, far = waveforms(notes, live, wanted), waveforms(notes, coarse, wanted)
    assert list(near) == list(far) == ["frets with loss", "thumb", "boards", "lossless"]
    assert near["lossless"]["worst_db"] > -35
    for kind in ("frets with loss", "thumb", "boards"):
        assert near[kind]["worst_db"] <= bench.MAX_WAVEFORM[0] < bench.MAX_WAVEFORM[1] < far[kind]["worst_db"]


def test_a_quality_is_itself() -> None:
    notes = [note for note in representative_notes(["jazz-finger"]) if note.dynamics == "hard"]
    live = play_plucks(notes, QUALITIES["live"], [1.0])
    same = distance(notes, live, play_plucks(notes, QUALITIES["live"], [1.0], workers=1))
    assert same["notes"] == len(same["each"]) == 8
    for group in same["groups"].values():
        assert all(group[key] == 0 for key in ("frequency", "brighter", "worst_frequency", "spectrum_db", "heard_db"))


@pytest.mark.slow
def test_live_is_as_near_to_reference_as_promised() -> None:
    """A sixth of the hard notes over frets, and one over a board: `bench live` takes them all.

    Waveforms are of one pluck each of all hard notes over lossy frets and lossy boards.
    """
    hard = [note for note in representative_notes() if note.dynamics == "hard"]
    over = [load_preset(note.preset).over_board for note in hard]
    frets = [note for note, board in zip(hard, over, strict=True) if not board][::6]
    boards = [note for note, board in zip(hard, over, strict=True) if board and note.preset == "fretless"][:1]
    assert len(frets) >= 12 and len({note.preset for note in frets}) >= 9 and len(boards) == 1
    live, null = far_off(frets + boards, QUALITIES["live"])
    assert live[0] <= null[0] + bench.MAX_BIAS[0] and live[1] <= null[1] + bench.MAX_BIAS[1]
    losing = [note for note in hard if load_preset(note.preset).necks[note.string].contact_loss]
    sounds = [play_plucks(losing, QUALITIES[quality], [1.0]) for quality in ("live", "reference")]
    found = waveforms(losing, *sounds)
    assert sorted(found) == ["boards", "frets with loss", "pops", "thumb"]
    maxima = dict.fromkeys(bench.PROMISED, bench.MAX_WAVEFORM[0]) | {"pops": -35.0, "boards": -40.0}
    for kind, maximum in maxima.items():
        assert found[kind]["median_db"] <= maximum, kind
    far = [waveform_error(a.sounds, b.sounds)[0] > bench.MAX_WAVEFORM[1] for a, b in zip(*sounds, strict=True)]
    assert np.mean(far) <= 0.06, "contacts amplify small differences, in few notes so much"


def test_the_characteristic_frequency_is_the_mean_of_power() -> None:
    """Eq. 14 on two sines, one at half the amplitude: a quarter of the weight."""
    t = np.arange(RATE // 4) / RATE
    sound = np.sin(2 * np.pi * 1000 * t) + 0.5 * np.sin(2 * np.pi * 6000 * t)
    expected = (1000 + 0.25 * 6000) / 1.25
    np.testing.assert_allclose(characteristic_frequencies(sound, RATE), expected, rtol=1e-4)
    louder = np.sin(2 * np.pi * 1000 * t)
    error, apart = fidelity.frequency_error, fidelity.log_spectral_distance
    assert error(sound, louder, RATE) == pytest.approx((expected / 1000 - 1,) * 2, rel=1e-3)
    assert error(louder, sound, RATE) == pytest.approx((1 - 1000 / expected, 1000 / expected - 1), rel=1e-3)
    assert apart(10 * louder, louder, RATE)[1] > apart(2 * louder, louder, RATE)[1] > 3
    assert np.isnan(characteristic_frequencies(0 * t, RATE)).all()
    for compare in (error, apart):
        with pytest.raises(ValueError, match="nothing sounds"):
            compare(sound, 0 * t, RATE)


def test_the_spectrum_is_compared_over_70_db() -> None:
    rng = np.random.default_rng(0)
    loud, soft = rng.standard_normal((2, RATE // 4))
    plain, heard = fidelity.log_spectral_distance(loud * 1e-9, loud, RATE)
    assert 40 < plain < 70 and plain == pytest.approx(heard, rel=1e-3)
    assert fidelity.log_spectral_distance(loud + 1e-6 * soft, loud, RATE)[1] < 0.1


def test_stolen_time_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = [[100, 0, 50, 800, 10, 0, 0, 40], [160, 0, 60, 900, 10, 0, 0, 70]]
    monkeypatch.setattr(measure, "_ticks", lambda: ticks.pop(0))
    monkeypatch.setattr(measure, "_own_time", lambda: 0.0)
    load = OtherLoad()
    assert load.shares() == {"stolen": 30 / 200, "others": 70 / 200}
    monkeypatch.setattr(measure, "_ticks", list)
    assert OtherLoad().shares() == {"stolen": None, "others": None}


def test_the_table_has_every_row(measured: tuple[dict[str, Any], list[str]]) -> None:
    result = measured[0]
    lines = bench.table(result).splitlines()
    found = [*result["rows"], *result["team"], result["moonshot"]]
    rows = lines[1 : 2 + len(found)]
    assert len({len(line) for line in rows}) == 1 and max(map(len, lines)) <= 130
    for line, row in zip(rows[1:], found, strict=True):
        assert line.startswith(row["tier"]) and (row["cores"] == 1 or f", {row['cores']} cores " in line)
        assert f"{row['worst']:.1%}" in line and f"{row['median']:.1%}" in line
    for target in result["wanted"]:
        assert any(line.startswith(target["what"]) and line.endswith("missed") != target["met"] for line in lines)
    assert any(line.startswith("livebass") and "numba" in line for line in lines)


def test_files_from_the_command_line(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(bench, "FULL", replace(TINY, line=0.1, notes=FEW[:2]))
    file, picture = tmp_path / "live.json", tmp_path / "live.png"
    text = cli_text(run, "bench", "live", "-q", "live", "--block", 256, "--runs", 1, "--json", file, "--plot", picture)
    result = json.loads(file.read_text())
    assert text == bench.table(result) + "\n"
    assert [(row["tier"], row["block"], row["runs"]) for row in result["rows"]] == [("live", 256, 1)]
    assert picture.read_bytes().startswith(b"\x89PNG") and sorted(os.listdir(tmp_path)) == ["live.json", "live.png"]


@pytest.mark.parametrize("line, status", [
    *((f"{command} {arguments}", status) for command in ("live", "latency") for arguments, status in (
        ("--json no/x.json", 1), ("--plot no/x.png", 1), ("--plot x.pdf", 2), ("--plot x.png --json x.png", 2),
    )),
    ("render --json nowhere/x.json", 1), ("render --json .", 1),
])  # fmt: skip
def test_files_that_cannot_be_written_are_refused_before_the_work(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, status: int
) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("measured first")

    command, *arguments = line.split()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"livebass.lab.bench.{command}.bench_{command}", work)
    refusal(run, "bench", command, *arguments, status=status)
    assert not os.listdir(tmp_path)


def test_a_picture_without_matplotlib(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    err = refusal(run, "bench", "live", "--plot", tmp_path / "x.png", status=1)
    assert "matplotlib" in err and f"{shlex.quote(sys.executable)} -m pip install" in err


def test_a_preset_that_is_not_there(run: Run) -> None:
    assert "violin" in refusal(run, "bench", "live", "-p", "violin", status=1)


def test_the_worst_case_of_a_tuned_bass_calls_its_strings() -> None:
    default, low = (worst_case(load_preset("jazz-finger", tuning=tuning), RATE, 4) for tuning in ("standard", "drop-c"))
    assert len(low.messages) == len(default.messages)
    calls = [[m for m in script.messages if m[2] < 20 and m[1] != 0xB0] for script in (default, low)]
    assert calls[0] == calls[1] and len(calls[0]) >= 8
