"""The folders of the project that tests read."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
TESTS, TOOLS = ROOT / "tests", ROOT / "tools"
SUPPORT = TESTS / "support"
RECORDINGS = TESTS / "recordings"
GROWLY = RECORDINGS / "growlybass"
SHARED = ROOT.parent / "shared" / "data" / "issanchou-bass"  # measurements of the paper's bass, if they are there
