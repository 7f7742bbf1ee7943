"""The data in an exported page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def page_of(html: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(html.read_text("utf-8").split('id="page">')[1].split("</script>")[0])
    return found
