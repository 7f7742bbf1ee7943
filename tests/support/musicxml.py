"""Small scores in MusicXML, put together from texts."""

from __future__ import annotations

HEAD = '<score-partwise><part-list><score-part id="P"><part-name>Bass</part-name></score-part></part-list><part id="P">'


def tuned(*notes: str) -> str:
    """The tuning of a staff."""
    return "".join(
        f'<staff-tuning line="{line}"><tuning-step>{step}</tuning-step><tuning-octave>{octave}</tuning-octave>'
        "</staff-tuning>"
        for line, (step, octave) in enumerate(notes, 1)
    )


TUNING, HIGH = tuned("E1", "A1", "D2", "G2"), tuned("E2", "A2", "D3", "G3")


def direction(content: str) -> str:
    return f"<direction><direction-type>{content}</direction-type></direction>"


def plain(step: str, octave: int, length: int, more: str = "") -> str:
    """A note without a string."""
    return (
        f"<note>{more}<pitch><step>{step}</step><octave>{octave}</octave></pitch><duration>{length}</duration></note>"
    )


def scored(*measures: str, attributes: str = "") -> str:
    """A MusicXML part without tablature, two divisions in a quarter note."""
    first = f"<attributes><divisions>2</divisions>{attributes}</attributes>"
    bars = "".join(f"<measure>{first * (k == 0)}{each}</measure>" for k, each in enumerate(measures))
    return f"{HEAD}{bars}</part></score-partwise>"
