"""Remembers the choices of `livebass play` in a TOML file of the user."""

from __future__ import annotations

import logging
import os
import tomllib
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.messages import say
from livebass.cli.options import is_given
from livebass.cli.tuning import TUNING_KEYS
from livebass.files.whole import OutputError
from livebass.rows.bounds import between, complaint, one_of, refusal
from livebass.rows.units import is_number

if TYPE_CHECKING:
    from livebass.live.settings import Summary

LOG = logging.getLogger("livebass")

VARIABLE = "LIVEBASS_SETTINGS"  # environment variable: another file
BACKENDS = ("auto", "portaudio", "jack")
GAIN = (-60.0, 20.0)  # dB
HEAD = "# What `livebass play` remembers. `livebass play --forget` deletes it.\n"


class DamagedSettings(ValueError):
    """The file cannot be read, or holds a wrong value; one line."""


@dataclass(frozen=True)
class PlaySettings:
    """The choices of the last time; None: none. Each is a key of the file, controllers a table."""

    preset: str | None = None  # name, or absolute path
    gain: float | None = None  # dB
    backend: str | None = None
    audio: str | None = None  # the full name of a PortAudio output
    midi: str | None = None
    controllers: dict[str, int] = field(default_factory=dict)  # learned, by parameter symbol
    tuning: str | None = None
    capo: int | None = None
    a4: float | None = None  # Hz
    temperament: str | None = None  # name, or comma-separated cents

    def text(self) -> str:
        """Returns the text of the file."""
        names = [f.name for f in fields(self) if f.name != "controllers"]
        lines = [f"{name} = {_toml(getattr(self, name))}" for name in names if getattr(self, name)]
        if self.controllers:
            lines += ["", "[controllers]  # the MIDI controller of each parameter"]
            lines += [f"{symbol} = {controller}" for symbol, controller in sorted(self.controllers.items())]
        return HEAD + "".join(f"{line}\n" for line in lines)

    def summary(self) -> str:
        """One line about the choices; "" if there are none."""
        parts = [self.preset and f"preset {self.preset}", self.tuning and f"tuning {self.tuning}",
                 self.capo and f"capo {self.capo}", self.a4 and f"A {self.a4:g} Hz",
                 self.temperament and f"temperament {self.temperament}", self.gain and f"gain {self.gain:g} dB",
                 self.backend and f"backend {self.backend}", self.audio and f"output {self.audio}",
                 self.midi and f"MIDI {self.midi}"]  # fmt: skip
        parts += [f"controller {controller} for {symbol}" for symbol, controller in sorted(self.controllers.items())]
        return ", ".join(part for part in parts if part)


def settings_file() -> Path:
    """Returns the path of the settings file."""
    import platformdirs

    given = os.environ.get(VARIABLE)
    return Path(given) if given else platformdirs.user_config_path("livebass") / "play.toml"


def load(path: Path) -> PlaySettings:
    """Reads the file at `path`; without a file there are no choices. Raises DamagedSettings."""
    from livebass.files.formats import check_format, rename_keys

    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return PlaySettings()
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else " ".join(str(error).split())
        raise DamagedSettings(f"{path}: {why}") from None
    try:
        return _check(rename_keys("settings", check_format("settings", data))[0])
    except ValueError as error:
        raise DamagedSettings(f"{path}: {error}") from None


def _check(data: dict[str, Any]) -> PlaySettings:
    """The choices in a table; ignores keys of other versions. Raises ValueError for unusable values."""
    from livebass.live.desk import check_controllers
    from livebass.preset.keys import KEYS, check_value

    for key in ("preset", "backend", "audio", "midi", "tuning", "temperament"):
        if not isinstance(data.get(key, ""), str):
            raise refusal(key, "text", repr(data[key]))
    one_of("backend", data.get("backend", "auto"), BACKENDS)
    gain = data.get("gain", 0.0)
    if isinstance(gain, bool) or not isinstance(gain, int | float) or not GAIN[0] <= gain <= GAIN[1]:
        raise refusal("gain", between(*GAIN, "dB"), repr(gain))
    for row in KEYS:
        if not row.section and row.name in data and row.name in TUNING_KEYS:
            try:
                value = check_value(row, data[row.name])
            except ValueError as error:
                raise ValueError(complaint(row.name, error, repr(data[row.name]))) from None
            if row.name in ("capo", "a4"):
                data[row.name] = value
    controllers = data.get("controllers", {})
    if not isinstance(controllers, dict):
        raise refusal("controllers", "a table", repr(controllers))
    known = {f.name: data[f.name] for f in fields(PlaySettings) if f.name in data}
    return PlaySettings(**known | {"controllers": check_controllers(controllers) if controllers else {}})


