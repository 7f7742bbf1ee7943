"""The plugin window's picture shows the looks and parameters, and the pointer changes the parameters."""

from __future__ import annotations

import ctypes as c
import random
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.picture import (
    BEGIN,
    BENCH,
    DOUBLE,
    DOWN,
    END,
    HEIGHT,
    LEAVE,
    MOVE,
    MOVED,
    PLAY,
    PRESS,
    RELEASE,
    SETTINGS,
    TONE,
    UP,
    WIDTH,
    Host,
    Picture,
    Pixels,
    library,
    made_look,
    number,
    shelf,
)
from support.plugins import RATE

from livebass import load_preset
from livebass.kernels.player.performer import HELD
from livebass.live.parameters import PARAMETERS
from livebass.live.thread.look import LOOK
from livebass.rows.arrays import Floats
from livebass.rows.techniques import FINGERS, PALM, PICKED, TECHNIQUE, THUMB

BASSES = ("slap", "five-string", "six-string", "fretless")
STRINGS = {4: (28, 33, 38, 43), 5: (23, 28, 33, 38, 43), 6: (23, 28, 33, 38, 43, 48)}
NUT, SADDLE, TOP = 52, 74, 74  # pixels from the picture's left, right and upper edge ...
MIDDLE, HALF_NECK = 199, 97  # ... of the neck at its saddle, on the page Tone; at scale 1
LENGTH = 0.86  # m
Make = Callable[..., Picture]
ACROSS, BY_HAND = 2, 1  # shapes of the pointer
LISTING = ("list", "sound", "save", "load", "remove")  # what a picture with a list of sounds calls
ZOOM = 8  # magnification of motion
SLOWER = 4  # times the usual, for a busy machine


@pytest.fixture
def see(lend: Any) -> Make:
    """Makes a picture of a host, and draws it once."""

    def make(*arguments: Any, **more: Any) -> Picture:
        made: Picture = lend(Picture(*arguments, **more))
        made.draw()
        return made

    return make


@pytest.fixture
def draw_look(lend: Any) -> Make:
    """Makes a picture of a look, and turns it to the page Tone."""

    def make(look: NDArray[Any], **more: Any) -> Picture:
        made: Picture = lend(Picture(**more))
        made.show(look)
        made.draw()
        made.turn_to(TONE)
        return made

    return make


@pytest.fixture
def picture(draw_look: Make) -> Picture:
    return draw_look(made_look())


def bright(pixels: Pixels) -> NDArray[Any]:
    """The sum of red, green and blue."""
    return (pixels >> 16 & 255).astype(int) + (pixels >> 8 & 255) + (pixels & 255)


def x_of(metres: Any, picture: Picture) -> Any:
    """The place along the neck of a point, m from the nut."""
    scale, width = picture.scale, picture.pixels.shape[1]
    return scale * NUT + metres * (width - scale * (NUT + SADDLE)) / LENGTH


def lane(picture: Picture, string: int, strings: int, x: Any) -> Any:
    """The height of a string at rest, lowest first; or between two of them."""
    scale, part = picture.scale, (x - x_of(0, picture)) / (x_of(LENGTH, picture) - x_of(0, picture))
    half = scale * HALF_NECK * (0.84 + 0.16 * part)
    return scale * MIDDLE - half * ((2 * string + 1) / strings - 1)


def play(string: int, fret: int, amplitudes: list[float]) -> NDArray[Any]:
    """A look at one sounding string."""
    look = made_look()
    stop = float(look["place"][0, fret])
    seen = look["string"][0, string]
    seen["state"], seen["fret"] = HELD, fret
    slot = seen["sight"]["slot"][1]
    slot["on"], slot["fret"], slot["modes"], slot["length"] = 1, fret, len(amplitudes), LENGTH - stop
    slot["u"][: len(amplitudes)] = amplitudes
    return look


@pytest.mark.parametrize("strings", STRINGS)
@pytest.mark.parametrize(("scale", "dark"), [(1.0, True), (2.0, False)])
def test_the_neck_is_drawn_to_scale(strings: int, scale: float, dark: bool, lend: Any) -> None:
    """Frets are in their places, none on a fretless neck; the string count is right."""
    for fretless in (False, True):
        picture = lend(Picture(size=(int(WIDTH * scale), int(HEIGHT * scale)), scale=scale))
        picture.dark = dark
        look = made_look(STRINGS[strings], fretless)
        picture.show(look)
        assert picture.draw() == (0, 0, int(WIDTH * scale), int(HEIGHT * scale))
        picture.turn_to(TONE)
        frets, light = x_of(look["place"][0, 1:21], picture), bright(picture.pixels)
        columns = np.arange(int(x_of(0.01, picture)), int(frets[-1] + 6 * scale))
        rows = np.rint(lane(picture, 0, strings, columns) + 0.32 * 2 * scale * HALF_NECK / strings).astype(int)
        lit = np.flatnonzero(light[rows, columns] > 400)
        runs = [run.mean() + columns[0] for run in np.split(lit, np.flatnonzero(np.diff(lit) > 2) + 1) if len(run)]
        assert len(runs) == (0 if fretless else 20)
        assert fretless or np.allclose(runs, frets, atol=1.5 * scale)
        x = int(x_of(0.03, picture))
        for string in range(strings):
            y = int(lane(picture, string, strings, x))
            assert light[y - 2 : y + 3, x].max() > 400, string


def height_of(picture: Picture, string: int, x: int) -> float:
    """The height of a string in a column: the middle of the bright pixels around its place at rest."""
    middle = int(lane(picture, string, 4, x + 0.5))
    rows = np.arange(middle - 26, middle + 27)
    light = np.clip(bright(picture.pixels)[rows, x] - 340.0, 0, None)
    return float((light * (rows + 0.5)).sum() / light.sum())


