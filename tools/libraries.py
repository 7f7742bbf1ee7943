"""Finds the system libraries that the packages in .venv need and this machine lacks; .ci/run calls it in tools/bare.

A wheel should carry what it needs. Prints the missing libraries by package, and exits with 1 if one is not in KNOWN.
"""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

KNOWN = {  # why each may be missing, by how its name begins
    "libatomic.so": "Debian: libatomic1; tests that need it are skipped",
    "libasound.so": "Debian: libportaudio2 brings it; play says so",
    "libgomp.so": "a thread pool of numba, which livebass does not use",
    "libtbb.so": "a thread pool of numba, which livebass does not use",
    "libquadmath-": "lies beside the library that loads it",
}


def missing(file: Path) -> set[str]:
    """Returns the libraries that the dynamic linker does not find for a shared library."""
    done = subprocess.run(["ldd", file], capture_output=True, text=True, check=False)
    return set(re.findall(r"^\s*(\S+) => not found", done.stdout, re.MULTILINE))


def main() -> None:
    place = Path(sysconfig.get_path("platlib"))
    files = sorted(place.rglob("*.so*"))
    found: dict[str, set[str]] = {}
    with ThreadPoolExecutor() as pool:
        for file, names in zip(files, pool.map(missing, files), strict=True):
            for name in names:
                found.setdefault(name, set()).add(file.relative_to(place).parts[0])
    unknown = False
    for name, packages in sorted(found.items()):
        why = next((text for begin, text in KNOWN.items() if name.startswith(begin)), None)
        print(f"{name}: needed by {', '.join(sorted(packages))}: {why or 'UNKNOWN'}")
        unknown |= why is None
    print(f"{len(files)} shared libraries, {len(found)} system libraries missing")
    sys.exit(unknown)


if __name__ == "__main__":
    main()