def save(path: Path, remembered: PlaySettings) -> None:
    """Writes the file, complete or not at all. Raises OutputError, and ValueError for a name that is not UTF-8."""
    from livebass.files.whole import Transaction

    with Transaction() as files:
        files.directory(path.parent)
        files.write_text(path, remembered.text())


def forget(path: Path) -> None:
    """Deletes the file, if it exists. Raises OutputError."""
    from livebass.files.whole import output_error

    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise output_error(path, error) from None


def _toml(value: str | float) -> str:
    """A value in TOML; unprintable characters, quotes and backslashes in text are escaped.

    Raises ValueError for a name that is not UTF-8, as TOML requires.
    """
    if not isinstance(value, str):
        return repr(value)
    if any("\ud800" <= c <= "\udfff" for c in value):
        raise ValueError(f"{value}: is not UTF-8, and settings are")
    return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in value) + '"'


@dataclass(frozen=True)
class Memory:
    """Holds the choices of the last time, and the ones used now."""

    path: Path | None  # None: remember nothing
    before: PlaySettings
    used: dict[str, Any]  # options
    given: frozenset[str]  # options on the command line

    def summary(self) -> str:
        """One line about the choices in use."""
        return PlaySettings(**self.used).summary()

    def controllers(self, learn: tuple[tuple[str, int | str | None], ...]) -> dict[str, int]:
        """The initial controllers: the remembered ones, changed by the options."""
        controllers = dict(self.before.controllers)
        for symbol, controller in learn:
            controllers = {s: c for s, c in controllers.items() if s != symbol and c != controller}
            if isinstance(controller, int):
                controllers[symbol] = controller
        return controllers

    def keep(self, summary: Summary, unchosen: set[str | None], learned: dict[str, int]) -> None:
        """Remembers the new choices, and the earlier ones that they do not replace. A full disk is a warning.

        `unchosen` are presets that the player did not choose: the first one, and those from a file.
        """
        if self.path is None:
            return
        changes: dict[str, Any] = {"controllers": learned}
        if "preset" in self.given or summary.preset not in unchosen:
            is_file = summary.preset.endswith(".toml") or "/" in summary.preset
            changes["preset"] = os.path.abspath(summary.preset) if is_file else summary.preset
        if "gain" in self.given:
            changes["gain"] = click.get_current_context().params["gain"]
        for name in TUNING_KEYS:
            if name in self.given:
                changes[name] = click.get_current_context().params[name] or None
        if self.given & {"backend", "audio"}:
            wanted = click.get_current_context().params["backend"]
            changes["backend"] = wanted if wanted == "portaudio" else None  # JACK is used anyway where it runs
            changes["audio"] = summary.audio if "audio" in self.given else None
        if "midi" in self.given:
            wanted = click.get_current_context().params["midi"]
            changes["midi"] = summary.midi if is_number(wanted) else wanted
        now = replace(self.before, **changes)
        try:
            if now != self.before:
                save(self.path, now)
        except (OutputError, ValueError) as error:
            LOG.warning("not remembered: %s", error)


def recall(options: dict[str, Any]) -> Memory:
    """Reads the last choices for options not given. A damaged file is reported in one line and left alone."""
    names = ("preset", "gain", "backend", "audio", "midi", *TUNING_KEYS)
    chosen = frozenset(name for name in names if is_given(name))
    if options["no_settings"]:
        return Memory(None, PlaySettings(), {}, chosen)
    path = settings_file()
    if options["forgotten"]:
        forget(path)
    try:
        before = load(path)
    except DamagedSettings as error:
        say(f"{error}; nothing is remembered until `livebass play --forget` deletes the file")
        return Memory(None, PlaySettings(), {}, chosen)
    wanted = {"preset", "gain", "midi", *TUNING_KEYS} - chosen
    if not chosen & {"backend", "audio"} and options["backend"] == "auto":
        wanted |= {"backend", "audio"}
    if options["song"]:
        wanted -= {"preset", "tuning", "capo"}  # the file chooses a bass
    if options["no_connect"]:
        wanted -= {"midi"}
    used = {name: getattr(before, name) for name in wanted if getattr(before, name)}
    return Memory(path, before, used, chosen)
