"""The number of random examples that hypothesis tries, by profile; fewer where each costs a tenth of a second."""

from __future__ import annotations

from typing import Any

from hypothesis import settings

settings.register_profile("fast", max_examples=200, deadline=None)
settings.register_profile("all", max_examples=400, deadline=None)  # tools/test --all
settings.load_profile("fast")


def costly(**more: Any) -> settings:
    """A quarter of the profile's examples."""
    return settings(max_examples=settings().max_examples // 4, **more)
