"""Players beside the synth, on a fake device: a score that pauses, loops and changes tempo, learned controllers,
metronome, tuner.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.hands import of_any
from support.live import QUICK, RATE, bass_of, offline, performer_of, play, synth_and_device
from support.messages import messages_of
from support.pitch import pitch
from support.tabs import hard_score

from livebass import load_preset
from livebass.kernels.player import performer
from livebass.kernels.player.words import STRING_REST, STROKE
from livebass.live.desk import FILE, LEAD, Desk, MidiLearn, check_controllers, click_sound, with_beats
from livebass.live.fake import FakeDevice
from livebass.live.parameters import NUMBERS, PARAMETERS
from livebass.live.recording import MidiRecorder
from livebass.live.status import clock
from livebass.live.synth import LiveBass, Synth
from livebass.live.thread.desk import BEAT, WEAK
from livebass.live.tuner import frequency_of, tuning, tuning_text
from livebass.model.keymap import MODO
from livebass.rows.techniques import GHOST, LEARNED, MAXIMUM, MINIMUM, PARAMETER, THUMB_ON_ALL
from livebass.score.phrases import demo_score
from livebass.score.reading import read_score
from livebass.score.score import Score, score_of

LEADING = round(LEAD * RATE)


def desk_and_device(score: Score | None = None, preset: str = "jazz-finger") -> tuple[Desk, Synth, FakeDevice]:
    """A desk whose score rolls, its synth and device."""
    desk = Desk()
    synth = Synth(RATE, adaptive=False, desk=desk)
    synth.keep_messages()
    synth.switch_to(LiveBass(load_preset(preset), QUICK, RATE))
    if score:
        desk.load(score)
        desk.rolling = True
    return desk, synth, FakeDevice(synth)


def end_messages(desk: Desk, synth: Synth, device: FakeDevice) -> list[tuple[int, ...]]:
    """The messages that end the sounding notes when the score stops."""
    desk.rolling = False
    synth.played()
    play(device, 64)
    return [m[1:] for m in synth.played()]


def notes_of(synth: Synth) -> list[tuple[int, int]]:
    """(frame, key) of the note-ons since the last call."""
    return [(frame, first) for frame, status, first, second in synth.played() if status & 0xF0 == 0x90 and second]


def tune(*keys: int, every: float = 0.1) -> Score:
    """Notes `every` seconds apart, from 0 on."""
    return score_of([(k * every, every / 2, key, 100) for k, key in enumerate(keys)], RATE)


@pytest.mark.parametrize("size", [64, 1, 4096])
def test_a_score_sounds_as_rendered(size: int) -> None:
    score = demo_score(RATE, "finger")
    _, _, device = desk_and_device(score)
    frames = 4096 if size == 1 else 2 * RATE
    heard = play(device, LEADING + frames, size)
    assert not heard[:LEADING].any()
    assert np.array_equal(heard[LEADING:], offline("jazz-finger", messages_of(score), frames))


def test_a_tablature_sounds_as_rendered(tmp_path: Path) -> None:
    score = hard_score(tmp_path)
    _, _, device = desk_and_device(score)
    heard = play(device, LEADING + 2 * RATE)
    later = [(row[0] + LEADING, *row[1:]) for row in score.strokes]
    assert np.array_equal(heard, offline("jazz-finger", later, LEADING + 2 * RATE))


def test_a_pause_rests_the_strings_of_a_tablature(tmp_path: Path) -> None:
    """Its last stroke is bent and palm-muted; a note that the player holds sounds on."""
    score = hard_score(tmp_path)
    desk, synth, device = desk_and_device(score)
    play(device, LEADING + score.end_frame - 2400)
    synth.send(0x90, 55, 90)
    play(device, 64)
    hands, controls = (performer_of(synth)[name] for name in ("hands", "controls"))
    held = int(hands["latest"])
    assert hands["palmed"] and controls["string_bend"].any() and hands["state"].astype(bool).sum() == 2
    assert {message[0] for message in end_messages(desk, synth, device)} == {STRING_REST}
    assert (
        not hands["palmed"] and not controls["string_bend"].any() and np.flatnonzero(hands["state"]).tolist() == [held]
    )
    assert end_messages(desk, synth, device) == [], "once"


def test_a_loop_of_a_tablature_begins_with_strings_at_rest(tmp_path: Path) -> None:
    """Each turn has the same strokes; the first is straight, though the turn before ends with a bend."""
    score = hard_score(tmp_path)
    desk, synth, device = desk_and_device(score)
    desk.loop = (0.0, score.end_frame / RATE)
    play(device, LEADING + 64)
    synth.played()
    for _ in range(2):
        play(device, score.end_frame)
        kinds = [status for _, status, *_ in synth.played()]
        assert kinds.count(STROKE) == score.notes and kinds.count(STRING_REST) == 4


def test_a_pause_ends_what_the_score_holds_and_nothing_else() -> None:
    """The next note comes after the rest of its time."""
    desk, synth, device = desk_and_device(score_of([(0.0, 0.5, 33, 100), (0.2, 0.1, 40, 100)], RATE))
    synth.send(0x90, 50, 90)  # the player's
    play(device, LEADING + 4800)
    assert desk.position == pytest.approx(0.1)
    desk.rolling = False
    synth.played()
    play(device, RATE)
    assert [(status, first) for _, status, first, _ in synth.played()] == [(0x80, 33)]
    assert desk.position == pytest.approx(0.1) and not desk.rolling
    desk.rolling = True
    began = synth.frame
    play(device, 9600)
    assert notes_of(synth) == [(began + 4800, 40)]


@pytest.mark.parametrize("size", [64, 1000, 4800])
def test_a_loop_comes_round_at_its_frame(size: int) -> None:
    desk, synth, device = desk_and_device(tune(30, 31, 32, 33, 34))
    desk.loop = (0.1, 0.3)
    play(device, RATE, size)
    assert notes_of(synth) == [(4800 * k, 31 + k % 2) for k in range(10)], "it begins there, too"
    desk.loop = None
    play(device, RATE, size)
    assert [key for _, key in notes_of(synth)][-2:] == [33, 34]


@pytest.mark.parametrize("size", [64, 1000])
def test_played_once_a_score_stops_at_its_end_and_waits_at_its_beginning(size: int) -> None:
    """It ends its pedal and held notes at that frame, whatever the blocks; then it can roll again."""
    score = score_of([(0.0, 5.0, 33, 100), (0.05, 0.02, 40, 100)], RATE, controls=[(0.01, 64, 127)])
    desk, synth, device = desk_and_device(score)
    desk.loop = (0.0, 0.2)
    desk.record["once"] = 1
    play(device, LEADING + round(0.5 * RATE), size)
    end = LEADING + round(0.2 * RATE)
    last = [m for m in synth.played() if m[0] >= end]
    assert last == [(end, 0x80, 33, 0), (end, 0xB0, 64, 0)]
    assert not desk.rolling and desk.position == 0
    desk.rolling = True
    play(device, 64)
    assert [key for _, key in notes_of(synth)] == [33]


def test_a_loop_at_another_tempo_keeps_its_time() -> None:
    """A hundred turns of a fractional number of frames, in blocks of any length."""
    heard = []
    for size in (64, 1999):
        desk, synth, device = desk_and_device(tune(30, 31, 32))
        desk.tempo = 0.77
        desk.loop = (0.0, 0.10001)
        device.block(round(LEADING / 0.77))
        play(device, 10 * RATE, size)
        heard.append([frame for frame, key in notes_of(synth) if key == 30])
    turns = np.array(heard[0])
    assert heard[0] == heard[1] and len(turns) > 70
    assert np.abs(np.diff(turns) - round(0.10001 * RATE) / 0.77).max() < 2  # frames, each end rounded to a whole one
    assert abs((turns[-1] - turns[0]) / (len(turns) - 1) - round(0.10001 * RATE) / 0.77) < 0.03


def test_nothing_a_player_does_to_a_score_leaves_a_note_behind() -> None:
    """Random jumps, loops, tempos and pauses in blocks of any length: the sound is finite, and silent after a pause."""
    rng = np.random.default_rng(7)
    desk, synth, device = desk_and_device(demo_score(RATE, "slap"), "slap")
    for _ in range(150):
        what = int(rng.integers(0, 5))
        if what == 0:
            desk.seek(float(rng.uniform(-1, 11)))
        elif what == 1:
            begin = float(rng.uniform(0, 8))
            desk.loop = None if rng.random() < 0.3 else (begin, begin + float(rng.uniform(0.1, 1)))
        elif what == 2:
            desk.tempo = float(rng.uniform(0.1, 4))
        elif what == 3:
            desk.rolling = bool(rng.integers(0, 2))
        assert np.isfinite(device.block(int(rng.integers(1, 3000)))).all()
    desk.rolling = False
    play(device, 64)
    held = [second for _, status, _, second in synth.played() if status & 0xF0 == 0x90]
    assert len(held) > 20
    assert not performer_of(synth)["hands"]["state"].any() and synth.meters().faults == 0


def test_a_loop_of_a_part_ends_the_notes_that_reach_beyond_it() -> None:
    desk, synth, device = desk_and_device(score_of([(0.0, 2.0, 30, 100), (1.0, 0.1, 40, 100)], RATE))
    desk.loop = (0.0, 0.5)
    play(device, LEADING + 40000)
    said = [(frame - LEADING, status) for frame, status, *_ in synth.played()]
    assert said == [(0, 0x90), (24000, 0x80), (24000, 0x90)]
    desk.loop = (0.2, 10.0)
    assert desk.loop == (0.2, 2.0), "no farther than the end"
    for part in ((1.0, 1.01), (3.0, 4.0)):
        with pytest.raises(ValueError, match="loop must be a part"):
            desk.loop = part
        assert desk.loop is None
    desk.loop = (0.0, 0.0)
    assert desk.loop == (0.0, 2.0)


@pytest.mark.parametrize("tempo", [0.8, 0.5, 2.0])
def test_the_tempo_moves_notes_and_not_their_pitch(tempo: float) -> None:
    desk, synth, device = desk_and_device(tune(30, 31, 32))
    desk.tempo = tempo
    play(device, round(LEADING / tempo) + RATE, 333)
    frames, keys = zip(*notes_of(synth), strict=True)
    assert keys == (30, 31, 32)
    assert np.abs(np.diff(frames) - 4800 / tempo).max() <= 1
    for size in (64, 1000):  # the block length changes nothing
        other, again, its_device = desk_and_device(tune(30, 31, 32))
        other.tempo = tempo
        play(its_device, round(LEADING / tempo) + RATE, size)
        assert notes_of(again) == list(zip(frames, keys, strict=True))
    desk.tempo = 99.0
    assert desk.tempo == 4.0


def test_a_place_that_is_gone_to_has_its_controllers() -> None:
    """The last bend and volume before it; RPNs and later messages are not sent."""
    score = score_of(
        [(k / 10, 0.05, 30 + k, 100) for k in range(10)], RATE, bends=[(0.2, 0.5), (0.35, -0.5), (0.8, 1.0)]
    )
    desk, synth, device = desk_and_device(score)
    play(device, LEADING)
    desk.seek(0.5)
    play(device, 4800)
    sent = [(status, first, second) for _, status, first, second in synth.played()]
    assert [m for m in sent if m[0] == 0xE0] == [(0xE0, 0, 32)]
    assert [m[1] for m in sent if m[0] == 0x90] == [35]
    desk.seek(0.0)
    play(device, 64)
    assert [m[1:3] for m in (e[1:] for e in synth.played()) if m[0] == 0xE0] == [(0, 64)], "in the middle again"
    desk.seek(99.0)
    play(device, 64)
    assert desk.position == pytest.approx(desk.length, abs=0.01)


def test_a_file_is_looped_to_its_own_end(tmp_path: Path) -> None:
    import mido

    track = mido.MidiTrack([mido.Message("program_change", program=33), mido.Message("note_on", note=30, time=0)])
    track += [mido.Message("note_off", note=30, time=100), mido.MetaMessage("end_of_track", time=860)]
    midi = mido.MidiFile(ticks_per_beat=480)
    midi.tracks.append(track)
    midi.save(tmp_path / "a.mid")
    desk, synth, device = desk_and_device(read_score(tmp_path / "a.mid", RATE))
    assert desk.length == pytest.approx(1.0)
    desk.loop = (0.0, 0.0)
    play(device, LEADING + 3 * RATE)
    assert [frame - LEADING for frame, _ in notes_of(synth)] == [0, RATE, 2 * RATE]


def test_a_score_goes_on_at_another_rate() -> None:
    desk, _, device = desk_and_device(tune(30, 31, 32))
    play(device, LEADING)
    slower = Synth(24000, adaptive=False, desk=desk)
    slower.keep_messages()
    slower.switch_to(LiveBass(load_preset("jazz-finger"), QUICK, 24000))
    play(FakeDevice(slower), 24000)
    assert notes_of(slower) == [(0, 30), (2400, 31), (4800, 32)]


# ---- learned controllers


def test_a_learned_controller_moves_its_parameter_and_nothing_else() -> None:
    desk, synth, device = desk_and_device()
    desk.learn("tone", 74)
    desk.learn("tone", 7)
    desk.learn("dynamics", 20)
    assert desk.learned == {"tone": 7, "dynamics": 20}
    for controller, value in ((74, 1), (7, 0), (20, 127)):
        synth.receive(0xB0, controller, value)
    device.block(64)
    kept = [(0xB0, 74, 1), (0xB0, LEARNED + NUMBERS["tone"], 0), (0xB0, LEARNED + NUMBERS["dynamics"], 127)]
    assert [m[1:] for m in synth.played()] == kept, "7 is no volume any more; a take has what it stands for"
    assert synth.value(PARAMETER, NUMBERS["tone"]) == -1 and synth.value(PARAMETER, NUMBERS["dynamics"]) == 12
    desk.learn("tone", None)
    synth.receive(0xB0, 7, 64)
    device.block(64)
    assert [m[1:] for m in synth.played()] == [(0xB0, 7, 64)] and desk.learned == {"dynamics": 20}


def test_a_take_with_learned_controllers_renders_as_it_sounded(tmp_path: Path) -> None:
    """A learned controller moved each parameter, on any channel; the map's controllers moved too."""
    desk, synth, device = desk_and_device()
    learned = {symbol: 20 + number for symbol, number in NUMBERS.items()}
    for symbol, controller in learned.items():
        desk.learn(symbol, controller)
    heard = []
    with MidiRecorder(tmp_path / "take.mid", synth, "jazz-finger") as take:
        for k, (symbol, controller) in enumerate(learned.items()):
            # the gain moves the synth's own, whose ramp differs
            moved = [] if symbol == "gain" else [(0xB2, controller, 10 + 15 * k)]
            note, controls = [(0x92, 40 + k, 100)], [(0xB2, 18, 20 * k), (0xE2, 0, 100)]
            for messages in (moved, note, controls, [(0x82, 40 + k, 0)]):
                for message in messages:
                    synth.receive(*message)
                heard.append(device.block(1000))
        take.turn()
    score = read_score(tmp_path / "take.mid", RATE)
    sent = {tuple(map(int, m[1:])) for m in score.messages if m[0] & 0xF0 == 0xB0}
    assert {(LEARNED + NUMBERS["tone"], 25), (LEARNED + NUMBERS["bend_range"], 115)} <= sent
    sound = np.concatenate(heard)
    assert np.array_equal(sound, offline("jazz-finger", messages_of(score), len(sound)))


