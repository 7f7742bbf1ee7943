"""Hosts within the process: the plugins of one kind, and their thread rules checked."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from support.plugins import checked_binary, no_instruments_of_the_user  # noqa: F401

from livebass.plugin import bundle
from livebass.plugin.systems import this_system


@pytest.fixture(scope="module")
def thread_checks() -> Iterator[None]:
    """Plugins written for this system abort where a thread rule is broken."""
    with pytest.MonkeyPatch.context() as patch:
        other, here = bundle.binary, this_system()
        patch.setattr(bundle, "binary", lambda system: checked_binary() if system == here else other(system))
        yield
