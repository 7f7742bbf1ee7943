"""A sample pack: through a sampler it sounds as livebass renders, level by level; bad targets are refused whole."""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import soundfile
from support.command import Run, assert_one_clear_line, cli_text, refusal
from support.costs import of_each_kind
from support.levels import rms
from support.needs import CLOSED
from support.quiet import without_noise
from support.sampler import through_sfizz

from livebass import QUALITIES, Instrument, fundamental, load_preset, preset_names, render_to_array, score_of
from livebass.engine.render import mix_strings, single
from livebass.export import sfz
from livebass.export.sfz import FOLDER, Pack, PackSettings
from livebass.files.whole import OutputError, checked_directory
from livebass.model.instrument import Player, note_frequency
from livebass.model.keymap import Curve
from livebass.rows.units import OFF, cents, decibels
from livebass.score.score import single_note

RATE = 48000
TINY = PackSettings(QUALITIES["live"], RATE, frets=12, layers=3, robins=2, length=0.6, seed=3)
HEARD = 0.3  # s, of a note, for its level
SAME_LEVEL = 2.3  # dB, for each note, beyond the common offset: each draws its own irregularities
SAME_LEVELS = 0.8  # dB, RMS of these
SAME_VOLUME = 0.5  # dB, of the common offset
CLEAR_STEP = 1.0  # dB
SAME_PITCH = 6.0  # cents
FULL_SCALE_STEP = 2.0**-23


@dataclass(frozen=True)
class Written:
    folder: Path
    bass: Instrument
    pack: Pack

    @property
    def sfz(self) -> Path:
        return self.folder / f"{self.pack.name}.sfz"

    def sound(self, sample: sfz.Sample) -> np.ndarray:
        sound, rate = soundfile.read(self.folder / FOLDER / sample.file)
        assert rate == RATE
        return sound


def write(folder: Path, preset: str, settings: PackSettings = TINY) -> Written:
    bass = load_preset(preset)
    pack = Pack(bass, preset, settings)
    sfz.write_pack(pack, folder)
    return Written(folder, bass, pack)


@pytest.fixture(scope="module")
def slap(tmp_path_factory: pytest.TempPathFactory) -> Written:
    return write(tmp_path_factory.mktemp("packs") / "slap", "slap-impulse")


@dataclass(frozen=True)
class Group:
    """A <group> of an SFZ file and its regions, as any sampler reads them."""

    opcodes: dict[str, str]
    level: float  # dB, from the comment
    regions: list[dict[str, str]]

    def __getitem__(self, name: str) -> int:
        return int(self.opcodes[name])

    def gain(self, velocity: int) -> float:
        """dB at a velocity: straight lines between the points of amp_velcurve."""
        points = {int(k.rpartition("_")[2]): float(v) for k, v in self.opcodes.items() if k.startswith("amp_velcurve_")}
        assert min(points) == self["lovel"] and max(points) == self["hivel"] and max(points.values()) <= 1
        return float(decibels(np.interp(velocity, sorted(points), [points[v] for v in sorted(points)])))


def groups(file: Path) -> list[Group]:
    found: list[Group] = []
    level = 0.0
    into: dict[str, str] = {}
    for line in file.read_text().splitlines():
        if match := re.fullmatch(r"// .* velocity \d+, (-?[\d.]+) dB", line):
            level = float(match[1])
        code = line.partition("//")[0]
        for header in re.findall(r"<(\w+)>", code):
            into = {}
            if header == "group":
                found.append(Group(into, level, []))
            elif header == "region":
                found[-1].regions.append(into)
        into.update(re.findall(r"(\w+)=(\S+)", code))
    return found


def level(sound: np.ndarray, start: float, length: float = HEARD) -> float:
    """dB re full scale, RMS."""
    return decibels(rms(sound[round(start * RATE) : round((start + length) * RATE)]))


def pitch(sound: np.ndarray, start: float, note: int) -> float:
    """Hz, by the first three partials: the higher ones are stretched, and differ between plucks."""
    part = sound[round((start + 0.1) * RATE) : round((start + 0.45) * RATE)]
    expected = note_frequency(note)
    spectrum = np.fft.rfft(part * np.hanning(len(part)))
    spectrum[round(3.5 * expected * len(part) / RATE) :] = 0
    track = fundamental(np.fft.irfft(spectrum, len(part)), RATE, minimum=0.9 * expected, maximum=1.1 * expected)
    return float(np.nanmedian(track.frequency_hz))