@pytest.mark.parametrize(("string", "fret"), [(1, 0), (2, 7), (0, 2)])
def test_a_string_is_drawn_as_the_look_has_it(picture: Picture, string: int, fret: int) -> None:
    """Magnified by ZOOM, from its stop to the saddle, over the neck at rest."""
    picture.draw()
    look = play(string, fret, [1.2e-3, 0.0, -0.5e-3])
    places, stop = look["place"][0, :21], float(look["place"][0, fret])
    dots = [(places[k - 1] + places[k]) / 2 for k in (3, 5, 7, 9, 12, 15, 17, 19)]
    columns = [x for x in range(70, 570) if min(abs(x + 0.5 - x_of(np.array([*places, *dots]), picture))) > 7]
    rest = [height_of(picture, string, x) for x in columns]
    look["bass"] = 2  # another one: no blur of the last picture
    picture.show(look)
    dirty = picture.draw()
    assert dirty[1] >= TOP - 1 and dirty[1] + dirty[3] < 368
    metre, compared = (WIDTH - NUT - SADDLE) / LENGTH, 0
    for x, before in zip(columns, rest, strict=True):
        t = ((x + 0.5 - NUT) / metre - stop) / (LENGTH - stop)
        if fret and -0.08 < t < 0.03:
            continue  # the name of the note is there
        shape = sum(a * np.sin((j + 1) * np.pi * t) for j, a in enumerate([1.2e-3, 0.0, -0.5e-3]))
        wanted = ZOOM * metre * np.sqrt(2 / (LENGTH - stop)) * shape if t > 0 else 0
        assert abs(before - height_of(picture, string, x) - wanted) < 0.6, x
        compared += abs(wanted) > 3
    assert compared > 10


def test_looks_in_between_are_a_blur(picture: Picture) -> None:
    """The string's path since the last picture is lighter than the wood, but not as light as the string."""
    picture.draw()
    rest = bright(picture.pixels)
    for amplitude in (-2e-3, 0.0, 2e-3):
        picture.show(play(1, 0, [amplitude]))
    picture.draw()
    x, light = 300, bright(picture.pixels)
    middle = int(lane(picture, 1, 4, x))
    below, above = light[middle + 8, x] - rest[middle + 8, x], light[middle - 8, x] - rest[middle - 8, x]
    assert 30 < below < 350 and 30 < above < 350
    assert (light[middle + 60, x], light[middle - 60, x]) == (rest[middle + 60, x], rest[middle - 60, x])


@pytest.mark.parametrize("fretless", [False, True])
def test_a_contact_lights_its_fret(draw_look: Make, fretless: bool) -> None:
    """Harder is brighter, on its string, and nothing else lights up."""
    picture = draw_look(made_look(fretless=fretless))
    rest, gained = bright(picture.pixels), []
    for hard in (0.3, 1.0):
        look = made_look(fretless=fretless)
        look["string"][0, 2]["light"][5] = hard
        picture.show(look)
        picture.draw()
        more = bright(picture.pixels) - rest
        x = float(x_of(look["place"][0, 5], picture))
        rows, columns = np.nonzero(more)
        assert abs(columns - x).max() < 20 and abs(rows - lane(picture, 2, 4, x)).max() < 45
        gained.append(more.sum())
    picture.show(made_look(fretless=fretless))
    picture.draw()
    assert 0 < 2 * gained[0] < gained[1] and (bright(picture.pixels) == rest).all()


@pytest.mark.parametrize("chokes", [True, False])
def test_a_note_that_frets_out_is_said_with_its_fret_and_lit_there(
    picture: Picture, draw_look: Make, chokes: bool
) -> None:
    """Once a note, in place of the title; its fret is lit as long as the string sounds."""
    at, on = 9, 20
    look = play(3, at, [1e-4])
    look["latest"], look["notes"] = 3, 1
    look["string"][0, 3]["sight"]["slot"][1]["lies"] = on if chokes else 0
    picture.show(look)
    picture.draw()
    silent = draw_look(made_look())
    assert (picture.pixels != silent.pixels)[12:34, 160:300].any() == chokes, "the title"
    x = x_of(float(look["place"][0, on]), picture)
    y = lane(picture, 3, 4, x)
    near = np.s_[round(y) - 12 : round(y) - 4, round(x) - 3 : round(x) + 3]
    assert (bright(picture.pixels)[near] > bright(silent.pixels)[near] + 60).any() == chokes
    picture.draw(seconds=15)
    picture.show(look)
    picture.draw()
    assert not (picture.pixels != silent.pixels)[12:34, 160:300].any(), "it is said once"


def test_over_a_bare_board_it_has_the_place(picture: Picture, draw_look: Make) -> None:
    """The string ends at that place."""
    silent = draw_look(made_look(fretless=True))
    look = play(3, 9, [1e-4])
    look["fretless"], look["latest"], look["notes"] = 1, 3, 1
    slot = look["string"][0, 3]["sight"]["slot"][1]
    slot["lies"], slot["length"] = 20, LENGTH - look["place"][0, 20]
    picture.show(look)
    picture.draw()
    assert (picture.pixels != silent.pixels)[12:34, 160:300].any()


def test_a_fret_that_the_neck_does_not_have_is_none(picture: Picture, draw_look: Make) -> None:
    """A look may come from another process."""
    silent = draw_look(made_look())
    for lies in (-1, 21, 1 << 40):
        look = play(3, 9, [1e-4])
        look["latest"], look["notes"] = 3, 1
        look["string"][0, 3]["sight"]["slot"][1]["lies"] = lies
        picture.show(look)
        picture.draw()
        assert not (picture.pixels != silent.pixels)[12:34, 160:300].any(), lies


def test_a_fret_has_a_name_and_a_bare_board_a_place() -> None:
    for fretless, text in ((False, "fret 9"), (True, f"{1e3 * LENGTH * (1 - 2 ** (-9 / 12)):.0f} mm")):
        look, room = made_look(fretless=fretless), c.create_string_buffer(16)
        library().lb_fret_text(c.c_void_p(look.ctypes.data), 9, room, c.c_size_t(16))
        assert room.value.decode() == text


def test_frets_that_choke_the_lowest_string_stay_where_they_are(draw_look: Make) -> None:
    """A look has the places where that string ends."""
    right, look = draw_look(made_look()), made_look()
    look["place"][0, 3:7], look["place"][0, 11:20] = look["place"][0, 7], look["place"][0, 20]
    assert np.array_equal(draw_look(look).pixels, right.pixels)


def test_so_the_fret_that_a_string_lies_on_is_the_right_one(draw_look: Make) -> None:
    drawn = []
    for chokes in (False, True):
        look = play(3, 9, [1e-4])
        look["latest"], look["notes"] = 3, 1
        slot = look["string"][0, 3]["sight"]["slot"][1]
        slot["lies"], slot["length"] = 20, LENGTH - look["place"][0, 20]
        if chokes:
            look["place"][0, 11:20] = look["place"][0, 20]
        drawn.append(draw_look(look).pixels)
    assert np.array_equal(*drawn)


