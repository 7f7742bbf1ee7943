"""Makes engines share the image of a bass: tests make the same few basses thousands of times."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

from livebass.engine import engine
from livebass.engine.image import Image, Pool, image


class Kept(Image):
    """An image that computes the operators of a tier and a rate once. Nothing that plays changes them."""

    @cached_property
    def pools(self) -> dict[tuple[int, int], Pool]:
        return {}

    def pool(self, tier: int, rate: int) -> Pool:
        if (tier, rate) not in self.pools:
            self.pools[tier, rate] = super().pool(tier, rate)
            self.pools[tier, rate].memory.flags.writeable = False
        return self.pools[tier, rate]


@lru_cache(maxsize=12)
def keep(*requested: Any) -> Kept:
    made = image(*requested)
    return Kept(made.words, made.exact)


engine.image = keep
