"""A JACK server for the tests of a file."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from support.jack import lasting_server
from support.needs import package, tool


@pytest.fixture(scope="module")
def server() -> Iterator[SimpleNamespace]:
    """A JACK server, always ended by its process id."""
    tool("jackd", "JACK")
    jack = package("jack")
    with lasting_server() as process:
        yield SimpleNamespace(process=process, jack=jack)
