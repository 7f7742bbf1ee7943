"""Sounds saved in the plugin's window: files in the user's folder, written whole or not at all."""

from __future__ import annotations

import resource
import shutil
import signal
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.clap import Plugin
from support.picture import Host, Picture, library, number
from support.smf import named, smf
from support.states import bass_of, without_instrument

from livebass import load_preset
from livebass.files.kinds import MIDI_ENDINGS
from livebass.live.parameters import PARAMETERS
from livebass.model.bench import change_bass
from livebass.plugin import clap
from livebass.plugin.instrument import instrument_file, write_instrument

BASSES = ("slap", "five-string")
OF_NO_SOUND = ("bass", "quality", "running_ahead", "relief", "cores")
ENDING = ".toml"
LONG = "is longer than a sound or a link"
GAIN, BASS, QUALITY = number("gain"), number("bass"), number("quality")


def test_a_sound_is_the_bass_and_all_that_is_no_matter_of_the_processor(
    host: Host, instruments: Path, own: Path, lend: Any
) -> None:
    changed = {
        p.symbol: (p.minimum if p.minimum != p.default else p.maximum)
        for p in PARAMETERS
        if p.symbol not in ("bass", "cores")
    }
    for symbol, value in {**changed, "bass": 1.0}.items():
        host.set(symbol, value)
    assert host.save_sound() == f"{load_preset('five-string').name} 1"
    assert not any(file.suffix != ENDING for file in own.iterdir())
    other = lend(Host(instruments))
    other.set("quality", 0.0)
    before = {p.symbol: other.value(p.symbol) for p in PARAMETERS}
    assert other.sounds() == [f"{load_preset('five-string').name} 1"]
    assert library().lb_load_sound(other.address, 0)
    for p in PARAMETERS:
        wanted = before[p.symbol] if p.symbol in OF_NO_SOUND else changed[p.symbol]
        assert other.value(p.symbol) == (1 if p.symbol == "bass" else wanted), p.symbol
    library().lb_undo(other.address)
    assert {p.symbol: other.value(p.symbol) for p in PARAMETERS} == before


def test_undo_brings_back_a_bass_that_is_not_installed(
    host: Host, instruments: Path, tmp_path: Path, own: Path
) -> None:
    """Its substitute is not saved in its place."""
    other = shutil.copytree(instruments, tmp_path / "other")
    (other / "slap.lbass").rename(other / "lost.lbass")
    (other / "instruments.txt").write_text("lost\n")
    with closing(Host(other)) as there:
        state = without_instrument(there.save())
    assert (
        bass_of(state) == "lost" and host.save_sound() and host.load(state) and without_instrument(host.save()) == state
    )
    assert host.sounds() and library().lb_load_sound(host.address, 0)
    assert bass_of(host.save()) == "slap"
    library().lb_undo(host.address)
    assert without_instrument(host.save()) == state


def test_names_are_the_basss_title_and_the_next_number(host: Host, own: Path) -> None:
    """Nothing is overwritten; files renamed by the user are listed by name, numbers in order."""
    assert [host.save_sound() for _ in range(3)] == ["Slap 1", "Slap 2", "Slap 3"]
    first = (own / f"Slap 1{ENDING}").read_bytes()
    host.set("gain", -5.0)
    (own / f"Slap 2{ENDING}").rename(own / f"Verse, très doux 10{ENDING}")
    assert [host.save_sound(), host.save_sound()] == ["Slap 2", "Slap 4"]
    (own / f"Slap 4{ENDING}").rename(own / f"Slap 10{ENDING}")
    assert host.sounds() == ["Slap 1", "Slap 2", "Slap 3", "Slap 10", "Verse, très doux 10"]
    assert (own / f"Slap 1{ENDING}").read_bytes() == first
    library().lb_remove_sound(host.address, 0)
    assert host.sounds() == ["Slap 2", "Slap 3", "Slap 10", "Verse, très doux 10"]


def test_titles_become_names_of_files_of_any_system(own: Path, tmp_path: Path, lend: Any) -> None:
    titles = ['.a/b\\c:d*e?f"g<h>i|j', "é" * 31]
    for k, title in enumerate(titles):
        write_instrument(replace(load_preset("slap"), name=title), tmp_path / f"{k}.lbass")
    (tmp_path / "instruments.txt").write_text("0\n1\n")
    host = lend(Host(tmp_path))
    assert host.save_sound() == "-a-b-c-d-e-f-g-h-i-j 1"
    host.set("bass", 1.0)
    assert host.save_sound() == f"{titles[1]} 1"
    assert len(host.sounds()) == 2