def test_a_phrase_through_sfizz_sounds_as_livebass_renders_it(slap: Written) -> None:
    """Notes of every zone, sampled ones and their neighbours, soft to hard, thumb and pop."""
    hit = (20, 60, 90, 110, 127)
    keys = sorted({key for z in slap.pack.zones for key in (z.note, min(z.note + 1, z.highest))})
    notes = [(0.7 * k, 0.5, key, velocity) for k, (key, velocity) in enumerate((k, v) for k in keys for v in hit)]
    ours = render_to_array(slap.bass, score_of(notes, RATE), TINY.quality, tail=0.2).sum(axis=0)
    theirs = through_sfizz(slap.sfz, notes, RATE, notes[-1][0] + 0.7)
    levels = np.array([[level(s, start) for start, *_ in notes] for s in (ours, theirs)])
    apart = levels[1] - levels[0]
    assert abs(np.median(apart)) <= SAME_VOLUME, "as loud as the render"
    apart -= np.median(apart)
    for (_, _, key, velocity), found in zip(notes, apart.tolist(), strict=True):
        assert abs(found) <= SAME_LEVEL, f"key {key}, velocity {velocity}: {found:.1f} dB from what livebass plays"
    assert np.std(apart) <= SAME_LEVELS
    rises = np.diff(levels.reshape(2, len(keys), len(hit)), axis=2)
    clear = rises[0] > CLEAR_STEP
    assert clear.mean() > 0.7 and (rises[1][clear] > 0).all(), f"from velocity to velocity {rises} dB"
    for start, _, key, velocity in notes:
        if velocity == 20:
            wrong = cents(pitch(theirs, start, key) / pitch(ours, start, key))
            assert abs(wrong) <= SAME_PITCH, f"key {key}: {wrong:.1f} cents from what livebass plays"


def test_a_released_note_ends_as_under_the_hand(slap: Written) -> None:
    """In the 50 ms after its end a note falls as far in the sampler as in livebass, where each note falls differently.

    The samples leave out the hand's knock.
    """
    quiet = without_noise(slap.bass)
    for key in (28, 45):
        falls = []
        for length in (0.3, 0.5):
            note = [(0.0, length, key, 60)]
            ours = render_to_array(quiet, score_of(note, RATE), TINY.quality, tail=0.4).sum(axis=0)
            falls.append([level(s, 0.34, 0.02) for s in (ours, through_sfizz(slap.sfz, note, RATE, 0.6))])
        ours_fell, theirs_fell = np.subtract(falls[1], falls[0])
        assert ours_fell == pytest.approx(theirs_fell, abs=4.5) and ours_fell > 25