def test_names_of_notes_are_where_they_are_held(picture: Picture) -> None:
    picture.draw()
    rest = bright(picture.pixels)
    look = made_look()
    look["string"][0, 3]["state"], look["string"][0, 3]["fret"] = HELD, 9
    look["string"][0, 0]["state"] = HELD
    picture.show(look)
    picture.draw()
    rows, columns = np.nonzero(bright(picture.pixels) - rest)
    held = columns > 60
    assert abs(columns[held] - x_of(look["place"][0, 9], picture)).max() < 35
    assert abs(rows[held] - lane(picture, 3, 4, 350)).max() < 12
    assert len(columns[~held]) > 100 and abs(rows[~held] - lane(picture, 0, 4, NUT)).max() < 12


def test_lamps_and_overload(picture: Picture) -> None:
    """Each state lights its own lamp."""
    picture.turn_to(PLAY)
    lit = []

    def changed_places(**values: int | float) -> tuple[Any, Any]:
        """The rows and columns that change with some values of the look."""
        picture.show(made_look())
        picture.draw()
        dark, look = picture.pixels.copy(), made_look()
        for name, value in values.items():
            look[name] = value
        picture.show(look)
        assert picture.draw() != (0, 0, 0, 0), values
        return np.nonzero(picture.pixels != dark)

    for name, value in (("palm", 0.5), ("legato", 1), ("pedal", 1), ("overload", 2), ("slapped", 2)):
        rows, columns = changed_places(**{name: value})
        lit.append((columns.min(), rows.min()))
        assert name == "overload" or (rows.min() > 210 and rows.max() < 330)
        assert name != "overload" or rows.max() < TOP
    assert len(set(lit)) == len(lit)
    assert changed_places(switched=1 << PALM)[1].min() == lit[0][0]


# --- the pointer ---


def sliders(picture: Picture) -> dict[int, tuple[int, int, int]]:
    """Row, first and last column of the track of each visible slider, by parameter, found by the pointer."""
    found = {}
    for y in range(330, HEIGHT, 6):
        x = 0
        while x < WIDTH:
            if picture.point(MOVE, x, y) != ACROSS:
                x += 4
                continue
            picture.sets.clear()
            picture.point(PRESS, x, y)
            k = picture.sets[0][0]
            picture.point(RELEASE, x, y)
            first = x
            while picture.point(MOVE, x, y) == ACROSS:
                x += 1
            found[k] = (y, next(c for c in range(first, 0, -1) if picture.point(MOVE, c, y) != ACROSS) + 6, x - 6)
    picture.sets.clear()
    return found


def test_dragging_a_slider_sets_its_parameter(picture: Picture) -> None:
    picture.draw()
    for page, symbol, part in (
        (TONE, "tone", 0.25), (TONE, "gain", 0.5), (PLAY, "palm_mute", 1.0), (SETTINGS, "bend_range", 0.5),
    ):  # fmt: skip
        picture.turn_to(page)
        places = sliders(picture)
        assert number("technique") not in places
        p = PARAMETERS[number(symbol)]
        y, first, last = places[p.number]
        before = picture.values[p.number] = p.maximum  # its knob is elsewhere
        picture.point(PRESS, first, y)
        picture.point(MOVE, (first + last) / 2, y)
        picture.point(MOVE, first + part * (last - first), y + 100)
        picture.point(RELEASE, 0, 0)
        picture.point(MOVE, first, y)
        phases = [phase for _, _, phase in picture.sets]
        assert phases == [BEGIN, MOVED, MOVED, MOVED, END] and {k for k, *_ in picture.sets} == {p.number}
        wanted = p.minimum + part * (p.maximum - p.minimum)
        values = [value for _, value, _ in picture.sets]
        assert values[0] == before and values[1] == pytest.approx(p.minimum, abs=0.02 * (p.maximum - p.minimum))
        assert abs(values[3] - wanted) <= 0.02 * (p.maximum - p.minimum) and values[4] == values[3]
        assert not p.whole or values[3] == round(values[3])
        assert picture.draw() != (0, 0, 0, 0)
        picture.sets.clear()
        picture.point(DOUBLE, first + 9, y)
        assert picture.sets == [(p.number, values[4], BEGIN), (p.number, p.default, MOVED), (p.number, p.default, END)]
        picture.sets.clear()


def test_a_press_on_a_name_or_on_a_knob_changes_nothing(picture: Picture) -> None:
    """A drag from there moves the value by as much as the pointer."""
    picture.draw()
    y, first, last = sliders(picture)[number("tone")]
    for x, row in ((first + 3, y - 20), ((first + last) / 2 + 4, y)):
        picture.values[number("tone")] = 0.0
        picture.draw()
        picture.sets.clear()
        picture.point(PRESS, x, row)
        assert [phase for *_, phase in picture.sets] == [BEGIN] and picture.values[number("tone")] == 0
        picture.point(MOVE, x + 0.25 * (last - first), row)
        assert picture.values[number("tone")] == pytest.approx(0.5, abs=0.03)
        picture.point(RELEASE, x, row)


def test_wheel_and_fine_steps(picture: Picture) -> None:
    picture.draw()
    y, first, last = sliders(picture)[number("tone")]
    picture.values[number("tone")] = 0.0
    picture.point(UP, first, y)
    assert picture.values[number("tone")] == pytest.approx(0.05)
    picture.point(DOWN, first, y, 1)  # shift
    assert picture.values[number("tone")] == pytest.approx(0.04)
    picture.point(PRESS, first + 20, y, 1)
    picture.point(MOVE, first + 20 + (last - first) / 2, y, 1)
    picture.point(LEAVE, 0, 0)
    assert picture.values[number("tone")] == pytest.approx(0.14, abs=0.01)
    assert picture.sets[-1][2] == END


def test_the_pluck_point_is_dragged(picture: Picture) -> None:
    """It is at the look's place, and requests the value with which the performer plucks at the pointer."""
    picture.draw()
    x, y = float(x_of(0.74 * LENGTH, picture)), TOP + 10
    assert picture.point(MOVE, x, y) == ACROSS
    picture.point(PRESS, x, y)
    for place in (0.80, 0.60, 0.99, 0.2):
        picture.point(MOVE, float(x_of(place * LENGTH, picture)), y)
    picture.point(RELEASE, x, y)
    values = [value for k, value, phase in picture.sets if phase == MOVED and k == number("pluck_position")]
    assert np.allclose(values, [-0.06 / 0.19, 0.14 / 0.19, -1, 1], atol=0.01)
    assert (picture.sets[0][2], picture.sets[-1][2]) == (BEGIN, END)


