"""Names of recordings as people write them: dynamic, string, take."""

from __future__ import annotations

import itertools

import pytest

from livebass.lab.comparison.names import info_of_name, strength


@pytest.mark.parametrize(
    ("name", "dynamic"),
    [
        ("E1_soft1", "soft"), ("A1Hard2", "hard"), ("E1soft", "soft"),
        ("Bass 01 - A1 medium soft take 1", "medium soft"),
        ("e2-medium-hard", "medium hard"), ("g very hard", "very hard"), ("D2_med", "medium"), ("a loud 3", "hard"),
        ("soft_F", "soft"), ("Soft E1 P bass", "soft"), ("P-Bass E1 vel 100", "v100"), ("e1_vel_64", "v64"),
        ("e1 layer 2 rr 1", "v2"), ("a_f_rr1", "f"), ("f_p", "p"), ("a1_mf2", "mf"), ("E1", ""), ("a_mid_pickup", ""),
        ("hard/E1_soft", "soft"), ("E1_quiet", "soft"),
        ("bass_e1_vl4_rr1", "v4"), ("E1 vl 2", "v2"), ("E1_lay3", "v3"), ("e1lay2", "v2"), ("E1Forte", "f"),
        ("double-bass_A1_1_mezzo-forte_pizz-normal", "mf"), ("A1_mezzopiano", "mp"), ("fortissimo/E1", "ff"),
        ("piano/E1", "p"), ("Picked1#D1", ""),
        ("hard/E1", "hard"), ("v3/E1", "v3"), ("f/e1", ""), ("f/e1_p", "p"),
    ],
)  # fmt: skip
def test_a_name_tells_the_dynamic(name: str, dynamic: str) -> None:
    assert info_of_name(name.split("/")).dynamic == dynamic


def test_dynamics_are_in_order() -> None:
    order = ["pp", "very soft", "soft", "medium soft", "mp", "medium", "mf", "medium hard", "hard", "very hard", "ff"]
    assert all(strength(a) < strength(b) for a, b in itertools.pairwise([*order, "v1", "v20", "v100"]))


@pytest.mark.parametrize(
    ("name", "string"),
    [
        ("stringE_open_soft_take2", "E"), ("E string open soft 1", "E"), ("A string fret 5 hard", "A"),
        ("E-String_2", "E"), ("A1_strong", ""),
        ("string_D", "D"), ("estring_12", "E"), ("strG_v1", "G"), ("string Bb open", "Bb"), ("stringC#_open", "C#"),
        ("4th string hard", "4"), ("string 4 fret 7", "4"), ("string4", "4"), ("string open E1", ""), ("E1_soft", ""),
        ("B0 string 5", "B"), ("stringLow_open", "Low"), ("strings muted", ""), ("open string D", "D"),
    ],
)  # fmt: skip
def test_a_name_tells_the_string(name: str, string: str) -> None:
    assert info_of_name([name]).string == string


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("silence", "silence"),
        ("quiet", "silence"),
        ("Quiet 2", "silence"),
        ("E1 quiet", "note"),
        ("E1 rel2", "release"),
    ],
)
def test_a_quiet_note_is_no_silence(name: str, kind: str) -> None:
    assert info_of_name([name]).kind == kind


@pytest.mark.parametrize(
    ("name", "technique", "kind", "place"),
    [
        ("Picked1#D1", "pick", "note", "d1"), ("Picked1#F#1_2", "pick", "note", "f#1 2"),
        ("Fingered2#Bb0", "fingers", "note", "bb0"), ("Slap#C#1", "slap", "note", "c#1"),
        ("C#1_soft", "fingers", "note", "c#1"), ("E1_PM_v2", "mute", "note", "e1"), ("PM/E1_v1", "mute", "note", "e1"),
        ("E1_harm", "fingers", "other", "e1"), ("A1_pizz_ff", "fingers", "note", "a1"),
    ],
)  # fmt: skip
def test_a_name_of_a_public_library_tells_how_it_is_played(name: str, technique: str, kind: str, place: str) -> None:
    """As Rickenbacker 4001 (Picked1#D1), libraries for SFZ (vl1, PM, harm) and the Philharmonia (forte) write it."""
    info = info_of_name(name.split("/"))
    assert (info.technique, info.kind, info.place) == (technique, kind, place)


def test_takes_of_a_note_have_one_place() -> None:
    names = ("a_f_rr1", "a_f_rr2", "a f rr 3", "a f take 2", "a_f_alt", "a v100 rr1")
    assert {info_of_name([name]).place for name in names} == {"a"}
