"""The site, built."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from support.needs import package


def build(site: Any, folder: Path) -> Path:
    """The whole site, built into a folder. Skips the test without the packages of the extra `site`."""
    for name in site.NEEDED:
        package(name, "")
    site.build(folder)
    return folder