def test_a_take_keeps_a_learned_gain(tmp_path: Path) -> None:
    desk, synth, device = desk_and_device()
    desk.learn("gain", 20)
    with MidiRecorder(tmp_path / "take.mid", synth, "jazz-finger") as take:
        synth.receive(0xB0, 20, 64)
        play(device, 4800)
        synth.receive(0x90, 40, 100)
        sound = play(device, 4800)
        take.turn()
    messages = messages_of(read_score(tmp_path / "take.mid", RATE))
    assert np.abs(sound).max() > 0.01
    assert np.allclose(sound, offline("jazz-finger", messages, 9600)[4800:], rtol=1e-4, atol=1e-7)


def test_another_bass_takes_over_keys_and_controllers() -> None:
    """Except keys with another meaning in its map."""
    _, synth, device = desk_and_device()
    for key in (10, 3, 16):
        synth.send(0x90, key, 1)
    for number, value in ((17, 20), (18, 30), (5, 0), (5, 9)):
        synth.send(0xB0, number, value)
    device.block(64)
    old = bass_of(synth)
    keys = replace(MODO, keys=tuple(row for row in MODO.keys if row[0] != 3))
    other = load_preset("slap")
    synth.switch_to(LiveBass(replace(other, player=replace(other.player, keys=keys)), QUICK, RATE))
    device.block(64)
    new = bass_of(synth)
    assert new is not old
    p, before = new.engine.performer[0], old.engine.performer[0]
    assert p["switched"].sum() == 2 and p["switched"][GHOST] == 1 and p["forced"] == 0
    for name in ("blend", "level"):
        assert p["controls"][name] == before["controls"][name], name
    assert p["controls"]["channel"].tobytes() == before["controls"]["channel"].tobytes()
    assert p["tone"] == before["tone"] < 0
    assert p["controls"]["blend"] < 0 and of_any(p)["bend_up"] > 0
    synth.send(0x80, 10, 0)
    synth.send(0x80, 3, 0)
    device.block(64)
    assert p["switched"].sum() == 1


