"""`livebass export web`: the files of a page, and the inputs it refuses."""

from __future__ import annotations

import json
import re
import shutil
import struct
from pathlib import Path

import pytest
from support.command import Run, refusal
from support.needs import CLOSED
from support.pages import page_of
from support.presets import load_text

from livebass import load_preset
from livebass.kernels.player.performer import CHANNEL, CONTROLS
from livebass.preset.revisions import present
from livebass.rows.techniques import BUTTONS, GHOST, LET_RING, PALM
from livebass.web.bench import Source
from livebass.web.export import bass_data, export_page, is_page
from livebass.web.layout import WAYS
from livebass.web.link import check_link
from livebass.web.public import CARD_SIZE

FOUR = ("jazz-finger", "slap", "precision-finger", "fretless")
MAX_BYTES = 3_000_000


def names(folder: Path) -> list[str]:
    return sorted(file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file())


def size(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def test_ways_to_play_are_switches_and_fields_of_the_performer() -> None:
    assert [button.symbol for button in BUTTONS if not button.strikes] == list(WAYS)
    assert [button.symbol for button in BUTTONS[3:]] == list(WAYS)
    for action, field, of_channel in WAYS.values():
        assert (action or field) and (not field or field in (CHANNEL if of_channel else CONTROLS).names)
    wanted = (PALM, "palm", False), (GHOST, "", False), (LET_RING, "pedal", True)
    assert (WAYS["palm_mute"], WAYS["ghost"], WAYS["let_ring"]) == wanted


def with_earlier(*presets: str) -> list[str]:
    """The instrument files of presets and of their earlier revisions, which links may name."""
    earlier = [f"{name}@{number}.lbass" for name in presets for number in range(1, present(name))]
    return sorted([*earlier, *(f"{name}.lbass" for name in presets)])


def test_one_file_or_a_folder_of_four_basses(run: Run, tmp_path: Path) -> None:
    files = [
        "app.js", *(f"basses/{name}" for name in with_earlier(*FOUR)), "card.png", "embed.js", "index.html",
        "livebass.wasm", "manifest.webmanifest", "offline.js", "recorded/LICENSE.txt", "recorded/note.flac",
        "style.css", "worker.js", "worklet.js",
    ]  # fmt: skip
    for single, wanted in ((["--single"], ["livebass.html"]), ([], files)):
        folder = tmp_path / f"page{len(single)}"
        status, out, err = run("export", "web", "-p", *FOUR, "-o", folder, *single)
        assert status == 0 and out == "" and "4 basses" in err and ("livebass.html" if single else "index.html") in err
        assert names(folder) == wanted
        assert size(folder) < MAX_BYTES


def test_the_same_again_is_the_same_and_replaces_the_older_one(tmp_path: Path) -> None:
    bass, folder = load_preset("slap"), tmp_path / "page"
    first = export_page({"slap": bass}, folder).read_bytes()
    assert export_page({"slap": bass}, folder).read_bytes() == first
    export_page({"one": bass, "two": bass}, folder, quality="studio")
    assert [name for name in names(folder) if name.startswith("basses")] == ["basses/one.lbass", "basses/two.lbass"]
    export_page({"slap": bass}, folder, single=True, element=True)
    assert names(folder) == ["embed.js", "livebass.html"]
    export_page({"slap": bass}, folder, single=True)
    assert names(folder) == ["livebass.html"]


def test_another_page_of_that_name_stays(run: Run, tmp_path: Path) -> None:
    mine = tmp_path / "livebass.html"
    for text in ("", "<!doctype html><title>livebass</title><p>My notes on it.", "livebass " * 20_000):
        mine.write_text(text)
        for single in ([], ["--single"]):
            err = refusal(run, "export", "web", "-p", "slap", "-o", tmp_path, *single, status=1)
            assert "holds other files, such as livebass.html" in err and mine.read_text() == text
    mine.unlink()
    mine.mkdir()
    refusal(run, "export", "web", "-p", "slap", "-o", tmp_path, "--single", status=1)
    assert mine.is_dir()


def without_links(html: str) -> str:
    """The HTML without the addresses of links, which load nothing until somebody follows them."""
    assert 'href="https://doi.org/' in html, "the paper is a touch away"
    return re.sub(r'<a href="https://[^"]*"', "<a", html)


def test_links_to_a_page_with_an_address_have_a_picture(tmp_path: Path) -> None:
    slap = {"slap": load_preset("slap")}
    page = export_page(slap, tmp_path / "page", more={"address": "https://example.org/bass/"})
    html = page.read_text("utf-8")
    shown = re.findall(r'<meta property="og:image" content="([^"]*)">', html)
    assert shown == ["https://example.org/bass/card.png"] and "twitter:card" in html
    head = (page.parent / "card.png").read_bytes()[:24]  # a PNG's signature, and its size
    assert head[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">2I", head[16:]) == CARD_SIZE
    assert "og:image" not in export_page(slap, tmp_path / "page").read_text("utf-8")


def test_every_file_of_a_folder_is_asked_for_with_the_digest_of_all(tmp_path: Path) -> None:
    bass, digests = load_preset("slap"), []
    for basses in (["slap"], ["slap", "other"], ["slap"]):
        html = without_links((page := export_page(dict.fromkeys(basses, bass), tmp_path / "page")).read_text("utf-8"))
        digests.append(page_of(page)["digest"])
        requested = re.findall(r"""(?:src|href)=["'](?!data:)([^"']*)""", html)
        assert sorted(requested) == [f"app.js?v={digests[-1]}", "manifest.webmanifest", f"style.css?v={digests[-1]}"]
    assert digests[0] == digests[2] != digests[1]


def test_the_page_loads_nothing_from_elsewhere(tmp_path: Path) -> None:
    html = without_links(export_page({"slap": load_preset("slap")}, tmp_path / "page", single=True).read_text("utf-8"))
    policy = re.findall(r'Content-Security-Policy" content="([^"]*)"', html)
    assert len(policy) == 1 and "default-src 'none'" in policy[0] and "connect-src" not in policy[0]
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", html.split("<script>")[0])
    assert not re.findall(r"https?://(?!www\.w3\.org/2000/svg)", html)


def test_the_neck_of_a_page_has_all_strings_and_begins_at_the_capo() -> None:
    bass = bass_data("mine", load_preset("six-string", tuning="drop-a", capo=2))
    assert [string["name"] for string in bass["strings"]] == list("BEADGC")
    assert [string["note"] for string in bass["strings"]] == [23, 30, 35, 40, 45, 50] and bass["frets"] == 22
    assert bass["capo"] == 2 and bass_data("mine", load_preset("fretless"))["capo"] == 0


def test_names_and_texts_are_no_markup(tmp_path: Path) -> None:
    bass = load_text(tmp_path, 'like = "slap"\nname = "</script><b>mine"\n')
    page = export_page({"mine": bass}, tmp_path / "page")
    assert "</script><b>" not in page.read_text("utf-8")
    assert page_of(page)["basses"][0]["title"] == "</script><b>mine"


@pytest.mark.parametrize(
    "arguments, says, status",
    [
        (["-p", "sla", "-o", "page"], "sla", None),
        (["-p", "slap"], "'-o'", 2),
        (["slap", "-o", "page"], "name presets with -p", 2),
        (["-p", "slap", "slap", "-o", "page"], "two basses called slap", 2),
        (["-p", "slap", "-o", "page", "-q", "reference"], "'live', 'studio'", 2),
        (["-p", "slap", "-o", "file"], "file: is not a directory", 1),
        (["-p", "slap", "-o", "file/page"], "file", 1),
        (["-p", "slap", "-o", "other"], "other: holds other files, such as mine.txt", 1),
    ],
)
def test_bad_input(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], says: str, status: int | None
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").touch()
    assert says in refusal(run, "export", "web", *arguments, status=status)
    assert names(tmp_path) == ["file", "other/mine.txt"]


def test_files_of_others_among_the_basses_stay(run: Run, tmp_path: Path) -> None:
    """Nor is a folder whose basses are a file a page."""
    basses = tmp_path / "page" / "basses"
    export_page({"slap": load_preset("slap")}, basses.parent)
    (basses / "mine.wav").touch()
    for mine in (basses / "mine.wav", basses):
        err = refusal(run, "export", "web", "-p", "slap", "-o", basses.parent, status=1)
        assert "holds other files" in err and mine.is_file()
        if mine != basses:
            shutil.rmtree(basses)
            basses.touch()


def test_a_folder_that_cannot_be_written(run: Run) -> None:
    assert "cannot be written" in refusal(run, "export", "web", "-p", "slap", "-o", CLOSED / "page", status=1)


def test_a_full_disk_leaves_nothing(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("livebass.files.whole.os.fsync", full)
    refusal(run, "export", "web", "-p", "slap", "-o", tmp_path / "page", status=1)
    assert names(tmp_path) == []


def test_a_bass_of_ones_own_and_a_tuned_one_have_their_bench(run: Run, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('like = "jazz-finger"\n[neck]\naction = "1.9 mm"\n')
    page = tmp_path / "page"
    status, _, err = run("export", "web", "-p", tmp_path / "mine.toml", "slap", "--tuning", "drop-d", "-o", page)
    assert status == 0, err
    mine, slap = (bass["bench"] for bass in page_of(page / "index.html")["basses"])
    (action,) = (slider for slider in mine["sliders"] if slider["symbol"] == "action")
    assert mine["like"] == "mine.toml" and action["own"] == pytest.approx(1.9)
    assert slap["like"] == "slap" and slap["head"] == {"": {"tuning": '"drop-d"'}} == mine["head"]
    assert names(page / "basses") == ["mine.lbass", "slap.lbass"]


def test_a_bass_that_is_no_preset_has_no_bench(tmp_path: Path) -> None:
    bass = load_preset("slap", capo=2)
    page = export_page({"slap": bass, "mine": bass}, tmp_path / "page")
    assert [bass["bench"] for bass in page_of(page)["basses"]] == [None, None]
    assert names(page.parent / "basses") == ["mine.lbass", *with_earlier("slap")]
    assert is_page(list(page.parent.iterdir()))


ADDRESS = "https://example.org/bass/"


@pytest.mark.parametrize("address", ["example.org", "ftp://example.org", "https://", "https://a b", '">', ""])
def test_a_wrong_address_is_refused(run: Run, tmp_path: Path, address: str) -> None:
    err = refusal(run, "export", "web", "-p", "slap", "-o", tmp_path / "page", "--address", address, status=2)
    assert "https://example.org/bass/" in err and not (tmp_path / "page").exists()


def test_the_command_takes_an_address(run: Run, tmp_path: Path) -> None:
    status, _, err = run("export", "web", "-p", "slap", "-o", tmp_path / "page", "--address", f"{ADDRESS}#case=b")
    assert status == 0, err
    assert json.loads((tmp_path / "page" / "manifest.webmanifest").read_text("utf-8"))["start_url"] == "./"
    assert is_page(list((tmp_path / "page").iterdir()))
    assert f'<link rel="canonical" href="{ADDRESS}">' in (tmp_path / "page" / "index.html").read_text("utf-8")


@pytest.mark.parametrize("name, number", [("slap", "99"), ("slap", "0"), ("slap", "x"), ("mine", "1")])
def test_the_command_refuses_revisions_that_are_not_there(name: str, number: str) -> None:
    bass, source = load_preset("slap"), Source("slap")
    basses, sources = {name: bass}, {name: source}
    check_link(f"like={name}&tone=0", basses, sources)
    has = f"has revisions up to {present('slap')}" if name == "slap" else "has no revisions"
    with pytest.raises(ValueError, match=f"of revision {number} of {bass.name}, which {has} on this page"):
        check_link(f"like={name}&revision={number}", basses, sources)
    with pytest.raises(ValueError, match="made for a later livebass"):
        check_link(f"like={name}&format=2", basses, sources)


def test_the_command_takes_those_that_are() -> None:
    check_link("like=slap&revision=1&format=1", {"slap": load_preset("slap")}, {"slap": Source("slap")})
