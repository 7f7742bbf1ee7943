"""Chooses the bass parts of a MIDI file: one rule for everything that plays files.

`choose` takes what was requested: a channel, a part, all but drums; of a take, everything. Otherwise `choose_by_rule`
takes the first of these with any notes: the bass of a style; notes with a bass program of General MIDI; tracks called
bass; a zone without a program; the only part that is not drums; of several parts without programs, or with the program
"Bass + Lead", the lowest in a bass's range. Of two chosen parts with the same notes, as files make a fuller sound, one
plays.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, inlined
from livebass.kernels.machine.native import bytes_at, words_at
from livebass.kernels.score import memory, remarks
from livebass.kernels.score.programs import BASS_AND_LEAD, UNLIKE, is_bass_program
from livebass.kernels.score.smf import META_MARKER
from livebass.kernels.score.sorting import sort_by, twice_median
from livebass.kernels.score.spread import is_low
from livebass.kernels.score.styles import bass_channel, is_style
from livebass.kernels.score.times import frame_of

jit = compiled(attributes=SMALL)

AUTO, ALL, OF_CHANNEL, OF_PART = range(4)  # what to choose: by the rule, everything but drums, a channel or a part
# Notes of two parts are the same if they begin so close together; parts are, if so many of their notes are
TOGETHER, SAME, MINIMUM = 0.03, 0.9, 4  # s; fraction of notes; notes of a part that doubles another


@inlined
def all_notes_of(score):
    """The notes of all parts."""
    return memory.notes_at(score.all_notes, score.note_ons)


@jit
def group_notes(score):
    """Groups the notes by part, and finds which parts are drums."""
    notes, parts, start = all_notes_of(score), memory.parts_of(score), 0
    of_part = words_at(score.of_part, score.note_ons)
    for k in range(score.parts_count):
        parts[k].start, parts[k].filled, parts[k].drums = start, start, 1
        start += parts[k].notes
    for n in range(score.note_ons):
        part = parts[notes[n].part]
        if part.filled == part.start:
            part.first = n
        of_part[part.filled] = n
        part.filled += 1
        if notes[n].drums == 0:
            part.drums = 0


@jit
def choose(score, how, number):
    """Chooses notes: by the rule, all, those of channel `number` or of part `number`."""
    notes, parts = all_notes_of(score), memory.parts_of(score)
    score.remarks_count, score.alone, score.chosen = score.line_remarks, 0, 0
    for k in range(score.parts_count):
        parts[k].chosen, parts[k].double, parts[k].unlike = 0, memory.NONE, 0
    for n in range(score.note_ons):
        notes[n].chosen = 0
    if how == OF_CHANNEL:
        give_reasons(score, remarks.REQUESTED, remarks.OTHER_CHANNEL)
        choose_where(score, how, number)
    elif how == ALL:
        give_reasons(score, remarks.REQUESTED, remarks.DRUMS)
        choose_where(score, how, number)
    elif how == OF_PART:
        give_reasons(score, remarks.REQUESTED, remarks.OTHER_PART)
        choose_part(score, number)
        score.alone = 1 - score.take
    elif score.take == 1:
        give_reasons(score, remarks.A_TAKE, remarks.NO_REASON)
        choose_where(score, how, number)
    else:
        choose_by_rule(score)


@jit
def give_reasons(score, why, else_why):
    """Sets the reasons of the chosen parts and of the others."""
    score.why, score.else_why = why, else_why


@jit
def choose_note(score, note):
    """Chooses a note."""
    note.chosen = 1
    memory.parts_of(score)[note.part].chosen += 1
    score.chosen += 1


@jit
def choose_where(score, how, number):
    """Chooses a channel's notes, all but drums, or for AUTO all of a take."""
    notes, lines, parts = all_notes_of(score), memory.lines_of(score), memory.parts_of(score)
    for n in range(score.note_ons):
        channel = lines[parts[notes[n].part].line].channel
        if how == AUTO or (how == OF_CHANNEL and channel == number) or (how == ALL and notes[n].drums == 0):
            choose_note(score, notes[n])


@jit
def choose_part(score, k):
    """Chooses a whole part."""
    notes, part, of_part = all_notes_of(score), memory.parts_of(score)[k], words_at(score.of_part, score.note_ons)
    for n in range(part.start, part.filled):
        choose_note(score, notes[of_part[n]])


@jit
def choose_by_rule(score):
    """Chooses the bass parts."""
    notes = all_notes_of(score)
    if choose_style(score):
        return
    for n in range(score.note_ons):
        if notes[n].drums == 0 and is_bass_program(notes[n].program):
            choose_note(score, notes[n])
    if score.chosen > 0:
        give_reasons(score, remarks.BASS_PROGRAM, remarks.NO_BASS_PROGRAM)
        leave_doubles(score)
    elif choose_by_name(score):
        leave_doubles(score)
    elif not choose_zone(score):
        choose_by_place(score)


