"""Writes the project's addresses to all files that name them, from the line Source in pyproject.toml.

python tools/where.py [SITE]

Releases, issues and changelog follow from Source. SITE is the address of the site; by default that of the pages of
GitHub, GitLab or Codeberg, elsewhere the line Site of pyproject.toml. tests/promises/project/test_project.py
checks that the places agree.
"""

from __future__ import annotations

import argparse
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
# Files that name addresses, besides pyproject.toml; CITATION.cff has them as they were written last
PLACES = ("CITATION.cff", "README.md", ".github/ISSUE_TEMPLATE/config.yml")
BELOW = {"Releases": "releases", "Issues": "issues", "Changelog": "blob/main/CHANGELOG.md"}  # of Source
ADDRESS = re.compile(r"https://[\w.-]+\.\w+(?:/[\w.~-]+)*")
PLACEHOLDER = re.compile(r"https://(?:[\w-]+\.)*example\.(?:org|com|net)\b")  # reserved, nobody's
NOTE = "*`example.org` stands for an address that the project does not have yet.*\n\n"  # in README, with a placeholder


def urls(folder: Path = ROOT) -> dict[str, str]:
    """Returns the section [project.urls] of a checkout's pyproject.toml."""
    return dict(tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))["project"]["urls"])


def pages_of(source: str) -> str | None:
    """Returns the address of the site that GitHub, GitLab or Codeberg makes of a repository; None elsewhere."""
    found = re.fullmatch(r"https://(github\.com|gitlab\.com|codeberg\.org)/([\w.-]+)/([\w.-]+)", source)
    if not found:
        return None
    host, owner, name = found.groups()
    pages = {"github.com": "github.io", "gitlab.com": "gitlab.io", "codeberg.org": "codeberg.page"}[host]
    return f"https://{owner.lower()}.{pages}/{name}"


def derived(source: str, site: str) -> dict[str, str]:
    """Returns the lines of [project.urls] that follow from two addresses."""
    return {"Source": source, **{key: f"{source}/{path}" for key, path in BELOW.items()}, "Site": site}


def write(folder: Path = ROOT, site: str | None = None) -> list[str]:
    """Writes all addresses in a checkout; returns the files that changed. Raises ValueError for a bad address."""
    now = urls(folder)
    source = now["Source"].rstrip("/").removesuffix(".git")
    site = (site or pages_of(source) or now["Site"]).rstrip("/")
    for name, address in (("Source", source), ("Site", site)):
        if not ADDRESS.fullmatch(address):
            raise ValueError(f"{name} must be an address such as https://github.com/owner/livebass, not {address}")
    wanted = derived(source, site)
    citation = (folder / "CITATION.cff").read_text("utf-8")
    before = [*re.findall(r'^(?:repository-code|url): "(.+)"$', citation, re.MULTILINE)]
    moved = dict(zip(before, (source, site), strict=True))  # the address of the repository stands first
    old_ones = re.compile("|".join(rf"{re.escape(one)}(?![\w.-])" for one in sorted(before, key=len, reverse=True)))
    changed = []
    for name in ("pyproject.toml", *PLACES):
        file = folder / name
        text = old = file.read_text("utf-8")
        if name == "pyproject.toml":
            for key, address in wanted.items():
                text = re.sub(rf'^{key} = "https?://.*"$', f'{key} = "{address}"', text, count=1, flags=re.M)
        else:
            text = old_ones.sub(lambda found: moved[found[0]], text)
        if not PLACEHOLDER.match(source):
            text = text.replace(NOTE, "")
        if text != old:
            file.write_text(text, "utf-8")
            changed.append(name)
    return changed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("site", nargs="?")
    try:
        print("\n".join(write(site=parser.parse_args().site) or ["all places agree already"]))
    except ValueError as error:
        raise SystemExit(f"where.py: {error}") from None


if __name__ == "__main__":
    main()
