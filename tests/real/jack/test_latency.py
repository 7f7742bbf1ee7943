"""`livebass bench latency` with the tests' own JACK server."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import pytest
from support.jack import JACK_PERIOD as PERIOD
from support.jack import JACK_RATE as RATE

from livebass.lab.bench import latency

FEW = latency.Extent(notes=4, queued=5)


def test_latency_through_a_server(server: SimpleNamespace) -> None:
    """The native client is sample-exact under any load; PortAudio's notes come some blocks later.

    Repeats the measurement if other work on the machine stopped the server or its clients.
    """
    for _ in range(8):
        said: list[str] = []
        result = latency.bench_latency(said.append, FEW)
        rows: dict[str, Any] = {row["way"]: row for row in result["rows"]}
        assert list(rows) == ["queue", "jack", "portaudio"] and len(said) == 3
        if not any("error" in row for row in rows.values()) and rows["jack"]["least_ms"] == rows["jack"]["median_ms"]:
            break
    assert result["server"]["block"] == PERIOD and result["rate_hz"] == RATE
    native, portaudio = rows["jack"], rows["portaudio"]
    assert native["notes"] + native["discarded"] == 4
    assert native["least_ms"] == native["median_ms"] == pytest.approx(1 / 48)
    assert "error" not in portaudio, portaudio
    assert portaudio["notes"] + portaudio["discarded"] == 4 and 0 < portaudio["least_ms"] <= portaudio["most_ms"]
    text = latency.table(result)
    assert all(row["name"] in text for row in result["rows"]) and "JACK server of 256 frames" in text
    assert json.loads(json.dumps(result)) == result
    pytest.importorskip("matplotlib")
    assert latency.picture(result).startswith(b"\x89PNG")


def test_a_way_that_fails_has_an_error(server: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(latency, "_queue_row", lambda *_: {"way": "queue"} | latency.latency_figures([1.0], 48_000) | {
        "name": "queue", "block": 128, "discarded": 0})  # fmt: skip
    result = latency.bench_latency(extent=latency.Extent(ways=("portaudio",), quality="nothing"))
    row = result["rows"][1]
    assert row["way"] == "portaudio" and "nothing" in row["error"]
    assert f"PortAudio, MIDI from JACK: {row['error']}" in latency.table(result)