@jit
def choose_style(score):
    """Chooses the bass of a style, of its variants the first of each section; returns False if there is none."""
    if not is_style(score):
        return False
    notes, file = all_notes_of(score), memory.file_at(score.file)
    texts, section, text, n, maximum = memory.texts_at(file.text_rows, file.texts), memory.NONE, 0, 0, 0
    while n < score.note_ons:
        begin = frame_of_note(score, n)
        while text < file.texts and (texts[text].kind != META_MARKER or frame_of(score, texts[text].tick) <= begin):
            section = text if texts[text].kind == META_MARKER else section
            text += 1
        end = frame_of(score, texts[text].tick) if text < file.texts else score.end + 1
        after, sounding = n, np.int64(0)
        while after < score.note_ons and frame_of_note(score, after) < end:
            sounding |= np.int64(1) << channel_of_note(score, after)
            after += 1
        channel, variants = bass_channel(score, section, sounding)
        maximum = max(maximum, variants)
        for k in range(n, after):
            if channel_of_note(score, k) == channel:
                choose_note(score, notes[k])
        n = after
    give_reasons(score, remarks.OF_STYLE, remarks.NOT_OF_STYLE)
    if maximum > 1:
        remarks.add_remark(score, remarks.VARIANTS, maximum, 0, 0, 0)
    return score.chosen > 0


@jit
def frame_of_note(score, n):
    """The frame at which note `n` begins."""
    return memory.timed_at(score.clean, score.clean_count)[all_notes_of(score)[n].place].frame


@jit
def channel_of_note(score, n):
    """The channel of note `n` in the file."""
    return np.int64(memory.lines_of(score)[memory.parts_of(score)[all_notes_of(score)[n].part].line].channel)


@jit
def leave_doubles(score):
    """Leaves out parts whose notes another chosen part has, too."""
    parts, kept, doubles = memory.parts_of(score), 0, 0
    count = rank_parts(score)
    for k in range(count):
        own = parts[score.ranked[k]]
        for other in range(kept):
            if own.double == memory.NONE and has_notes(score, parts[score.ranked[other]], own):
                own.double = score.ranked[other]
        if own.double == memory.NONE:  # kept parts move to the front, those left out behind them
            kept_part = score.ranked[k]
            for j in range(k, kept, -1):
                score.ranked[j] = score.ranked[j - 1]
            score.ranked[kept] = kept_part
            kept += 1
        else:
            doubles += 1
    if doubles > 0:
        for _ in range(doubles):
            remark_double(score, kept, count)
        leave_notes(score)


@jit
def rank_parts(score):
    """Ranks the chosen parts outside the zone, most notes first; returns how many; 0: there are too many."""
    parts, lines, count = memory.parts_of(score), memory.lines_of(score), 0
    for k in range(score.parts_count):
        if parts[k].chosen == 0 or lines[parts[k].line].zone == 1:
            continue
        if count == memory.MAX_BASSES:
            return 0
        at = count
        while at > 0 and comes_before(parts[k], parts[score.ranked[at - 1]]):
            score.ranked[at] = score.ranked[at - 1]
            at -= 1
        score.ranked[at] = k
        count += 1
    return count


@jit
def comes_before(part, other):
    """True if a part has more notes; of two with as many, the one with the lower line or track."""
    if part.chosen != other.chosen:
        return part.chosen > other.chosen
    return part.line < other.line or (part.line == other.line and part.track < other.track)


@jit
def remark_double(score, first, count):
    """Remarks the next double among the ranked parts, by line and track, and takes it from the ranking."""
    parts, lines, minimum = memory.parts_of(score), memory.lines_of(score), np.int64(memory.NONE)
    for k in range(first, count):
        if score.ranked[k] != memory.NONE and (minimum == memory.NONE or is_earlier(score, k, minimum)):
            minimum = np.int64(k)
    part = parts[score.ranked[minimum]]
    other = parts[part.double]
    remarks.add_remark(
        score, remarks.DOUBLES, part.track, lines[part.line].channel, other.track, lines[other.line].channel,
    )  # fmt: skip
    score.ranked[minimum] = memory.NONE


@jit
def is_earlier(score, a, b):
    """True if ranked part `a` has a lower line or track than `b`."""
    part, other = memory.parts_of(score)[score.ranked[a]], memory.parts_of(score)[score.ranked[b]]
    return part.line < other.line or (part.line == other.line and part.track < other.track)


@jit
def leave_notes(score):
    """Leaves out the notes of doubles."""
    notes, parts = all_notes_of(score), memory.parts_of(score)
    for n in range(score.note_ons):
        if notes[n].chosen == 1 and parts[notes[n].part].double != memory.NONE:
            notes[n].chosen = 0
            score.chosen -= 1
    for k in range(score.parts_count):
        if parts[k].double != memory.NONE:
            parts[k].chosen = 0


