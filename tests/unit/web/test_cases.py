"""The paper's cases on the page: which basses have them."""

from __future__ import annotations

from livebass import load_preset
from livebass.lab.paper.cases import PLAYED, PRESET
from livebass.web.bench import Source
from livebass.web.export import shown_cases


def test_only_the_string_of_the_paper_itself_has_cases() -> None:
    bass = load_preset(PRESET)
    assert [case["symbol"] for case in shown_cases(bass, Source(PRESET))] == list(PLAYED)
    assert not shown_cases(bass, None) and not shown_cases(bass, Source("jazz-finger"))