def test_strings_are_played_by_the_pointer(picture: Picture) -> None:
    """A note behind each fret; the next one begins before the last ends. Leaving ends it."""
    picture.draw()
    places = made_look()["place"][0]
    x = [float(x_of(places[fret] - 0.01, picture)) for fret in (3, 4)]
    y = float(lane(picture, 1, 4, x[0]))
    picture.point(PRESS, x[0], y)
    picture.point(MOVE, x[1], y)
    picture.point(MOVE, x[1] + 1, y)
    picture.point(LEAVE, 0, 0)
    assert picture.notes == [(1, 1, 36), (1, 1, 37), (0, 1, 36), (0, 1, 37)]
    picture.notes.clear()
    picture.point(PRESS, float(x_of(0.7, picture)), float(lane(picture, 3, 4, 680)))
    picture.point(RELEASE, 0, 0)
    assert picture.notes == [(1, 3, 43), (0, 3, 43)]


def test_basses_are_chosen(see: Make, host: Host) -> None:
    """By the arrows, in a circle, and from a list; the neck follows."""
    picture = see(host)
    before = picture.pixels.copy()
    picture.press(432, 23)
    assert picture.sets == [(8, 0.0, BEGIN), (8, 1.0, MOVED), (8, 1.0, END)]
    host.play(RATE // 100)
    picture.draw()
    assert (picture.pixels != before)[TOP:260].any()
    for _ in range(3):
        picture.point(PRESS, 432, 23)
    assert picture.values[8] == 0
    picture.press(136, 23)
    assert picture.values[8] == len(BASSES) - 1
    picture.press(300, 23)
    assert picture.point(MOVE, 60, 137) == BY_HAND
    picture.point(PRESS, 60, 137 + 24)
    assert picture.values[8] == 1
    picture.draw()
    assert picture.point(MOVE, 300, 88) != BY_HAND


def view_of(picture: Picture, x: int, y: int, w: int, h: int) -> Pixels:
    scale = round(picture.scale)
    return picture.pixels[y * scale : (y + h) * scale, x * scale : (x + w) * scale].copy()


def asks(picture: Picture) -> bool:
    """True if it asks whether to delete a sound, in the warning colour."""
    return int((picture.pixels & 0xFFFFFF == 0xFF6B57).sum()) > 1000


@pytest.mark.parametrize(("size", "scale"), [((WIDTH, HEIGHT), 1.0), ((640, 320), 1.0), ((1800, 920), 2.0)])
def test_sounds_are_saved_listed_loaded_and_deleted(
    host: Host, own: Path, see: Make, size: tuple[int, int], scale: float
) -> None:
    """Listed beside the basses in their own column; deleted by two presses of the right button."""
    picture = see(host, size, scale, LISTING)
    width = round(size[0] / scale)
    save_at, title = (width - 14 - 236 - 30, 23) if width < WIDTH else (474, 23), (200, 23)

    def click(x: float, y: float, modifiers: int = 0) -> None:
        picture.press(x * scale, y * scale, modifiers)

    named = view_of(picture, 155, 10, 180, 26)
    for gain in (-6.0, -3.0):
        host.set("gain", gain)
        click(*save_at)  # it asks for a name
        click(*save_at)
    assert sorted(file.name for file in own.iterdir()) == ["Slap 1.toml", "Slap 2.toml"]
    assert (view_of(picture, 155, 10, 180, 26) != named).any(), "it says that it is saved"
    picture.draw(seconds=10)
    assert (view_of(picture, 155, 10, 180, 26) == named).all()
    click(*title)
    column = 14 + (width - 28) // (4 if width >= WIDTH else 3) + 30
    row = TOP + 4 + 2 * 24 + 11  # after the last of five rows of basses and search, and a heading
    first, second = (column, row), (column, row + 24)
    assert (
        picture.point(MOVE, *(scale * at for at in first)) == picture.point(MOVE, *(scale * at for at in second)) == 1
    )
    host.set("gain", 0.0)
    host.set("bass", 1.0)
    host.set("quality", 1.0)
    click(*first)
    assert (host.value("gain"), host.value("bass"), host.value("quality")) == (-6, 0, 1)
    click(*title)
    click(*second)
    assert host.value("gain") == -3
    library().lb_undo(host.address)
    assert host.value("gain") == -6
    library().lb_undo(host.address)
    assert (host.value("gain"), host.value("bass")) == (0, 1)
    click(*title)
    for cancel in (second, None):
        assert not asks(picture)
        click(*first, 8)
        assert asks(picture)
        picture.point(MOVE, *(scale * at for at in cancel or first))
        picture.draw()
        if not cancel:
            click(*first)  # the left button
        assert len(list(own.iterdir())) == 2 and host.value("gain") == 0
    click(*first, 8)
    click(*first, 8)
    assert [file.name for file in own.iterdir()] == ["Slap 2.toml"]
    click(*first, 8)
    assert len(list(own.iterdir())) == 1, "the one behind it is asked for again"
    picture.point(MOVE, 0, 0)
    click(*save_at)
    click(*save_at)
    assert len(list(own.iterdir())) == 2 and picture.point(MOVE, *(scale * at for at in second)) == 1


def test_a_long_list_goes_on(host: Host, own: Path, see: Make) -> None:
    """The button in the last place, and the wheel, reach everything."""
    picture = see(host, (640, 320), optional=LISTING)
    for k in range(30):
        host.set("gain", -float(k))
        assert host.save_sound() == f"Slap {k + 1}"
    picture.draw()
    more = 600, TOP + 4 + 4 * 24 + 11
    picture.press(200, 23)
    for way in ("button", "wheel"):
        loaded = set()
        for _ in range(14 if way == "wheel" else 0):
            picture.point(UP, 30, 88)
            picture.draw()
        for _ in range(12):
            for k in range(14):
                x, y = 30 + k // 5 * 204, TOP + 4 + k % 5 * 24 + 11
                if picture.point(MOVE, x, y) == BY_HAND:
                    picture.point(PRESS, x, y)
                    loaded.add(host.value("gain"))
                    picture.press(200, 23)  # it is listed again in its old place
            if way == "button":
                picture.press(*more)
            else:
                picture.point(DOWN, 30, 88)
            picture.draw()
        assert loaded == {-float(k) for k in range(30)}, way


def test_a_long_list_leaves_the_panel_in_a_large_window(host: Host, own: Path, see: Make) -> None:
    """However many sounds there are, lamps, tabs and sliders below stay visible; the last place leads on."""
    assert host.save_sound() == "Slap 1"
    for k in range(2, 400):
        (own / f"Slap {k}.toml").write_bytes((own / "Slap 1.toml").read_bytes())
    picture = see(host, (1920, 1080), optional=LISTING)
    before = view_of(picture, 0, 900, 1920, 180)
    picture.press(200, 23)
    listed = view_of(picture, 0, 78, 1920, 700)
    assert np.array_equal(view_of(picture, 0, 900, 1920, 180), before)
    picture.point(DOWN, 30, 88)
    picture.draw()
    assert not np.array_equal(view_of(picture, 0, 78, 1920, 700), listed)


def test_lamps_move_parameters(host: Host, see: Make) -> None:
    """A press chooses a stroke, or switches a technique; the next press switches it off. Stop presses its key."""
    picture = see(host)
    moved: dict[int, list[float]] = {}
    for x, y in ((x, y) for y in range(226, 320, 26) for x in range(90, WIDTH, 36)):
        if picture.point(MOVE, x, y) != BY_HAND:
            continue
        before = {p.number: host.value(p.symbol) for p in PARAMETERS}
        picture.press(x, y)
        for k, value in before.items():
            if host.value(PARAMETERS[k].symbol) != value:
                moved.setdefault(k, []).append(host.value(PARAMETERS[k].symbol))
    assert {FINGERS, PICKED, THUMB} <= {*moved.pop(TECHNIQUE)}
    assert {"palm_mute", "vibrato", "legato", "slide", "let_ring", "ghost"} <= {PARAMETERS[k].symbol for k in moved}
    for values in moved.values():
        assert len(values) > 1 and min(values) == 0 < max(values) and len({*values}) == 2
    assert {key for _, _, key in picture.notes} == {8}


def test_nothing_is_written_beyond_the_array(picture: Picture) -> None:
    """At any size and for any pointer action; regions reported unchanged are unchanged."""
    chance = random.Random(1)
    for _ in range(40):
        picture.resize(chance.randrange(1, 900), chance.randrange(1, 500))
        picture.scale, picture.dark = chance.choice((1.0, 1.5, 3.0)), chance.random() < 0.5
        for _ in range(8):
            height, width = picture.pixels.shape
            kind = chance.randrange(7)
            picture.point(kind, chance.uniform(-20, width + 20), chance.uniform(-20, height + 20), chance.randrange(16))
            if chance.random() < 0.5:
                look = play(chance.randrange(4), chance.randrange(20), [chance.gauss(0, 3e-3) for _ in range(20)])
                look["string"]["light"] = chance.random()
                picture.show(look)
            before = picture.pixels.copy()
            x, y, w, h = picture.draw()
            assert 0 <= x <= x + w <= width and 0 <= y <= y + h <= height
            for left, top, wide, tall in picture.drawn_areas():
                assert x <= left <= left + wide <= x + w and y <= top <= top + tall <= y + h
                before[top : top + tall, left : left + wide] = picture.pixels[top : top + tall, left : left + wide]
            assert (before == picture.pixels).all()
    held: dict[int, int] = {}
    picture.point(LEAVE, 0, 0)
    for k, value, phase in picture.sets:
        p = PARAMETERS[k]
        held[k] = held.get(k, 0) + (phase == BEGIN) - (phase == END)
        assert held[k] in (0, 1) and p.minimum <= value <= p.maximum
    assert not any(held.values())


def test_drawing_is_cheap(host: Host, lend: Any) -> None:
    """Processor time: about 0.6 ms a picture while all strings move, 20 ms for the first one."""
    picture = lend(Picture(host))
    host.watch(True)
    start = time.process_time()
    picture.draw()
    assert time.process_time() - start < 0.05 * SLOWER
    spent = 0.0
    for k in range(45):
        if k % 9 == 0:
            host.note(True, 28 + 6 * (k // 9), 0.9)
        host.play(RATE // 30)
        start = time.process_time()
        picture.draw()
        spent += time.process_time() - start
    assert spent / 45 < 0.02 / 30 * SLOWER
    for _ in range(3):
        picture.draw(seconds=5)
    assert picture.draw() == (0, 0, 0, 0)


def test_strips_leave_what_a_whole_picture_shows(picture: Picture) -> None:
    """Whatever moved before: resting strings, moving ones, and names, over the neck at rest."""
    chance = random.Random(2)
    apart = 0
    for _ in range(12):
        look = play(chance.randrange(4), chance.randrange(20), [chance.gauss(0, 3e-3) for _ in range(8)])
        look["string"][0, 0]["light"][5] = chance.random() < 0.2
        for amplitude in (1.0, 0.1, 1.0, 1.0, 1.0):  # smaller, then the same until no blur is left
            look["string"]["sight"]["slot"]["u"] *= amplitude
            picture.show(look)
            picture.draw()
        areas = picture.drawn_areas()
        apart += len(areas) > 1 or (len(areas) == 1 and areas[0][3] < 100)
        strips = picture.pixels.copy()
        picture.resize(WIDTH, HEIGHT)
        picture.draw()
        assert np.array_equal(picture.pixels, strips)
    assert apart > 3


def test_little_motion_is_drawn_half_as_often(picture: Picture) -> None:
    picture.draw()
    for amplitude, drawn in ((3e-3, 12), (1e-6, 6)):
        found = 0
        for k in range(12):
            picture.show(play(1, 5, [amplitude * (1 + k % 3)]))
            found += picture.draw() != (0, 0, 0, 0)
        assert found == drawn
    picture.show(made_look())
    picture.draw()
    picture.draw()
    assert picture.draw() == (0, 0, 0, 0)


def test_a_tap_on_a_string_is_heard(instruments: Path) -> None:
    """However short: as a note of 50 ms. A longer one ends with the hand, and so does one struck again."""
    fifty = RATE // 20

    def played(
        touches: dict[int, list[tuple[bool, int]]], by_hand: bool = True, bound: bool = False, keyboard: bool = False
    ) -> Floats:
        host, sound = Host(instruments), []
        host.set("relief", 0.0)  # tests do not run in real time
        if bound:
            host.midi(0xB0, 68, 127)
        for block in range(60):
            for on, key in touches.get(block, ()):
                if by_hand:
                    host.touch(on, -1 if keyboard else (key - 28) // 5, key)
                else:
                    host.note(on, key, 95 / 127)
            sound.append(host.play(240, 240))
        host.close()
        return np.concatenate(sound)

    wanted = played({0: [(True, 28)], fifty // 240: [(False, 28)]}, by_hand=False)
    assert abs(wanted).max() > 0.01
    for end in (0, 1, fifty // 240 - 1, fifty // 240):
        touched = {0: [(True, 28)]}
        touched.setdefault(end, []).append((False, 28))
        assert np.array_equal(played(touched), wanted), end
        assert np.array_equal(played(touched, keyboard=True), wanted), end
    longer = {0: [(True, 28)], 30: [(False, 28)]}
    assert np.array_equal(played(longer), played(longer, by_hand=False))
    twice = played({0: [(True, 28), (False, 28)], 3: [(True, 28)], 30: [(False, 28)]})
    held = played({0: [(True, 28)], 3: [(False, 28), (True, 28)], 30: [(False, 28)]}, by_hand=False)
    assert np.array_equal(twice, held)
    glide = [(True, 32), (True, 31), (False, 32), (True, 30), (False, 31), (False, 30)]
    apart = {0: [step for step in glide if step[0]], fifty // 240: [step for step in glide if not step[0]]}
    for bound in (False, True):
        assert np.array_equal(played({0: glide}, bound=bound), played(apart, by_hand=False, bound=bound))


def test_a_tap_outlives_no_reset(host: Host) -> None:
    """Frame counts restart: an earlier note delays no end of a later one."""
    host.play(RATE)
    host.touch(True, 1, 33)
    host.play(64)
    library().lb_reset_instance(host.address)
    host.touch(False, 1, 33)
    host.touch(True, 0, 28)
    host.touch(False, 0, 28)
    first = host.play(RATE // 20, 240)
    tail = host.play(RATE, 240)
    assert abs(first).max() > 0.01 and abs(tail[RATE // 2 :]).max() < abs(first).max() / 30


def test_the_quality_follows_a_bass_that_is_chosen_in_the_window(tmp_path: Path, lend: Any) -> None:
    """The host hears of both changes: an LV2 host has no other source."""
    shelf(tmp_path, ["slap", "five-string"])
    (tmp_path / "instruments.txt").write_text("slap\nfive-string studio\n")
    host = lend(Host(tmp_path))
    bass, quality = number("bass"), number("quality")
    for phase in (BEGIN, MOVED, END):
        library().lb_move_value(host.address, bass, 1.0, phase)
    assert [(k, phase) for k, phase, _ in host.moves()] == [
        (bass, BEGIN), (bass, MOVED), (quality, BEGIN), (quality, MOVED), (quality, END), (bass, END),
    ]  # fmt: skip
    assert host.value("quality") == 1


# --- looks ---


def phrase(host: Host, block: int) -> Floats:
    """Hard notes on several strings, and one that ends."""
    sound = []
    for key in (28, 45, 35, 52, 31):
        host.note(True, key, 0.95)
        sound.append(host.play(3000, block))
    host.note(False, 31)
    sound.append(host.play(9000, block))
    return np.concatenate(sound)


@pytest.mark.parametrize("block", [64, 1024])
def test_who_watches_changes_nothing(instruments: Path, lend: Any, block: int) -> None:
    """With a window the sound is the same bit for bit; without one only the first look is taken."""
    sounds = []
    for watched in (False, True):
        host = lend(Host(instruments))
        host.set("relief", 0.0)
        if watched:
            host.watch(True)
        sounds.append(phrase(host, block))
        taken = library().lb_looks_taken(host.look)
        assert taken == 1 if not watched else 20 < taken <= 24000 / block + 2, taken
    assert abs(sounds[0]).max() > 0.05 and (sounds[0] == sounds[1]).all()


def test_looks_of_a_bass_that_plays(host: Host) -> None:
    """Playing strings, shapes, and hit frets, which fade."""
    assert library().size_of_look() == LOOK.itemsize
    look = np.zeros(1, LOOK)
    assert library().lb_read_look(host.look, 0, look.ctypes.data)  # a look exists before the first block
    first = look[0]
    assert (first["strings"], first["frets"], first["fretless"]) == (4, 20, 0) and list(
        first["string"]["open"][:4]
    ) == [28, 33, 38, 43]
    assert np.allclose(first["place"][:13], first["string"]["length"][0] * (1 - 2 ** (-np.arange(13) / 12)), atol=1e-3)
    host.watch(True)
    host.note(True, 31, 1.0)
    host.play(4800)
    assert library().lb_read_look(host.look, 0, look.ctypes.data)
    now = look[0]
    string = now["string"][0]
    assert (string["state"], string["key"], string["fret"]) == (HELD, 31, 3) and now["peak"] > 0.01
    assert max(abs(slot["u"]).max() for slot in string["sight"]["slot"] if slot["on"]) > 1e-4
    lit = np.flatnonzero(string["light"] > 0.1)
    assert len(lit) and lit.min() > 3 and lit.max() <= 20
    assert not now["string"][1]["light"].any()
    host.note(False, 31)
    host.play(RATE)
    assert library().lb_read_look(host.look, 0, look.ctypes.data)
    assert look[0]["string"][0]["state"] != HELD and look[0]["string"][0]["light"].max() < 0.01
    host.set("bass", float(BASSES.index("six-string")))
    host.play(RATE // 10)
    assert library().lb_read_look(host.look, 0, look.ctypes.data) and look[0]["strings"] == 6


def test_a_look_is_never_torn() -> None:
    """One thread writes as fast as it can while another reads."""
    assert library().race(20_000) > 100


# --- the pages, the bench's side view, the keyboard ---

WHOLE = ("undo", "swap", "side", "copy", "title", "playing", "group", *LISTING)
ESCAPE, ENTER, TAB, RIGHT_KEY, RIGHT_BUTTON, LISTED = 27, 13, 9, 0x110002, 8, (280, 23)


def slider_of(picture: Picture, symbol: str) -> tuple[float, float]:
    """The place of a slider's name on the present page, found by its menu."""
    height, width = picture.pixels.shape
    for y in range(300, height, 5):
        for x in range(16, width, 16):
            if picture.point(MOVE, x, y) == ACROSS:
                picture.sets.clear()
                picture.press(x, y)
                picture.key(ESCAPE)
                if picture.sets and picture.sets[0][0] == number(symbol):
                    return x + 8, y + 3
    raise AssertionError(symbol)


def test_every_parameter_is_on_a_page_at_its_place_whatever_the_bass(host: Host, lend: Any) -> None:
    """On the keyboard's way through a page. The bass is in the header; techniques are lamps."""
    picture = lend(Picture(host))
    ways = []
    for name in ("slap", "fretless"):
        host.set("bass", float(BASSES.index(name)))
        host.play(RATE // 10)
        picture.draw()
        seen_on: dict[int, set[int]] = {}
        for page in range(4):
            picture.turn_to(page)
            for _ in range(60):
                picture.sets.clear()
                assert picture.key(TAB) and picture.key(RIGHT_KEY)
                seen_on.setdefault(page, set()).add(picture.sets[0][0])
        ways.append(seen_on)
    found = set().union(*ways[0].values())
    assert ways[0] == ways[1]
    assert found == {p.number for p in PARAMETERS if p.group != "Techniques" and p.symbol != "bass"}


@pytest.fixture
def action(host: Host, see: Make) -> tuple[Picture, float, float]:
    """A picture of the bench, and the place of the slider Action in it."""
    picture = see(host)
    picture.turn_to(BENCH)
    return picture, *slider_of(picture, "action")


def test_a_value_is_typed_in_the_units_that_it_shows(host: Host, action: tuple[Picture, float, float]) -> None:
    """After a press on the focused control, or by its menu; Escape leaves it, and what is no number changes nothing."""
    picture, x, y = action
    host.set("action", 0.0)
    picture.draw()
    assert not picture.key("1"), "no control is marked yet: keys are the host's"
    own = -1e3 * load_preset("slap").necks[0].fret_heights[11]
    for keys, wanted in (("1.4\r", 1.4 - own), ("9\x1b", 1.4 - own), ("x\r", 1.4 - own), ("1.99\x08\r", 1.9 - own)):
        picture.press(x, y, RIGHT_BUTTON)
        picture.key(0x110003, 0x0D)  # the first line of the menu
        assert library().lb_wants_keys(picture.address)
        assert picture.key(keys) and not library().lb_wants_keys(picture.address)
        picture.draw()
        assert host.value("action") == pytest.approx(wanted, abs=0.006), keys


def test_menus_and_tips_leave_no_trace(action: tuple[Picture, float, float]) -> None:
    picture, x, y = action
    picture.point(MOVE, 0, 0)
    picture.draw()
    before = picture.pixels.copy()
    picture.point(MOVE, x, y)
    picture.draw()
    hovered = picture.pixels.copy()
    picture.draw(1.0)
    assert (picture.pixels != hovered).sum() > 2000, "a tip"
    picture.point(PRESS, x, y, RIGHT_BUTTON)
    picture.draw()
    assert (picture.pixels != hovered).sum() > 2000, "a menu"
    assert picture.key(ESCAPE)
    picture.point(MOVE, 0, 0)
    picture.draw()
    assert np.array_equal(picture.pixels, before)


def test_the_side_view_moves_with_the_bench(host: Host, see: Make) -> None:
    """Action and relief lower the crowns, gauge thickens the string; a wheel's reset brings the picture back."""
    picture = see(host, (1200, 800))
    picture.turn_to(BENCH)
    before = view_of(picture, 60, 60, 1000, 560)
    for symbol, value in (("action", 1.0), ("neck_relief", 0.5), ("nut_height", 0.5), ("gauge", 20.0)):
        host.set(symbol, value)
        picture.draw()
        assert (view_of(picture, 60, 60, 1000, 560) != before).sum() > 300, symbol
        host.set(symbol, 0.0)
        picture.draw()
        assert np.array_equal(view_of(picture, 60, 60, 1000, 560), before), symbol


MM = (WIDTH - NUT - SADDLE) / 863.6  # pixels for each, of a 34 in scale
COILS = tuple(WIDTH - SADDLE - inches * 25.4 * MM for inches in (6.0, 2.4))  # of the preset's pickups, at rest
COIL_ROW = 250


@pytest.mark.parametrize("coil", [0, 1])
def test_a_pickup_is_dragged_along_the_string(host: Host, see: Make, coil: int) -> None:
    """Its own slider moves by as many mm, with a gesture for the host and Undo; a double click takes it home."""
    picture = see(host, optional=WHOLE)
    picture.turn_to(BENCH)
    symbol, x = f"pickup_{coil + 1}_place", COILS[coil]
    before = picture.pixels.copy()
    assert picture.point(MOVE, x, COIL_ROW) == ACROSS and picture.point(MOVE, x - 30, COIL_ROW) != ACROSS
    picture.sets.clear()
    picture.point(PRESS, x, COIL_ROW)
    picture.point(MOVE, x - 10, COIL_ROW)
    picture.point(MOVE, x - 20 * MM, COIL_ROW + 50)
    picture.draw()
    picture.point(RELEASE, x - 20 * MM, COIL_ROW)
    assert [phase for *_, phase in picture.sets] == [BEGIN, MOVED, MOVED, END]
    assert {k for k, *_ in picture.sets} == {number(symbol)}
    assert host.value(symbol) == pytest.approx(20, abs=0.02)
    picture.point(MOVE, 0, 0)
    picture.draw()
    assert picture.point(MOVE, x, COIL_ROW) != ACROSS, "it has moved in the picture"
    assert picture.point(MOVE, x - 20 * MM, COIL_ROW) == ACROSS
    picture.point(DOUBLE, x - 20 * MM, COIL_ROW)
    picture.point(MOVE, 0, 0)
    picture.draw()
    assert host.value(symbol) == 0 and np.array_equal(picture.pixels, before)
    picture.point(UP, x, COIL_ROW)
    assert host.value(f"pickup_{coil + 1}_height") > 0


def test_a_pickup_stays_within_its_room(host: Host, see: Make) -> None:
    """Between the neck's end and the bridge, and within the slider's range; the value shown is where it is."""
    picture = see(host)
    picture.turn_to(BENCH)
    for coil, x, end in ((0, COILS[0], 100), (1, COILS[1], WIDTH - 1)):
        symbol = f"pickup_{coil + 1}_place"
        host.set("pickup_place", -40.0 if coil else 60.0)
        picture.draw()
        at = x - host.value("pickup_place") * MM
        picture.point(PRESS, at, COIL_ROW)
        picture.point(MOVE, end, COIL_ROW)
        picture.point(RELEASE, end, COIL_ROW)
        host.play(RATE // 5)
        picture.draw()
        look = np.zeros(1, LOOK)
        assert library().lb_read_look(host.look, 0, look.ctypes.data)
        played = 1e3 * look["string"][0, 0]["saddle"][coil]
        shown = (c.c_char * 160)()
        library().host_text(host.address, number(symbol), host.value(symbol), shown, 160)
        assert shown.value.decode() == f"{played:.0f} mm from the bridge"
        assert abs(host.value(symbol)) < 60 and 0 < played < 300


def test_what_the_preset_says_has_one_word(host: Host, see: Make) -> None:
    """Whatever the parameter: in a value by name, in one with a unit, and in a change; texts are read back."""
    shown, value = (c.c_char * 160)(), c.c_double()
    names = "technique named_tuning cabinet limiter eq_low_mid_frequency drive bend_range eq_bass"
    for name in f"{names} fret_height pickup_place pickup_1_height".split():
        host.set(name, 0.0)
        library().host_text(host.address, number(name), 0.0, shown, 160)
        assert shown.value.split(b" ")[-1].strip(b"()") == b"preset", name
        assert library().lb_text_to_value(host.address, number(name), shown.value, c.byref(value)) and value.value == 0
    for name, older in (("technique", b"the bass's own"), ("named_tuning", b"as it is")):
        assert library().lb_text_to_value(host.address, number(name), older, c.byref(value)) and value.value == 0


@pytest.mark.parametrize(("size", "room"), [((WIDTH, HEIGHT), True), ((640, 320), False)])
def test_a_slider_that_stops_names_the_fret_and_the_string(
    host: Host, see: Make, size: tuple[int, int], room: bool
) -> None:
    """In place of the title, and above the string; the value is the last that can be played."""
    picture = see(host, size, optional=(*WHOLE, "stopped", "fault"))
    picture.turn_to(BENCH)
    before = picture.pixels.copy()
    host.set("action", -2.0)
    host.play(RATE // 10)
    assert -1.8 < host.value("action") < 0
    stop = library().lb_last_stop(host.address)
    assert (stop.count, stop.parameter) == (1, number("action"))
    assert stop.open in STRINGS[4] and 1 <= stop.fret <= 20 and 0 < stop.height < 0.1
    picture.draw()
    assert (picture.pixels != before)[12:34, 160:300].any()
    warned = picture.pixels[TOP : TOP + 16, :] & 0xFFFFFF == 0xFF6B57
    assert warned.any() == room
    picture.draw(seconds=15)
    assert not (picture.pixels & 0xFFFFFF == 0xFF6B57).any()


def test_a_changed_bass_leaves_nothing_out(picture: Picture, draw_look: Make) -> None:
    """After a pickup has moved, the picture is the one that a new window shows, names of strings and all."""
    look = made_look()
    look["string"]["saddle"] += 0.02
    picture.show(look)
    picture.draw()
    assert np.array_equal(picture.pixels, draw_look(look).pixels)


def test_the_smallest_window_cuts_nothing_off(draw_look: Make) -> None:
    """Every page ends above the lower edge."""
    picture = draw_look(made_look(), size=(640, 320))
    for page in range(4):
        picture.turn_to(page)
        assert len(np.unique(picture.pixels[-3:])) == 1, page


LAMPS = (  # by rows
    "Fingers,Pick,Thumb,Thumb on all,Pops on all,Down stroke,Up stroke",
    "Hammer-on,Slide,Vibrato,Tapping,Left-hand slap,Slide off down,Slide off up",
    "Palm mute,Ghost notes,Let ring,Stop on release,Stop all strings",
    "Harmonics,Artificial harmonics,Artificial 12ths,Artificial 15ths,Pinch harmonics",
)


@pytest.mark.parametrize(
    ("size", "first", "apart", "letters"), [((640, 320), 158, 17, 9.0), ((WIDTH, HEIGHT), 228, 26, 11.0)]
)
def test_lamps_stand_in_rows_by_what_they_do_and_have_room_for_their_names(
    draw_look: Make, size: tuple[int, int], first: int, apart: int, letters: float
) -> None:
    """In the smallest window, too."""
    picture = draw_look(made_look(), size=size)
    picture.turn_to(PLAY)
    for row, names in enumerate(LAMPS):
        over = np.array([picture.point(MOVE, x + 0.5, first + row * apart) == BY_HAND for x in range(size[0])])
        begin, end = (np.flatnonzero(np.diff(over.astype(int)) == step) for step in (1, -1))
        room = [library().lb_text_width(letters, name.encode()) + 6 for name in names.split(",")]  # with 3 on each side
        assert len(begin) == len(room) and (end - begin >= np.floor(room)).all(), names


def test_a_search_ends_with_the_first_found(host: Host, see: Make) -> None:
    """Return takes it, even before it is drawn; if nothing is found, it lists everything."""
    picture = see(host, optional=WHOLE)
    picture.press(*LISTED)
    assert picture.key("fretl\r") and host.value("bass") == 3 and not library().lb_wants_keys(picture.address)
    picture.press(*LISTED)
    everything = view_of(picture, 0, TOP, WIDTH, 150).copy()
    assert picture.key("xyzzy")
    picture.draw()
    assert (view_of(picture, 0, TOP, WIDTH, 150) != everything).sum() > 1000
    picture.key("\r")
    picture.draw()
    assert np.array_equal(view_of(picture, 0, TOP + 30, WIDTH, 120), everything[30:])


def test_the_list_marks_what_plays(host: Host, own: Path, see: Make) -> None:
    """A sound, or the bass; never both."""
    accent, first, sound = 0xFFF0A93B, TOP + 4 + 2 * 24 + 2, TOP + 4 + 7 * 24 + 2
    picture = see(host, optional=WHOLE)
    picture.turn_to(TONE)
    for saved in (False, True):
        assert not saved or host.save_sound()
        picture.press(*LISTED)
        assert [picture.pixels[y, 100] == accent for y in (first, sound)] == [not saved, saved]
        picture.press(*LISTED)


def test_many_choices_open_as_a_menu(host: Host, see: Make) -> None:
    """One press of the button shows them all; a press on one takes it."""
    picture = see(host)
    picture.press(60, 364)  # the stroke
    assert not picture.sets
    picture.point(PRESS, 70, 260)
    assert {k for k, *_ in picture.sets} == {TECHNIQUE}


def test_a_sound_has_the_name_that_is_typed(host: Host, own: Path, see: Make) -> None:
    """Its name, with * once it has changed, is the title; a search finds it; a second one of the name gets a number."""
    picture = see(host, optional=WHOLE)
    for wanted in ("Verse", "Verse 2"):
        picture.point(PRESS, 474, 23)
        assert picture.key("Verxx\b\bse\r")
        assert host.title() == wanted and (own / f"{wanted}.toml").exists()
    host.set("gain", -6.0)
    assert host.title() == "Verse 2 *"
    picture.point(PRESS, 136, 23)  # the one before
    assert host.title() == "Verse" and host.value("gain") == 0
    picture.draw()
    picture.press(*LISTED)
    assert picture.key("RSE 2") and library().lb_wants_keys(picture.address)
    picture.draw()
    picture.press(60, TOP + 4 + 2 * 24 + 11)
    assert host.title() == "Verse 2" and not library().lb_wants_keys(picture.address)


def test_a_is_copied_to_b(host: Host) -> None:
    host.set("gain", -6.0)
    library().lb_copy_side(host.address)
    library().lb_swap_sides(host.address)
    assert host.value("gain") == -6
    library().lb_undo(host.address)
    library().lb_undo(host.address)
    library().lb_swap_sides(host.address)
    assert host.value("gain") == 0, "the copy is undone"