def test_a_controller_in_its_middle_leaves_the_parameter_as_the_bass_has_it() -> None:
    desk, synth, device = desk_and_device()
    for symbol, number in NUMBERS.items():
        desk.learn(symbol, 20)
        values = []
        for value in range(128):
            synth.receive(0xB0, 20, value)
            device.block(16)
            values.append(synth.value(PARAMETER, number))
        maximum = {"gain": 0, "technique": THUMB_ON_ALL}.get(symbol, MAXIMUM[number])  # the stroke takes its first four
        assert values == sorted(values) and values[0] == MINIMUM[number] and values[-1] == maximum
        if symbol != "gain":
            assert values[64 if MINIMUM[number] < 0 else 0] == 0
        if PARAMETERS[number].whole:
            assert {value % 1 for value in values} == {0}


def test_midi_learn_takes_the_control_that_moves(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "livebass")
    desk, synth, device = desk_and_device()
    learn = MidiLearn(desk, ["tone", "dynamics"])
    for controller in (101, 74, 21):  # RPN, which no knob sends, is skipped
        synth.receive(0xB0, controller, 5)
        device.block(64)
        learn.turn()
    assert desk.learned == {"tone": 74, "dynamics": 21}
    desk, synth, device = desk_and_device()
    learn = MidiLearn(desk)
    synth.receive(0xB0, 3, 5)
    learn.turn()
    assert desk.learned == {}
    for _ in range(2):
        learn.next_parameter()
    synth.receive(0xB0, 3, 5)
    learn.turn()
    assert desk.learned == {"tone": 3}
    assert caplog.messages[-3:] == [
        "MIDI learn: move a control for gain", "MIDI learn: move a control for tone", "controller 3 now moves tone",
    ]  # fmt: skip
    for _ in range(len(NUMBERS) + 1):
        learn.next_parameter()
    assert caplog.messages[-1] == "MIDI learn has ended"


