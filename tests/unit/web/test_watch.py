"""A page watches the bass of `livebass play`: the data sent, its receivers, and the unchanged sound."""

from __future__ import annotations

import http.client
import json
from collections.abc import Iterator
from urllib.parse import urlsplit

import numpy as np
import pytest
from support.browser import PATIENCE
from support.live import RATE, bass_of, feed, play, run_ahead, synth_and_device
from support.watched import FINE, TOKEN, watched

from livebass import load_preset
from livebass.live.synth import LiveBass, Synth
from livebass.live.thread.sight import SIGHT, see_bass
from livebass.live.watch_stream import Watcher
from livebass.score.score import score_of
from livebass.web.serve import PageServer
from livebass.web.watch import LENGTHS, STREAM

HARD = [(0.06 * k, 0.25, 28 + 5 * (k % 4) + 5 * (k // 4) % 12, 127 - 5 * k) for k in range(8)]
EVERY, LOOKS = 7, 50  # blocks between two looks


@pytest.fixture
def served() -> Iterator[tuple[PageServer, Synth]]:
    with watched() as both:
        yield both


@pytest.mark.parametrize("preset", ["jazz-finger", "fretless"])
@pytest.mark.parametrize("ahead", ["never", "far"])
def test_all_contacts_and_notes_are_told_once_they_are_heard(preset: str, ahead: str) -> None:
    """Even for strings that run ahead of the clock and are taken back; the samples are the same without a watcher."""
    sounds, contacts, notes = [], [], []
    for looks in (False, True):
        synth, device = synth_and_device(preset, FINE)
        run_ahead(synth, ahead)
        feed(synth, score_of(HARD, RATE))
        bass = bass_of(synth)
        onlooker, sound = Watcher(bass), []
        assert onlooker.look(0) is None
        for k in range(LOOKS * EVERY):
            sound.append(device.block(64).copy())
            if not looks or k % EVERY < EVERY - 1:
                continue
            seen = onlooker.look(synth.frame)
            assert seen and all(frame <= synth.frame for _, _, frame, _ in seen.contacts)
            contacts += seen.contacts
            notes += seen.notes
            sights = np.zeros(4, SIGHT)
            see_bass(bass.address, sights.ctypes.data)
            assert sights.tobytes() == seen.sights.tobytes()
        sounds.append(np.concatenate(sound))
    assert np.array_equal(*sounds)
    assert len(notes) == len(HARD)
    synth, device = synth_and_device(preset, FINE)
    run_ahead(synth, "never")
    feed(synth, score_of(HARD, RATE))
    play(device, LOOKS * EVERY * 64)
    assert len(contacts) == sum(int(v.record["logged"][0]) for v in bass_of(synth).engine.voices) > 10
    if preset == "jazz-finger":
        assert all(fret == int(fret) and 1 <= fret <= 20 for _, fret, _, _ in contacts)
    else:
        assert all(0 < place < 0.9 and place != int(place) for _, place, _, _ in contacts)


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        (f"/{TOKEN}/", {}, 200),
        (f"/{TOKEN}/app.js?v=1", {}, 200),
        ("/", {}, 403),
        (f"/{STREAM}", {}, 403),
        (f"/{TOKEN}x/{STREAM}", {}, 403),
        (f"/{TOKEN[:-1]}/{STREAM}", {}, 403),
        (f"/{TOKEN}/{STREAM}", {"Host": "elsewhere.example"}, 403),
        (f"/{TOKEN}/{STREAM}", {"Origin": "http://elsewhere.example"}, 403),
        (f"/{TOKEN}/livebass.wasm", {}, 404),
    ],
)
def test_only_who_knows_the_token_gets_anything(
    served: tuple[PageServer, Synth], path: str, headers: dict[str, str], status: int
) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", urlsplit(served[0].address).port, timeout=PATIENCE)
    connection.request("GET", path, headers=headers)
    assert connection.getresponse().status == status
    connection.close()


def test_the_stream_tells_the_bass_then_what_it_does_and_follows_another(served: tuple[PageServer, Synth]) -> None:
    made, synth = served
    url = urlsplit(made.address)
    connection = http.client.HTTPConnection("127.0.0.1", url.port, timeout=PATIENCE)
    connection.request("GET", f"{url.path}{STREAM}")
    answer = connection.getresponse()

    def message() -> tuple[dict[str, object], bytes]:
        text, size = LENGTHS.unpack(answer.read(LENGTHS.size))
        return json.loads(answer.read(text)), answer.read(size)

    said, sights = message()
    assert said["bass"]["title"] == load_preset("jazz-finger").name  # type: ignore[index]
    assert len(sights) == 4 * SIGHT.itemsize and said["rate"] == RATE
    synth.send(0x90, 28, 127)
    messages: list[tuple[dict[str, object], bytes]] = []
    notes: list[int] = []
    while len(messages) < 20 or (len(notes) < 2 and len(messages) < 2000):  # on a busy machine the note comes late
        messages.append(message())
        notes += messages[-1][0]["notes"]  # type: ignore[arg-type]
    assert all("bass" not in said for said, _ in messages)
    assert notes[:2] == [0, 0]
    assert any(np.frombuffer(sights, SIGHT)["slot"]["u"].any() for _, sights in messages)
    synth.switch_to(LiveBass(load_preset("five-string"), FINE, RATE))
    while "bass" not in (found := message())[0]:
        pass
    assert len(found[1]) == 5 * SIGHT.itemsize
    connection.close()