def test_a_sound_is_a_preset_that_every_part_of_livebass_opens(host: Host, own: Path) -> None:
    """So is one that was edited, or saved by the page; only the name in a path counts."""
    for symbol, value in {"bass": 1.0, "action": -0.9, "gain": -6.5, "gauge": 10.0, "fret": 7.0}.items():
        host.set(symbol, value)
    name = host.save_sound()
    file, rest = own / f"{name}{ENDING}", "action = -0.9\ngauge = 10\nfret = 7\n\n[plugin]\ngain = -6.5\n"
    assert file.read_text().endswith(f'like = "five-string"\n\n[bench]\n{rest}')
    bass, wanted = load_preset(file), change_bass(load_preset("five-string"), {"action": -0.9, "gauge": 10.0})
    assert instrument_file(bass) == instrument_file(wanted) != instrument_file(load_preset("five-string"))
    file.write_text('# mine\r\nlike="../basses/slap.toml" # a "path"\n[bench]\n wear = +25.50\n[plugin]\ntone=-.5')
    assert host.sounds() == [name] and library().lb_load_sound(host.address, 0)
    values = [host.value(symbol) for symbol in ("bass", "wear", "tone", "action", "gain")]
    assert values == [0.0, 25.5, -0.5, 0.0, 0.0]


@pytest.mark.parametrize(
    "link, values",
    [
        ("#like=five-string&action=-0.9&gauge=10", {"bass": 1, "action": -0.9, "gauge": 10}),
        ("like=five-string", {"bass": 1}),
        ("http://127.0.0.1:8000/?a#like=slap&tone=-1&gain=%2B3.25\r\n", {"tone": -1, "gain": 3.25}),
        (" file:///a%20b/livebass.html#like=%73lap ", {"bass": 0}),
        (
            "#like=slap&action=-0.5&riff=0.28.90.9&stroke=pick&made=0295ac&moment=1.38.9.9",
            {"bass": 0, "action": -0.5},
        ),
        ('like = "five-string"\n[bench]\nfoam = 2.5\n', {"bass": 1, "foam": 2.5}),
    ],
)
def test_a_link_of_a_page_is_pasted(host: Host, link: str, values: dict[str, float]) -> None:
    """Unstated values are the bass's own; Undo restores the previous ones."""
    host.set("cable", 500.0)
    before = host.save()
    assert library().lb_take_text(host.address, link.encode()) is None
    for p in PARAMETERS:
        if p.symbol not in OF_NO_SOUND or p.symbol in values:
            assert host.value(p.symbol) == values.get(p.symbol, p.default), p.symbol
    library().lb_undo(host.address)
    assert host.save() == before