def test_controllers_that_cannot_be_learned_are_one_line() -> None:
    assert check_controllers({"tone": 74, "gain": 7}) == {"tone": 74, "gain": 7}
    for bad in ({"nix": 1}, {"tone": 120}, {"tone": "x"}, {"tone": True}, {"tone": 6}, {"tone": 1, "gain": 1}):
        with pytest.raises(ValueError) as caught:
            check_controllers(bad)
        assert "\n" not in str(caught.value)


# ---- metronome and tuner


@pytest.mark.parametrize("size", [64, 777, 4096])
def test_the_metronome_clicks_to_the_frame_and_is_not_in_the_take(size: int) -> None:
    desk, synth, device = desk_and_device()
    synth.start_recording()
    desk.click(130.0, RATE, 1000)
    heard = play(device, 3 * RATE, size)
    expected, click = np.zeros(3 * RATE + len(click_sound(RATE)), np.float32), click_sound(RATE)
    for k in range(100):
        begin = 1000 + int(np.ceil(k * 60 / 130 * RATE))
        if begin < 3 * RATE:
            expected[begin : begin + len(click)] += click
    assert np.array_equal(heard, expected[: 3 * RATE]) and np.abs(heard).max() > 0.1
    assert not synth.recorded().any()
    desk.click(0.0, RATE, 0)
    assert not play(device, RATE).any()