def test_a_sample_is_what_livebass_renders(slap: Written) -> None:
    """Except the floor, which every sampled note would add again."""
    bass = replace(slap.bass, player=replace(slap.bass.player, floor_noise=OFF))
    for sample in slap.pack.samples[:: len(slap.pack.samples) // 7]:
        note = single_note(sample.zone.note, sample.velocity, TINY.length, RATE)
        strings = render_to_array(bass, note, TINY.quality, tail=0.0, seed=sample.seed)
        assert np.flatnonzero(np.abs(strings).max(axis=1) > 0).tolist() == [sample.zone.string]
        ours, theirs = mix_strings(single(strings)), slap.sound(sample)
        until = round(0.7 * TINY.length * RATE)
        lowered = max(1.0, float(np.abs(ours).max()) / sfz.FULL)
        assert np.abs(ours[:until] / lowered - theirs[:until]).max() <= FULL_SCALE_STEP


def test_samples_begin_and_end_in_silence_and_never_clip(slap: Written) -> None:
    for sample in slap.pack.samples:
        sound = slap.sound(sample)
        peak = np.abs(sound).max()
        assert 1e-4 < peak <= sfz.FULL + FULL_SCALE_STEP
        assert abs(sound[0]) < 1e-3 * peak and np.abs(sound[-100:]).max() < 1e-3 * peak
        assert len(sound) <= TINY.length * RATE


def test_every_key_has_one_sample_for_every_velocity_and_turn(slap: Written) -> None:
    lowest, highest = slap.bass.note_range
    found = groups(slap.sfz)
    for key in range(lowest, highest + 1):
        mine = [g for g in found if g["lokey"] <= key <= g["hikey"]]
        assert [v for g in mine for v in range(g["lovel"], g["hivel"] + 1)] == list(range(1, 128))
        for g in mine:
            assert [int(r["seq_position"]) for r in g.regions] == [1, 2] and g["seq_length"] == 2
    listed = {region["sample"] for g in found for region in g.regions}
    assert listed == {file.name for file in (slap.folder / FOLDER).iterdir()}
    assert {entry.name for entry in slap.folder.iterdir()} == {"slap-impulse.sfz", sfz.LICENCE_FILE, FOLDER}
    assert "commercially" in (slap.folder / sfz.LICENCE_FILE).read_text()


def test_levels_go_on_from_layer_to_layer(slap: Written) -> None:
    found = groups(slap.sfz)
    for below, above in pairwise(found):
        if below["lokey"] == above["lokey"]:
            ends = [
                g.level + g.gain(v) + float(g.regions[0]["volume"])
                for g, v in ((below, below["hivel"]), (above, above["lovel"]))
            ]
            assert abs(ends[1] - ends[0]) < 0.5, f"keys {below['lokey']}: a step of {ends[1] - ends[0]:.2f} dB"
    for number, g in enumerate(found):
        velocity = slap.pack.velocities[number % 3]
        assert g.gain(velocity) + float(g.regions[0]["volume"]) == pytest.approx(0.0, abs=0.9)  # lowered hard notes


@pytest.mark.parametrize("preset", of_each_kind(preset_names()))
def test_a_key_is_on_the_string_that_the_player_chooses(preset: str) -> None:
    """The string that sounds on a bass at rest."""
    bass = load_preset(preset)
    pack = Pack(
        bass, preset, replace(TINY, quality=replace(QUALITIES["live"], modes=20, contact_rate=96e3, on_board=None))
    )
    for string, keys in enumerate(sfz.keys_by_string(bass)):
        assert keys
        for key in keys[:: max(1, len(keys) - 1)]:
            engine = pack.engine.another()
            engine.send(np.zeros(1, np.int64), np.array([[0x90, key, 60]], np.uint8))
            assert np.flatnonzero(np.abs(engine.process(480)).max(axis=1)).tolist() == [string]


def test_the_same_options_give_the_same_bytes_and_replace_an_older_pack(slap: Written, tmp_path: Path) -> None:
    assert files(write(tmp_path / "a", "slap-impulse").folder) == files(slap.folder)
    fewer = write(tmp_path / "a", "slap-impulse", replace(TINY, layers=1, robins=1))
    assert len(files(fewer.folder)) == len(fewer.pack.samples) + 2


def files(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.parametrize("layers", range(1, 13))
@pytest.mark.parametrize("player", [Player(), Player(hardest=0.5), Player(softest=2.0), Player(softest=0.0)])
def test_layers_are_sampled_where_they_are_played(player: Player, layers: int) -> None:
    chosen = sfz.velocities(player, layers)
    assert chosen[-1] == 127 and len(chosen) == layers and list(chosen) == sorted(set(chosen))
    ranges = sfz.edges(chosen)
    assert [v for low, high in ranges for v in range(low, high + 1)] == list(range(1, 128))
    assert all(low <= v <= high for v, (low, high) in zip(chosen, ranges, strict=True))


@pytest.mark.parametrize("curve", ["linear", "soft", "hard", ((1.0, 60.0), (40.0, 70.0), (127.0, 127.0))], ids=str)
def test_the_softest_notes_are_as_loud_as_the_velocity_curve_has_them(curve: Curve, tmp_path: Path) -> None:
    """Those below the lowest sampled velocity use its sample."""
    bass = load_preset("jazz-finger")
    bass = replace(bass, player=replace(bass.player, velocity_curve=curve, unevenness=0.0))
    pack = Pack(bass, "soft", replace(TINY, layers=3))
    lowest = pack.velocities[0]

    def loud(velocity: int) -> float:
        sample = replace(pack.samples[0], velocity=velocity)
        sound = sfz.play_sample(pack.engine.another(0), sample, 0.6)
        return level(sound, 0.0, sfz.LEVEL_TIME)

    stored = [sfz.Stored(loud(s.velocity) if s.zone == pack.zones[0] else 0.0, 0.0) for s in pack.samples]
    file = tmp_path / "soft.sfz"
    file.write_text(sfz.sfz_text(pack, stored))
    first = groups(file)[0]
    for velocity in {1, max(1, lowest // 4), max(1, lowest // 2)}:
        assert first.gain(velocity) - first.gain(lowest) == pytest.approx(loud(velocity) - loud(lowest), abs=2.5), (
            velocity
        )


def test_samples_have_no_floor(slap: Written) -> None:
    """Simultaneous notes would add it up."""
    player = replace(slap.bass.player, floor_noise=-40.0)
    pack = Pack(replace(slap.bass, player=player), "slap", TINY)
    pack.engine.send(np.array([0]), np.array([[0x90, slap.bass.strings[0].open_note, 100]], np.uint8))
    assert np.abs(pack.engine.process(4800)).max() > 1e-3 and pack.engine.floor is None


def test_an_even_player_takes_no_turns() -> None:
    assert Pack(load_preset("paper-g"), "paper-g", TINY).robins == 1


def test_a_zone_is_as_wide_as_asked(slap: Written) -> None:
    for frets in (1, 2, 3, 5):
        pack = Pack(slap.bass, "slap", replace(TINY, frets=frets))
        widths = [zone.highest - zone.lowest + 1 for zone in pack.zones]
        assert max(widths) <= frets and all(z.lowest <= z.note <= z.highest for z in pack.zones)
        assert {z.note for z in pack.zones} >= {s.open_note for s in slap.bass.strings}


def test_hostile_texts_of_a_preset_stay_comments() -> None:
    bass = load_preset("slap")
    strings = (replace(bass.strings[0], name="C#\n<region>"), *bass.strings[1:])
    pack = Pack(replace(bass, name="a\n<region> sample=x", description="\r\nkey=1", strings=strings), "slap", TINY)
    text = sfz.sfz_text(pack, [sfz.Stored(-20.0, 0.0)] * len(pack.samples))
    assert sum(line.startswith("<region>") for line in text.splitlines()) == len(pack.samples)
    assert not any("#" in sample.file for sample in pack.samples)


# Bad targets, with a sound that costs nothing.


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int]:
    """Noise samples, and an engine that is never made. Returns a list with an entry per sample played."""
    count: list[int] = []

    def played(*_: object) -> np.ndarray:
        count.append(1)
        return np.random.default_rng(len(count)).uniform(-0.5, 0.5, 5000).astype(np.float32)

    monkeypatch.setattr(sfz, "play_sample", played)
    monkeypatch.setattr(Pack, "engine", SimpleNamespace(another=lambda seed: None))
    monkeypatch.setattr("livebass.compiling.library.is_cached", lambda: True)
    monkeypatch.chdir(tmp_path)
    return count


SLAP = ("export", "sfz", "-p", "slap", "-o")


def test_a_pack_by_the_command(quick: list[int], run: Run, tmp_path: Path) -> None:
    status, out, err = run(*SLAP, "new/pack")
    assert status == 0 and not out
    said = err.splitlines()
    assert re.fullmatch(r"slap: 170 samples at velocities [\d, ]+, about \d+(\.\d+)? MB", said[0])
    assert re.fullmatch(r"new/pack/slap\.sfz: 170 samples, \d+ s, \d+(\.\d+)? MB", said[1])
    assert len(list(tmp_path.glob("new/pack/samples/*.flac"))) == 170
    assert cli_text(run, *SLAP, "new/pack", "--layers", "2") == ""
    assert len(list(tmp_path.glob("new/pack/samples/*.flac"))) == 68


def test_size_alone_writes_nothing(quick: list[int], run: Run, tmp_path: Path) -> None:
    text = cli_text(run, "export", "sfz", "-p", "slap", "--frets", "1", "--size")
    assert re.fullmatch(r"slap: 360 samples .*, about .* MB\n", text)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (["export", "wurst"], 2, "wurst"),
        (["export", "sfz"], 2, "-o DIR"),
        (["export", "sfz", "-o", "d", "-p", "none"], 1, "none"),
        (["export", "sfz", "-o", "d", "--layers", "0"], 2, "--layers"),
        (["export", "sfz", "-o", "d", "--robins", "1.5"], 2, "--robins"),
        (["export", "sfz", "-o", "d", "--frets", "nan"], 2, "--frets"),
        (["export", "sfz", "-o", "d", "--length", "0"], 2, "--length"),
        (["export", "sfz", "-o", "d", "--rate", "96001"], 2, "flac allows"),
        (["export", "sfz", "-o", "d", "-q", "best"], 2, "best"),
        (["export", "sfz", "-o", "file"], 1, "file: is not a directory"),
        (["export", "sfz", "-o", "file/deeper"], 1, "file/deeper: cannot be written: Not a directory"),
        (["export", "sfz", "-o", "full"], 1, "full: holds other files, such as notes.txt"),
        (["export", "sfz", "-o", f"{CLOSED}/pack"], 1, f"{CLOSED}/pack: cannot be written"),
    ],
    ids=str,
)
def test_bad_usage_and_bad_targets(
    quick: list[int], run: Run, tmp_path: Path, arguments: list[str], status: int, says: str
) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").write_text("mine")
    before = files(tmp_path)
    got, _, err = run(*arguments)
    err = "\n".join(line for line in err.splitlines() if not line.startswith("jazz-finger: "))
    assert_one_clear_line(got, err, (status,))
    assert says in err
    assert files(tmp_path) == before and not (tmp_path / "d").exists()


def test_a_name_that_is_none() -> None:
    with pytest.raises(OutputError, match="is not a directory name"):
        checked_directory(Path("a\0b"), lambda _: True)


@pytest.mark.parametrize("spoilt", ["samples/mine.flac", "notes.txt", "other.sfz", ".hidden"])
def test_a_pack_with_other_files_in_it_is_kept(quick: list[int], run: Run, tmp_path: Path, spoilt: str) -> None:
    cli_text(run, *SLAP, "pack", "--layers", "1")
    (tmp_path / "pack" / spoilt).write_text("mine")
    before = files(tmp_path)
    err = refusal(run, *SLAP, "pack", status=1)
    assert "holds other files" in err and files(tmp_path) == before


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize("how", ["interrupted", "full", "full at the end", "not moved"])
def test_nothing_half_written(
    quick: list[int], run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str, older: bool
) -> None:
    if older:
        cli_text(run, *SLAP, "made/pack", "--layers", "1")
    before = files(tmp_path)
    no_space = OSError(28, "No space left on device")
    if how == "interrupted":
        counting = threading.Lock()

        def played(*_: object) -> np.ndarray:
            with counting:  # several threads play: without it two of them could count past 90 before one looks
                quick.append(1)
                count = len(quick)
            if count in (90, 130):  # again: once, on a busy machine, the first did not end the export
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            if count >= 90:  # the main thread takes the signal, and has time before the last sample
                time.sleep(0.05)
            return np.zeros(100, np.float32)

        monkeypatch.setattr(sfz, "_measure_levels", lambda *_: played() is None or sfz.Stored(-20.0, 0.0))
    elif how == "full":
        sync, counted = os.fsync, []

        def fsync(fd: int) -> None:
            counted.append(fd)
            if len(counted) > 50:
                raise no_space
            sync(fd)

        monkeypatch.setattr(os, "fsync", fsync)
    elif how == "full at the end":
        monkeypatch.setattr(sfz, "sfz_text", lambda *_: (_ for _ in ()).throw(OutputError("slap.sfz: no space")))
    else:
        move = os.replace

        def move_or_not(source: Path, target: Path) -> None:
            if target == tmp_path / "made" / "pack" / FOLDER and ".old-" not in str(source):
                raise no_space
            move(source, target)

        monkeypatch.setattr(os, "replace", move_or_not)
    status, _, err = run(*SLAP, "made/pack")
    err = "\n".join(line for line in err.splitlines() if not line.startswith("slap: "))
    assert_one_clear_line(status, err, (130,) if how == "interrupted" else (1,))
    assert ".tmp" not in err and ("interrupted, nothing written" in err or "made/pack" in err or "slap.sfz" in err)
    assert files(tmp_path) == before
    assert (tmp_path / "made").exists() == older


def test_leftovers_of_a_killed_export_are_removed(quick: list[int], run: Run, tmp_path: Path) -> None:
    left = tmp_path / "pack" / ".tmp-0123abcd" / FOLDER
    left.mkdir(parents=True)
    (left / "half.flac").write_bytes(b"half")
    cli_text(run, *SLAP, "pack", "--layers", "1")
    assert {entry.name for entry in (tmp_path / "pack").iterdir()} == {"slap.sfz", sfz.LICENCE_FILE, FOLDER}


def test_a_tempered_bass_is_sampled_at_every_fret() -> None:
    """Samplers shift a sample by equal semitones: a zone of several frets would be out of tune."""
    settings = PackSettings(QUALITIES["live"], RATE, frets=3)
    default, lower = (Pack(load_preset("slap", a4=a4), "slap", settings) for a4 in (440, 432))
    own = Pack(load_preset("slap", temperament=[float(k) for k in range(12)]), "slap", settings)
    assert [z.note for z in lower.zones] == [z.note for z in default.zones] and len(own.zones) > len(default.zones)
    assert all(z.lowest == z.note == z.highest for z in own.zones)
    for pack, tuned in ((lower, True), (default, False)):
        text = sfz.sfz_text(pack, [sfz.Stored(0.0, 0.0)] * len(pack.samples))
        assert ("// Tuned to A = 432 Hz." in text) == tuned
