"""What kernels find in a file, in words: a sentence for each code, with {0}, {1} ... for its numbers.

The page has the same table. Of two sentences the first is for one name.
"""

from __future__ import annotations

from livebass.kernels.score import remarks as codes

NO_BASS = "no channel has a bass program, 33 to 40, and no track is called bass"
_CALLED = "no channel has a bass program, 33 to 40: plays the track"

CHOICE: dict[int, str | tuple[str, str]] = {
    codes.STRING_CHANNELS: "plays channels {0} to {1} as one instrument, a channel a string",
    codes.NOTE_CHANNELS: "plays channels {0} to {1} as one instrument, a channel a note",
    codes.PORTAMENTO: "ignored controller 5 (portamento time, {0} times): it bends only in takes of livebass",
    codes.TUNING: "ignored a master tuning of {0:+} cents (system exclusive); --a4 {1}.{2} tunes the bass so",
    codes.TUNINGS: "ignored {0} master tunings (system exclusive), {1:+} to {2:+} cents",
    codes.SCALE_TUNING: "ignored a tuning of single notes (system exclusive); --temperament tunes the bass",
    codes.CALLED: (f"{_CALLED} called {{0}}", f"{_CALLED}s called {{0}}"),  # names
    codes.ONLY_PART: f"{NO_BASS}: plays the only part, {{0}}",  # the part
    codes.LOWEST_PART: f"{NO_BASS}: plays the part that lies in a bass's range, {{0}}",
    codes.DOUBLES: "track {0} (channel {1}) doubles track {2} (channel {3}) and is left out",
}
REASONS: dict[int, str] = {
    codes.NO_REASON: "",
    codes.REQUESTED: "as asked for",
    codes.OTHER_CHANNEL: "not channel {0}",  # the one that was requested
    codes.OTHER_PART: "not the chosen part",
    codes.A_TAKE: "a take of livebass",
    codes.DRUMS: "drums",
    codes.BASS_PROGRAM: "bass program",
    codes.NO_BASS_PROGRAM: "no bass program",
    codes.CALLED_BASS: "called bass",
    codes.NOT_CALLED_BASS: "not called bass",
    codes.CHANNEL_A_STRING: "a channel a string, or MPE",
    codes.NOT_OF_INSTRUMENT: "no part of that instrument",
    codes.THE_ONLY_PART: "the only part",
    codes.LOW_PART: "in a bass's range, the lowest",
    codes.HIGHER_PART: "no program, but higher",
    codes.NO_BASS: "no bass program, not called bass",
    codes.DOUBLE: "doubles another part",
}