@pytest.mark.parametrize("size, count_in", [(64, False), (777, True)])
def test_the_metronome_clicks_at_the_beats_of_a_score(size: int, count_in: bool) -> None:
    beats = ((0, True), (6000, False), (10000, False), (15000, True))
    score = with_beats(replace(tune(40), beats=beats, file_end=20000), count_in)
    heard = []
    for way in (FILE, 0.0):
        desk, synth, device = desk_and_device(score)
        desk.click(way, RATE, 0)
        heard.append(play(device, LEADING + 40000, size))
    assert notes_of(synth) == [(LEADING + 15000 * count_in, 40)]
    expected, click = np.zeros(LEADING + 40000, np.float32), click_sound(RATE)
    for at, begins in (*((beats[:3]) if count_in else ()), *((at + 15000 * count_in, begins) for at, begins in beats)):
        expected[LEADING + at : LEADING + at + len(click)] += click * (1.0 if begins else WEAK)
    assert np.allclose(heard[0] - heard[1], expected, atol=1e-6)


def test_an_upbeat_is_counted_in_by_the_rest_of_its_bar() -> None:
    beats = ((0, True), (5000, True), (10000, False), (15000, False), (20000, True))
    score = with_beats(replace(tune(40), beats=beats, file_end=35000), count_in=True)
    clicks = score.messages[:, 0] == BEAT
    assert score.frames[clicks].tolist() == [0, 5000, 10000, 15000, 20000, 25000, 30000]
    assert score.messages[clicks, 1].tolist() == [1, 0, 1, 1, 0, 0, 1]