@jit
def has_notes(score, part, other):
    """True if most chosen notes of `other` begin in `part`, too."""
    notes, rows, heads = all_notes_of(score), memory.timed_at(score.clean, score.clean_count), score.heads
    of_part, following = words_at(score.of_part, score.note_ons), words_at(score.words[3], score.note_ons)
    heads[:] = memory.NONE
    for k in range(part.filled - 1, part.start - 1, -1):
        note = notes[of_part[k]]
        if note.chosen == 1:
            following[of_part[k]] = heads[note.key]
            heads[note.key] = of_part[k]
    together, same = TOGETHER * score.rate, 0
    for k in range(other.start, other.filled):
        note = notes[of_part[k]]
        if note.chosen == 1:
            frame = rows[note.place].frame
            while heads[note.key] != memory.NONE and rows[notes[heads[note.key]].place].frame < frame - together:
                heads[note.key] = following[heads[note.key]]
            if heads[note.key] != memory.NONE and rows[notes[heads[note.key]].place].frame <= frame + together:
                same += 1
    return other.chosen >= MINIMUM and same >= SAME * other.chosen


@jit
def says_of(score, part):
    """Returns the bits of a part's name: its channel's, if the file names channels, or its track's."""
    own = memory.name_of(score, part.track, np.int64(memory.lines_of(score)[part.line].channel))
    return own if own & memory.NAMED != 0 else memory.name_of(score, part.track, memory.TRACK_NAME)


@jit
def is_called_bass(score, part):
    """True if a part is called bass: by its channel's name, or its track's, if it is alone there.

    A track with several instruments has the name of the piece.
    """
    own = memory.name_of(score, part.track, np.int64(memory.lines_of(score)[part.line].channel))
    if own & memory.NAMED != 0 and own & memory.IS_BASS != 0:
        return True
    instrument = memory.name_of(score, part.track, memory.TRACK_NAME) & memory.BASS_INSTRUMENT
    return is_alone(score, part.track) and (says_of(score, part) & memory.IS_BASS != 0 or instrument != 0)


@jit
def is_alone(score, track):
    """True if a track plays one line; a zone is one."""
    parts, lines, zone, others = memory.parts_of(score), memory.lines_of(score), 0, 0
    k = np.int64(memory.tracks_of(score)[track].first_part)
    while k != memory.NONE:
        if lines[parts[k].line].zone == 1:
            zone = 1
        else:
            others += 1
        k = np.int64(parts[k].next)
    return zone + others == 1


@jit
def choose_by_name(score):
    """Chooses the parts that are called bass; returns False if there are none.

    Voices, winds and drums are none beside another. "Bass + Lead", as tracks are also named by this program, is one by
    its height alone.
    """
    parts, unlike = memory.parts_of(score), 0
    for k in range(score.parts_count):
        if parts[k].drums == 0 and is_called_bass(score, parts[k]):
            if is_unlike(score, parts[k]):
                parts[k].unlike = 1
                unlike += 1
            elif not is_lead(score, parts[k]):
                choose_part(score, k)
    if score.chosen == 0 and unlike > 0:
        for k in range(score.parts_count):
            if parts[k].unlike == 1:
                choose_part(score, k)
    if score.chosen == 0:
        return False
    give_reasons(score, remarks.CALLED_BASS, remarks.NOT_CALLED_BASS)
    score.alone = 1
    remark_called(score)
    return True


@jit
def is_unlike(score, part):
    """True if all notes of a part have programs of voices, winds or drums."""
    notes, of_part = all_notes_of(score), words_at(score.of_part, score.note_ons)
    for n in range(part.start, part.filled):
        program = notes[of_part[n]].program
        if program == memory.NONE or UNLIKE[program] == 0:
            return False
    return True


@jit
def is_lead(score, part):
    """True if all notes of a part have the program "Bass + Lead", and it lies too high for a bass."""
    notes, of_part = all_notes_of(score), words_at(score.of_part, score.note_ons)
    for n in range(part.start, part.filled):
        if notes[of_part[n]].program != BASS_AND_LEAD:
            return False
    return not is_low_part(score, part)


@jit
def remark_called(score):
    """Remarks the chosen parts by track and first note."""
    parts, count, called = memory.parts_of(score), score.parts_count, 0
    order, spare = words_at(score.words[0], count), words_at(score.words[1], count)
    keys = words_at(score.words[2], count)
    for k in range(count):
        keys[k] = parts[k].first
        if parts[k].chosen > 0:
            order[called] = k
            called += 1
    sort_by(order, spare, keys, called)
    for k in range(count):
        keys[k] = parts[k].track
    sort_by(order, spare, keys, called)
    for k in range(called):
        remarks.add_remark(score, remarks.CALLED, order[k], 0, 0, 0)