@pytest.mark.parametrize("ending", MIDI_ENDINGS)
def test_the_path_of_a_midi_file_is_pasted(host: Host, tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"song{ending}"
    path.write_bytes(smf(named(b"Bass", 0, 33, program=b"\x21")))
    assert library().lb_take_text(host.address, str(path).encode()) is None


@pytest.mark.parametrize(
    "text, why",
    [
        ("", "is empty"),
        ("hello", "is not a link of livebass, nor a sound"),
        ("https://example.org/?like=slap", "does not say which bass it is like"),
        ("#action=1", "does not say which bass it is like"),
        ("#like=&action=1", "does not say which bass it is like"),
        ("#like=kazoo&action=1", "has a bass that is not installed"),
        ("#like=slap&actoin=1", "changes what a bass does not have: actoin"),
        ("#like=slap&quality=1", "changes what a bass does not have: quality"),
        ("#like=slap&action=4", "says action = 4: it must be from -2 to 3 mm"),
        ("#like=slap&action=1e3", "says action = 1e3: it must be from -2 to 3 mm"),
        ("#like=slap&action=0x1", "says action = 0x1: it must be from -2 to 3 mm"),
        ("#like=slap&action=nan", "says action = nan: it must be from -2 to 3 mm"),
        ("#like=slap&action=", "says action = : it must be from -2 to 3 mm"),
        ("#like=slap&tone=1.5", "says tone = 1.5: it must be from -1 to 1"),
        ('like = "slap"\n[string]\n', "says more than sliders: export it as an instrument: [string]"),
        ('like = "slap"\ntuning = "drop-d"\n', "says more than sliders: export it as an instrument: tuning"),
        ('tuning = "drop-d"\n', "says more than sliders: export it as an instrument: tuning"),
        ("x" * 9000, "is longer than a sound or a link"),
    ],
)
def test_what_cannot_be_pasted_is_said_and_changes_nothing(host: Host, text: str, why: str) -> None:
    host.set("action", 0.5)
    before = host.save()
    assert library().lb_take_text(host.address, text.encode()).decode() == why
    assert host.save() == before


def test_a_press_on_paste_asks_for_the_clipboard_and_says_what_became_of_it(host: Host, own: Path, lend: Any) -> None:
    picture = lend(Picture(host, optional=("undo", "swap", "side", "paste")))
    picture.draw()
    assert not library().lb_wants_text(picture.address)
    wanted = 0
    for x in range(picture.pixels.shape[1] - 300, picture.pixels.shape[1], 20):
        for y in range(44, 120, 6):
            picture.press(x, y)
            wanted += library().lb_wants_text(picture.address)
    assert wanted
    drawn = picture.pixels.copy()
    library().lb_paste(picture.address, b"#like=slap&wear=25")
    picture.draw()
    assert host.value("wear") == 25.0 and not np.array_equal(drawn, picture.pixels)
    library().lb_paste(picture.address, None)
    picture.draw()
    assert host.value("wear") == 25.0


def test_what_is_no_sound_is_left_out_with_a_line(
    host: Host, own: Path, tmp_path: Path, lend: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    """Damaged, a session's state, or of a missing bass: nothing changes."""
    host.set("gain", -6.0)
    host.save_sound()
    good = (own / f"Slap 1{ENDING}").read_bytes()
    wrong = {
        f"empty{ENDING}": (b"", "is empty"), f"huge{ENDING}": (good + bytes(b" " * (1 << 17)), LONG),
        f"session{ENDING}": (host.save(), LONG),
        f"more{ENDING}": (good + b"[neck]\n", "says more than sliders: export it as an instrument: [neck]"),
    }  # fmt: skip
    for name, (data, _) in wrong.items():
        (own / name).write_bytes(data)
    (own / "mine.lbass.txt").write_text("no sound")
    (own / f"folder{ENDING}").mkdir()
    capfd.readouterr()
    assert host.sounds() == ["Slap 1"]
    lines = sorted(capfd.readouterr().err.splitlines())
    expected = [f"{own}/{name}: the sound {why}" for name, (_, why) in wrong.items()]
    expected.append(f"{own}/folder{ENDING}: the sound is empty")
    assert lines == sorted(expected)
    host.set("gain", 2.0)
    (own / f"Slap 1{ENDING}").write_bytes(b"like")  # changed since it was listed
    before = host.save()
    assert not library().lb_load_sound(host.address, 0) and host.save() == before
    assert not library().lb_load_sound(host.address, 1) and not library().lb_load_sound(host.address, -1)
    (own / f"Slap 1{ENDING}").write_bytes(good)
    (tmp_path / "other").mkdir()
    write_instrument(load_preset("five-string"), tmp_path / "other" / "five-string.lbass")
    (tmp_path / "other" / "instruments.txt").write_text("five-string\n")
    other = lend(Host(tmp_path / "other"))
    capfd.readouterr()
    assert not other.sounds()
    assert f"{own}/Slap 1{ENDING}: the sound has a bass that is not installed" in capfd.readouterr().err


def test_a_folder_that_cannot_be_written_is_told_in_one_line(
    host: Host, own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a").write_text("a file in place of a folder")
    capfd.readouterr()
    assert host.save_sound() is None
    assert capfd.readouterr().err == f"{own}: the sound cannot be written\n"
    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.delenv("HOME")
    assert host.save_sound() is None and not host.sounds()
    assert capfd.readouterr().err.count("\n") == 1


def test_a_file_that_cannot_be_written_whole_is_not_there(host: Host, own: Path) -> None:
    host.save_sound()
    limit, before = resource.getrlimit(resource.RLIMIT_FSIZE), sorted(own.iterdir())
    old = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50, limit[1]))
    try:
        name = host.save_sound()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, old)
    assert name is None and sorted(own.iterdir()) == before and host.sounds() == ["Slap 1"]


def test_browsers_of_clap_hosts_have_them(host: Host, own: Path, tmp_path: Path) -> None:
    """By name; they load in a plugin without a window too."""
    host.set("gain", -6.0)
    host.set("bass", 1.0)
    host.save_sound()
    file = own / f"{load_preset('five-string').name} 1{ENDING}"
    file = file.rename(own / f"Low. End{ENDING}")
    (own / f"damaged{ENDING}").write_bytes(b"like = 3")
    clap.write_bundle({name: load_preset(name) for name in BASSES}, tmp_path / "livebass")
    with closing(Plugin(tmp_path / "livebass")) as plugin:
        presets = plugin.library.presets()
        assert [key for _, key, _ in presets if key] == list(BASSES) and presets[-1][0] == "Low. End"
        assert len(presets[-1][2]) == 2 and plugin.library.refused == ["is not a link of livebass, nor a sound"]
        plugin.set(QUALITY, 1.0)
        plugin.rescanned = 0
        assert plugin.load_sound(file) and plugin.rescanned == 1
        assert [plugin.value(k) for k in (GAIN, BASS, QUALITY)] == [-6, 1, 1]
        plugin.set(GAIN, 0.0)
        assert not plugin.load_sound(own / f"damaged{ENDING}") and not plugin.load_sound(own / "none")
        assert plugin.value(GAIN) == 0 and plugin.rescanned == 1