@pytest.mark.parametrize("key", [28, 33, 40, 48])
def test_the_tuner_hears_the_note_and_how_far_it_is_off(key: int) -> None:
    _, synth, device = desk_and_device()
    synth.start_recording()
    synth.send(0x90, key, 50)
    play(device, RATE // 2)
    synth.recorded()
    found = tuning(frequency_of(synth.recent, RATE))
    assert found is not None and found[0] == {28: "E1", 33: "A1", 40: "E2", 48: "C3"}[key] and abs(found[1]) < 10
    synth.send(0xE0, 0, 72)  # a quarter of a semitone up
    play(device, RATE // 2)
    synth.recorded()
    bent = tuning(frequency_of(synth.recent, RATE))
    assert bent is not None and bent[0] == found[0] and bent[1] - found[1] == pytest.approx(25, abs=4)


@pytest.mark.parametrize("preset", ["jazz-finger", "precision-finger", "slap", "fretless", "six-string"])
def test_the_tuner_reads_the_first_partial_of_a_hard_pluck(preset: str) -> None:
    """Within 2 cents, half a second after it; the period of the whole sound is up to 60 cents sharp, or missing."""
    synth, device = synth_and_device(preset, adaptive=False)
    synth.start_recording()
    key_of = {pitch_class: key for key, name, pitch_class in MODO.keys if name == "string"}
    for number, string in enumerate(load_preset(preset).strings):
        note, switch = string.open_note + (0, 5, 12)[number % 3], key_of[string.open_note % 12]
        synth.send(0xB0, 120, 0)
        play(device, RATE // 50)
        for status, key, velocity in ((0x90, switch, 64), (0x90, note, 100), (0x80, switch, 0)):
            synth.send(status, key, velocity)
        sound = play(device, RATE // 2)
        synth.recorded()
        read = frequency_of(synth.recent, RATE)
        around = np.concatenate([sound, play(device, RATE // 10)])[-2 * (RATE // 5) :]  # the middle of `recent`
        first = pitch(around.astype(float), RATE, 440 * 2 ** ((note - 69) / 12))
        assert abs(1200 * np.log2(read / first)) < 2, (string.name, note, read, first)


def test_a_first_partial_that_is_missing_is_read_from_the_others() -> None:
    t = np.arange(RATE // 5) / RATE
    sound = sum(np.sin(2 * np.pi * 41.5 * k * t + k) / k for k in (2, 3, 4, 5))
    assert 1200 * np.log2(frequency_of(np.asarray(sound, np.float32), RATE) / 41.5) == pytest.approx(0, abs=1)


def test_the_tuner_says_nothing_of_silence_and_noise() -> None:
    rng = np.random.default_rng(1)
    for sound in (np.zeros(0), np.zeros(5000), rng.normal(size=100), rng.normal(size=6000)):
        assert tuning_text(frequency_of(sound.astype(np.float32), RATE)) == "-"
    assert tuning_text(440.0 * 2 ** (0.12 / 12)) == "A4 +12 cents" and tuning_text(54.0) == "A1 -32 cents"
    assert tuning_text(54.0, 432.0) == "A1 +0 cents (A = 432 Hz)" and tuning_text(float("nan"), 432.0)[0] == "-"


def test_the_clock_of_a_score() -> None:
    assert [clock(s) for s in (-0.2, 0.0, 59.9, 65.0, 3600.0)] == ["0:00", "0:00", "0:59", "1:05", "60:00"]


def file_of(path: Path, *messages: tuple[float, tuple[int, ...]]) -> Score:
    """Writes messages (s, data) as a MIDI file and reads it."""
    import mido

    track, last = mido.MidiTrack(), 0
    for at, data in messages:
        track.append(mido.Message.from_bytes(data, time=round(1000 * at) - last))
        last = round(1000 * at)
    mido.MidiFile(type=0, ticks_per_beat=500, tracks=[track]).save(path)
    return read_score(path, RATE)


def test_a_place_that_is_gone_to_has_its_mode_and_the_bends_of_its_channels(tmp_path: Path) -> None:
    """As if played from the beginning; what was sent already is not sent again."""
    score = file_of(
        tmp_path / "a.mid",
        (0.0, (0xC0, 33)), (0.0, (0xB0, 126, 4)), (0.0, (0xB0, 101, 0)), (0.0, (0xB0, 100, 0)), (0.0, (0xB0, 6, 7)),
        (0.0, (0xE0, 0, 90)), (0.0, (0xE3, 0, 70)), (0.0, (0xB3, 74, 9)), (0.1, (0x93, 28, 90)), (0.2, (0x90, 43, 90)),
        (0.3, (0xE0, 0, 100)), (0.4, (0x83, 28, 0)), (0.4, (0x80, 43, 0)), (0.5, (0x90, 45, 80)), (0.9, (0x80, 45, 0)),
    )  # fmt: skip
    desk, synth, device = desk_and_device(score)
    desk.seek(0.35)
    play(device, 64)
    reported = [m[1:] for m in synth.played()]
    assert reported == [
        (0xB0, 126, 4), (0xB0, 101, 0), (0xB0, 100, 0), (0xB0, 6, 7), (0xE3, 0, 70), (0xB3, 74, 9), (0xE0, 0, 100),
    ]  # fmt: skip
    p = performer_of(synth)
    assert p["controls"]["mode"] == performer.STRING_A_CHANNEL and p["controls"]["channel_range"] == 7.0
    desk.seek(0.25)
    play(device, 64)
    assert [m[1:] for m in synth.played()] == [
        (0xE0, 0, 64), (0xE3, 0, 64), (0xE0, 0, 90), (0xE3, 0, 70), (0xB3, 74, 9),
    ]  # fmt: skip
    desk.seek(0.15)
    play(device, RATE // 10)
    assert end_messages(desk, synth, device) == [(0x80, 43, 0), (0xE0, 0, 64), (0xE3, 0, 64)]


def test_a_place_before_a_mode_is_in_none(tmp_path: Path) -> None:
    score = file_of(
        tmp_path / "a.mid", (0.0, (0xC0, 33)), (0.1, (0x90, 40, 90)), (0.2, (0x80, 40, 0)), (0.3, (0xB0, 126, 4)),
        (0.4, (0x90, 45, 90)), (0.5, (0x80, 45, 0)),
    )  # fmt: skip
    desk, synth, device = desk_and_device(score)
    play(device, LEADING + 19500)
    assert performer_of(synth)["controls"]["mode"] == performer.STRING_A_CHANNEL
    desk.seek(0.0)
    play(device, 64)
    assert performer_of(synth)["controls"]["mode"] == performer.ALL_ALIKE


def test_a_place_that_is_gone_to_has_what_each_channel_has(tmp_path: Path) -> None:
    """Wheels, controllers, pedals, ranges and tunings, forth and back, as if played from the beginning."""

    def rpn(channel: int, number: int, whole: int) -> list[tuple[int, ...]]:
        return [(0xB0 | channel, k, x) for k, x in ((101, 0), (100, number), (6, whole))]

    begin = [(0xC0 | c, 33) for c in (0, 1)]
    first = [*rpn(0, 0, 7), *rpn(1, 2, 62), (0xB1, 7, 90), (0xE0, 0, 90), (0x90, 28, 90), (0x91, 40, 90)]
    second = [*rpn(1, 0, 5), *rpn(1, 1, 70), *rpn(0, 2, 65), (0xB0, 7, 40), (0xB1, 64, 127), (0xE1, 0, 30)]
    ends = [(0x80, 28, 0), (0x81, 40, 0), (0xB1, 64, 0)]
    timed = ((0.0, begin), (0.01, first), (0.3, second), (0.4, [(0x90, 43, 90)]), (0.9, [(0x80, 43, 0), *ends]))
    score = file_of(tmp_path / "a.mid", *((at, data) for at, part in timed for data in part))

    def records(*places: float) -> dict[str, list[float]]:
        desk, synth, device = desk_and_device(score)
        play(device, LEADING)
        for place in places:
            desk.seek(place)
            play(device, 64)
        p = performer_of(synth)
        names = ("wheel", "range", "fine", "coarse", "pedal", "volume")
        return {name: p["controls"]["channel"][name][:3].tolist() for name in names}

    early, late = records(0.1), records(0.35)
    assert early | {"wheel": []} == {
        "wheel": [], "range": [7, 2, 2], "fine": [8192] * 3, "coarse": [0, -2, 0], "pedal": [0] * 3,
        "volume": [1, 90 / 127, 1],
    }  # fmt: skip
    assert early["wheel"] == pytest.approx([26 * 128 / 8191, 0, 0])
    assert late["range"] == [7, 5, 2] and late["coarse"] == [1, -2, 0] and late["pedal"] == [0, 1, 0]
    assert late["fine"] == [8192, 70 << 7, 8192] and late["volume"] == [40 / 127, 90 / 127, 1]
    assert records(0.35, 0.1) | {"volume": []} == early | {"volume": []}
    assert records(0.1, 0.35) == records(0.35, 0.1, 0.35) == late
    assert records(0.35, 0.0)["coarse"] == [0] * 3 and records(0.35, 0.0)["range"] == [2.0] * 3


def test_a_pause_lifts_the_pedal_of_every_channel(tmp_path: Path) -> None:
    score = file_of(
        tmp_path / "a.mid", (0.0, (0xC1, 33)), (0.0, (0xC2, 33)), (0.0, (0xB1, 64, 127)), (0.0, (0xB2, 64, 127)),
        (0.01, (0x91, 28, 90)), (0.01, (0x92, 33, 90)), (0.02, (0xB2, 64, 0)), (0.5, (0x81, 28, 0)),
        (0.5, (0x82, 33, 0)),
    )  # fmt: skip
    desk, synth, device = desk_and_device(score)
    play(device, LEADING + 4800)
    assert end_messages(desk, synth, device) == [(0x81, 28, 0), (0x82, 33, 0), (0xB1, 64, 0)]


def test_a_program_in_mid_file_is_sent_and_comes_back_with_the_loop(tmp_path: Path) -> None:
    """Except in a file played on one bass, as asked for."""
    score = file_of(
        tmp_path / "a.mid", (0.0, (0xC0, 33)), (0.0, (0x90, 40, 90)), (0.1, (0x80, 40, 0)), (0.2, (0xC0, 36)),
        (0.2, (0x90, 41, 90)), (0.3, (0x80, 41, 0)),
    )  # fmt: skip
    for wanted, programs in ((score, [36, 33, 36, 33]), (score.on_one_bass(), [])):
        desk, synth, device = desk_and_device(wanted)
        desk.loop = (0.0, 0.0)
        play(device, LEADING + round(0.65 * RATE))
        said = synth.played()
        assert [m[2] for m in said if m[1] == 0xC0] == programs
        assert [m[2] for m in said if m[1] == 0x90] == [40, 41, 40, 41, 40]
