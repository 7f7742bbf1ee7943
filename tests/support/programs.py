"""The programs of tools/, as modules."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType

from support.places import TOOLS


def load(name: str) -> ModuleType:
    """Returns the module tools/NAME.py, anew each time. Modules beside it are found while it loads."""
    # Under another name, as Python has a module `site`; a dataclass looks for its types in sys.modules
    spec = importlib.util.spec_from_file_location(f"tools_{name}", TOOLS / f"{name}.py")
    assert spec and spec.loader
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(TOOLS))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(TOOLS))
    return module
