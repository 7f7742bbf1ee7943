"""Remarks about a score, as codes with numbers: the shells have the sentences (livebass/score/sentences.py)."""

from livebass.compiling import SMALL, compiled
from livebass.kernels.score.memory import remarks_at

jit = compiled(attributes=SMALL)

# Codes of remarks, and their numbers; lower codes are the reader's
STRING_CHANNELS = 100  # first and last channel of one instrument with a channel a string
NOTE_CHANNELS = 101  # the same with a channel a note
PORTAMENTO = 102  # ignored messages
TUNING = 103  # ignored, cents; the concert pitch that it is, whole Hz and tenths
TUNINGS = 104  # number of ignored ones, the lowest and the highest, cents
SCALE_TUNING = 105
CALLED = 106  # a part that is called bass; remarks of several follow each other
ONLY_PART = 107  # the part
LOWEST_PART = 108  # the part
DOUBLES = 109  # track and channel that are left out, track and channel that have their notes
VARIANTS = 110  # number of variants of a style's bass
# Reasons for which a part plays or does not
NO_REASON, REQUESTED, OTHER_CHANNEL, A_TAKE, DRUMS, BASS_PROGRAM, NO_BASS_PROGRAM, CALLED_BASS, NOT_CALLED_BASS = range(
    9
)
CHANNEL_A_STRING, NOT_OF_INSTRUMENT, THE_ONLY_PART, LOW_PART, HIGHER_PART, NO_BASS, DOUBLE, OTHER_PART = range(9, 17)
OF_STYLE, NOT_OF_STYLE, UNLIKE = range(17, 20)


@jit
def add_remark(score, code, a, b, c, d):
    """Adds a remark with its numbers."""
    row = remarks_at(score.remarks, score.remarks_count + 1)[score.remarks_count]
    row.code = code
    row.numbers[:] = 0
    row.numbers[0], row.numbers[1], row.numbers[2], row.numbers[3] = a, b, c, d
    score.remarks_count += 1