@jit
def comes_later(part, other):
    """True if a part has a higher track than another, or the same and a later first note."""
    return part.track > other.track or (part.track == other.track and part.first > other.first)


@jit
def choose_zone(score):
    """Chooses the notes of the zone without a program; returns False if there are none."""
    notes, lines, parts = all_notes_of(score), memory.lines_of(score), memory.parts_of(score)
    for n in range(score.note_ons):
        if lines[parts[notes[n].part].line].zone == 1 and notes[n].program == memory.NONE:
            choose_note(score, notes[n])
    if score.chosen > 0:
        give_reasons(score, remarks.CHANNEL_A_STRING, remarks.NOT_OF_INSTRUMENT)
    return score.chosen > 0


@jit
def choose_by_place(score):
    """Chooses the only part that is not drums, or the lowest in a bass's range without a program, or "Bass + Lead"."""
    parts, melodic, only, lowest, middle = (
        memory.parts_of(score),
        0,
        np.int64(memory.NONE),
        np.int64(memory.NONE),
        np.int64(0),
    )
    for k in range(score.parts_count):
        if parts[k].drums == 1 or says_of(score, parts[k]) & memory.IS_DRUMS != 0:
            continue
        melodic += 1
        only = np.int64(k)
        if says_of(score, parts[k]) & memory.IS_OTHER == 0 and is_low_part(score, parts[k]):
            own = twice_median(score.counts, parts[k].notes)
            if lowest == memory.NONE or own < middle or (own == middle and comes_later(parts[lowest], parts[k])):
                lowest, middle = np.int64(k), own
    if melodic == 1:
        choose_whole(score, only, remarks.ONLY_PART)
        give_reasons(score, remarks.THE_ONLY_PART, remarks.DRUMS)
    elif lowest != memory.NONE:
        choose_whole(score, lowest, remarks.LOWEST_PART)
        give_reasons(score, remarks.LOW_PART, remarks.HIGHER_PART)
    else:
        give_reasons(score, remarks.NO_REASON, remarks.NO_BASS)


@jit
def choose_whole(score, k, remark):
    """Chooses a part without regard to others on its line, and says so."""
    choose_part(score, k)
    score.alone = 1
    remarks.add_remark(score, remark, k, 0, 0, 0)


@jit
def is_low_part(score, part):
    """True if notes without a program, or "Bass + Lead", lie where a bass plays; `counts` has them by key."""
    notes, of_part = all_notes_of(score), words_at(score.of_part, score.note_ons)
    score.counts[:] = 0
    for n in range(part.start, part.filled):
        note = notes[of_part[n]]
        if note.program not in (memory.NONE, BASS_AND_LEAD):
            return False
        score.counts[note.key] += 1
    return is_low(score.counts, part.notes)


@jit
def list_part(score, k, switches, listed):
    """Fills LISTED with part `k`; `switches`: address of 128 bytes, 1 for keys that are not notes; 0: none are."""
    notes, part, of_part = all_notes_of(score), memory.parts_of(score)[k], words_at(score.of_part, score.note_ons)
    line, is_switch = memory.lines_of(score)[part.line], bytes_at(switches, memory.KEYS)
    listed.port, listed.channel, listed.track, listed.drums = line.port, line.channel, part.track, part.drums
    listed.notes, listed.switches, listed.chosen, listed.lowest, listed.highest = 0, 0, 0, 0, 0
    listed.programs, listed.banks = 0, 0
    programs, banks = part.keys, part.programs  # of no more use: sets of those that are listed
    programs[:] = 0
    banks[:] = 0
    for n in range(part.start, part.filled):
        note = notes[of_part[n]]
        if note.bank != memory.NONE and not memory.has(banks, np.int64(note.bank)):
            memory.add_to(banks, np.int64(note.bank))
            listed.bank[listed.banks] = note.bank
            listed.banks += 1
        if switches != 0 and is_switch[note.key] == 1:
            listed.switches += 1
            continue
        if note.program != memory.NONE and not memory.has(programs, np.int64(note.program)):
            memory.add_to(programs, np.int64(note.program))
            listed.program[listed.programs] = note.program
            listed.programs += 1
        listed.lowest = min(listed.lowest, np.int64(note.key)) if listed.notes > 0 else np.int64(note.key)
        listed.highest = max(listed.highest, np.int64(note.key))
        listed.chosen += note.chosen
        listed.notes += 1
    listed.why = reason_of(score, part)


@jit
def reason_of(score, part):
    """Why a part plays, or does not."""
    if part.chosen > 0:
        return score.why
    if part.drums == 1:
        return np.int64(remarks.DRUMS)
    if part.unlike == 1:
        return np.int64(remarks.UNLIKE)
    return np.int64(remarks.DOUBLE) if part.double != memory.NONE else score.else_why
