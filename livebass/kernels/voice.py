"""One string of the bass: turns events and motion into a signal.

`run` is a string's whole life: in each frame events, output, then one frame of motion. It allocates nothing and touches
only its arguments. [audio thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.hands import damping, fretting, noise, pulling, sliding, striking, thumb
from livebass.kernels.machine.elementary import exp
from livebass.kernels.machine.native import call_4, floats_at, record_address, record_at, records_at
from livebass.kernels.pickup import tone
from livebass.kernels.string import answers, draped, glide, modal, records, reports, runs, stop, tension, touch, turning
from livebass.kernels.string.operators import is_exact
from livebass.kernels.string.slot import REST_EVERY, allow_exchange, is_touched, remove_thumb, rest_slot, until_rest

CUT_RATE = 900.0  # 1/s, for all-sound-off
DEEPEST = 8e-3  # m: a string cannot dip farther into a magnet's field
INAUDIBLE = 1e-9  # signal of a string at rest below which the filters' memory counts as silence


string_at, operators_at, events_at = record_at(records.STRING), records_at(records.OPERATOR), records_at(records.EVENT)


@entry("int64(int64, int64, int64, int64, int64, int64, int64, int64)")
def run_string(string, ops, frets, events, count, out, across, frames):
    """C function: `run` for addresses; `frets` + 1 operators; `across` 0: no v."""
    return run(
        string_at(string), operators_at(ops, frets + 1), events_at(events, count), count, floats_at(out, frames),
        floats_at(across, frames if across != 0 else 0),
    )  # fmt: skip


@jit
def run(string, ops, events, count, out, across):
    """Plays out.shape[0] frames of `string` (STRING) with the operators `ops` (OPERATOR, one per fret).

    `events[:count]` are this string's (EVENT), by frame, none before voice.frame. With voice.raw `out` receives u (m)
    and `across`, as long or empty, v. Returns the number of events used.
    """
    voice = string.voice
    taps = string.taps
    used = 0
    i = 0
    held = np.int64(0)  # frames waiting for the filters
    while i < out.shape[0]:
        if used < count and events[used].frame <= voice.frame:
            held = filter_batch(string, out, i, held)
            runs.stop(string, ops)
        while used < count and events[used].frame <= voice.frame:
            reports.remember(voice, events[used])
            handle_event(string, ops, events[used])
            used += 1
        if voice.still:
            held = filter_batch(string, out, i, held)
            end = voice.frame + out.shape[0] - i
            if used < count:
                end = min(end, events[used].frame)
            i = write_silence(string, out, i, end)
            continue
        if voice.ends_in > 0:
            voice.ends_in -= 1
            if voice.ends_in == 0:
                damping.end_note(string, ops, voice.ends_by)
        if voice.slide_to >= 0:
            sliding.follow_slide(string, ops)
        if voice.landing > 0:
            fretting.follow_hammer(string, ops)
        if voice.tuned != voice.bend and (voice.frame + voice.turn) % sliding.BEND_FRAMES == 0:
            sliding.follow_bend(string, ops)
        if voice.tone != voice.tone_wanted and voice.frame % tone.FRAMES == 0:
            held = filter_batch(string, out, i, held)
            tone.follow_tone(voice)
        if voice.blend != voice.blend_wanted:
            held = filter_batch(string, out, i, held)
            tone.follow_blend(voice)
        if voice.left == 0:
            frames = runs.frames_ahead(string, ops)
            if frames > 0:
                runs.begin(string, ops, frames)
        runs_on = voice.left > 0
        if is_undisturbed(voice) and (runs_on or is_idle(string)):
            frames = min(records.BATCH - held, out.shape[0] - i, voice.left if runs_on else until_rest(voice))
            if used < count:
                frames = min(frames, events[used].frame - voice.frame)
            held = hold_run(string, held, frames) if runs_on else hold_answers(string, held, frames)
            i += frames
            if held == records.BATCH or until_rest(voice) == frames:
                held = filter_batch(string, out, i, held)
            if runs_on:
                runs.pass_frames(string, ops, frames)
            else:
                skip_to(voice, voice.frame + frames)
            rest_in_time(string, ops)
            continue
        if runs_on:
            runs.read_sample(voice, taps)
        else:
            slot = string.slots[voice.slot]
            if slot.on:
                pulling.excite(voice, slot, glide.current_operator(string, ops, voice.slot))
            sense_string(string, ops, taps)
        noise.hear_hands(voice, taps)
        if voice.raw:
            out[i] = taps[0]
            if i < across.shape[0]:
                across[i] = taps[1]
            if voice.answering:
                answers.next_answer(string)
        else:
            held = hold_sample(string, held)
            if held == records.BATCH or until_rest(voice) == 1:
                held = filter_batch(string, out, i + 1, held)
        if runs_on:
            runs.pass_frames(string, ops, 1)
        else:
            move_string(string, ops)
        rest_in_time(string, ops)
        i += 1
    filter_batch(string, out, i, held)
    return used


@jit
def is_undisturbed(voice):
    """True if nothing but events changes a run's sound from frame to frame: no noise, and no pot that turns."""
    turns = voice.tone != voice.tone_wanted or voice.blend != voice.blend_wanted
    return not (turns or voice.raw or noise.is_noisy(voice))


@jit
def write_silence(string, out, i, end):
    """Writes a still string's silence to out[i:], up to frame `end`; returns the next index."""
    voice = string.voice
    x = filter_sample(voice, 0.0)
    until = i + end - voice.frame
    for k in range(i, until):
        out[k] = x
    skip_to(voice, end)
    return until


@jit
def skip_to(voice, end):
    """Moves a still string's clock to frame `end`."""
    voice.frame = end
    voice.step = end * voice.numerator
    if voice.denominator > 1:
        voice.step = -(-voice.step // voice.denominator)


@jit
def note_stillness(string):
    """Marks the string at rest as still if its output is constant until the next event.

    It is once its filters hold only zeros that are all REST_EVERY frames old.
    """
    voice = string.voice
    held = abs(voice.block_in) + abs(voice.block_out)
    for i in range(3):
        held += abs(voice.z[i])
    gain = voice.gain + voice.gain_pole * (voice.gain_wanted - voice.gain)
    tuned = (
        voice.tuned == voice.bend
        and voice.tone == voice.tone_wanted
        and voice.blend == voice.blend_wanted
        and gain == voice.gain
    )
    quiet = voice.pulling == 0 and voice.landing == 0 and voice.ends_in == 0 and held == 0.0 and not voice.raw
    voice.still = np.int64(1 if quiet and tuned else 0)
    if voice.still:
        voice.depth = 0.0  # a vibrato restarts with the next note


@jit
def at_rest(string):
    """True if the string is inaudible or its signal is NaN: values may then jump."""
    moves = string.slots[0].on or string.slots[1].on or string.voice.answering or noise.is_noisy(string.voice)
    return not moves or not abs(string.voice.block_out) < np.inf


@jit
def handle_event(string, ops, event):
    """Performs one event on the string."""
    voice, slots = string.voice, string.slots
    begins = event.kind in (records.PLUCK, records.STRIKE_EVENT, records.THROW, records.HAMMER)
    if voice.still or (begins and at_rest(string)):
        voice.woken = voice.frame
    voice.still = 0
    if begins:
        voice.cut = 0
        voice.ends_in = 0
        noise.keep_finger(voice)
    if event.kind == records.PLUCK:
        striking.begin_pluck(string, ops, event)
    elif event.kind == records.STRIKE_EVENT:
        striking.begin_strike(string, ops, event)
    elif event.kind == records.THROW:
        striking.throw_mass(string, ops, event)
    elif event.kind == records.HAND and voice.waiting > 0:
        voice.ends_in = voice.wait  # as late as the stroke
        voice.ends_by = event.value
    elif event.kind == records.HAND:
        damping.end_note(string, ops, event.value)
    elif event.kind == records.HAMMER:
        fretting.hammer_on(string, ops, event)
    elif event.kind == records.PULL_OFF:
        fretting.pull_off(string, ops, event)
    elif event.kind == records.GLIDE:
        sliding.begin_slide(string, ops, event.fret, event.seconds)
    elif event.kind == records.TIMED_GLIDE:
        sliding.begin_timed_slide(string, ops, event)
    elif event.kind == records.WAVER:
        sliding.set_vibrato(voice, event.value, event.rate)
    elif event.kind == records.TOUCH_EVENT:
        damping.lay_finger(string, ops, event)
    elif event.kind == records.RUBBING:
        noise.begin_rub(voice, event)
    elif event.kind == records.IDLE:
        voice.idle = np.int64(event.value)
    elif event.kind == records.BEND:
        voice.bend = event.value
        if at_rest(string):
            voice.tuned = voice.bend
    elif event.kind == records.GAIN:
        voice.gain_wanted = event.value
        if at_rest(string):
            voice.gain = event.value
    elif event.kind == records.TONE:
        voice.tone_wanted = event.value
        if at_rest(string):
            tone.set_tone(voice, event.value)
    elif event.kind == records.BLEND:
        voice.blend_wanted = event.value
        if at_rest(string):
            tone.set_blend(voice, event.value)
    elif event.kind == records.CUT:
        if not slots[voice.slot].between:
            voice.slide_to = -1
        pulling.end_pull(string, ops)
        voice.striking = 0
        voice.ends_in = 0
        voice.cut = 1
        noise.end_rub(voice)
        for k in range(2):
            remove_thumb(slots[k])
            slots[k].hand = min(slots[k].hand, exp(-CUT_RATE / voice.rate))


@jit
def sense_string(string, ops, y):
    """Fills y with this frame's sensed motion: both slots and the held shape together.

    Displacement and velocity at each pickup; without pickups, only the displacement.
    """
    voice = string.voice
    for i in range(2 * max(voice.pickups, 1)):
        y[i] = 0.0
    for k in range(2):
        slot = string.slots[k]
        if slot.on:
            op = glide.current_operator(string, ops, k)
            sense_slot(voice, op, slot, y)
            if slot.moving or slot.offset != 0.0:
                sense_end(voice, op, slot, y)
    if noise.is_pulling(voice):
        up, moving = pulling.pull_profile(voice, voice.pulling)
        if voice.pickups == 0:
            y[0] += up * voice.held[0]
            y[1] += up * voice.held_across[0]
        for i in range(voice.pickups):
            y[2 * i] += up * voice.held[i]
            y[2 * i + 1] += moving * (voice.held[i] + voice.across[i] * voice.held_across[i])


@jit
def sense_end(voice, op, slot, y):
    """Adds the sensed part of the line from the moving stop to the saddle.

    Displacement counts from the line that the string rests on, which differs at each fret: the step between two lines
    is spread over milliseconds.
    """
    for i in range(voice.pickups):
        part = voice.saddle[i] / op.length
        y[2 * i] += part * (slot.stop_u.place + slot.offset)
        y[2 * i + 1] += part * (slot.stop_u.speed + voice.across[i] * slot.stop_v.speed)
    if voice.pickups == 0:
        y[0] += voice.saddle[0] / op.length * (slot.stop_u.place + slot.offset)
        y[1] += voice.saddle[1] / op.length * slot.stop_v.place


@jit
def sense_slot(voice, op, slot, y):
    """Adds the sensed motion of a slot's modes; v adds to the velocities, or is a displacement at its own sensor."""
    u, v = slot.u, slot.v
    n, n_v = min(slot.active, slot.heard), min(slot.v_active, slot.heard)
    if voice.pickups == 0:
        later = voice.frame % voice.denominator if voice.denominator > 1 else 0
        y[0] += modal.read_tap(u, n, op, (2 * later, 2 * later + 1))
        if n_v > 0:
            row = 2 * (voice.denominator + later)
            y[1] += modal.read_tap(v, n_v, op, (row, row + 1))
    i = 0
    while i + 1 < voice.pickups:
        if n_v > 0:
            heard = voice.across[i], voice.across[i + 1]
            here, moving, there, moving_there = modal.sense_2_of_both(u, v, max(n, n_v), op, (i, i + 1), heard)
        else:
            here, moving, there, moving_there = modal.sense_2(u, n, op, (i, i + 1))
        y[2 * i] += here
        y[2 * i + 1] += moving
        y[2 * i + 2] += there
        y[2 * i + 3] += moving_there
        i += 2
    if i < voice.pickups:
        if n_v > 0:
            here, moving = modal.sense_1_of_both(u, v, max(n, n_v), op, i, voice.across[i])
        else:
            here, moving = modal.sense_1(u, n, op, i)
        y[2 * i] += here
        y[2 * i + 1] += moving


@jit
def hold_sample(string, held):
    """Adds this frame's taps to the batch of `held` frames; returns the new number of frames."""
    voice = string.voice
    for k in range(2 * max(voice.pickups, 1)):
        string.batch[k, held] = string.taps[k]
    string.answer[held] = answers.next_answer(string) if voice.answering else 0.0
    return held + 1


@jit
def is_idle(string):
    """True if the string itself rests, and no hand is about to move it; others may make it answer."""
    voice, slots = string.voice, string.slots
    waits = voice.pulling + voice.landing + voice.ends_in + slots[0].on + slots[1].on
    return waits == 0 and voice.slide_to < 0 and voice.tuned == voice.bend


@jit
def hold_answers(string, held, frames):
    """`hold_sample` for so many `frames` of an idle string at once, and all else that moves it."""
    voice = string.voice
    for k in range(2 * max(voice.pickups, 1)):
        row = string.batch[k]
        for n in range(frames):
            row[held + n] = 0.0
    for n in range(held, held + frames):
        string.answer[n] = 0.0
        if voice.answering:
            string.answer[n] = answers.next_answer(string)
            answers.pass_on(string, voice.frame, 1)
        voice.frame += 1
    voice.frame -= frames
    return held + frames


@jit
def hold_run(string, held, frames):
    """`hold_sample` for so many `frames` of a run at once."""
    voice = string.voice
    first = voice.length - voice.left
    for k in range(2 * voice.pickups):
        row, run = string.batch[k], voice.run[k]
        for n in range(frames):
            row[held + n] = run[first + n]
    for n in range(frames):
        string.answer[held + n] = 0.0
    if voice.answering:
        for n in range(frames):
            string.answer[held + n] = answers.next_answer(string)
            voice.frame += 1  # until when hands mute the answers
        voice.frame -= frames
    return held + frames


@jit
def filter_batch(string, out, end, held):
    """Writes the `held` samples of the batch to `out`, up to index `end`; returns the new number held: 0.

    Batching changes no sample; it cuts the time of the exponentials to a quarter.
    """
    voice, x, flux = string.voice, string.mixed, string.flux
    x[:held] = 0.0
    if voice.pickups == 0:
        for k in range(held):
            x[k] = string.batch[0, k] + voice.across[0] * string.batch[1, k]
    for i in range(voice.pickups):
        for k in range(held):  # the flux gradient falls exponentially with the distance between string and magnet
            flux[k] = -voice.decay[i] * max(string.batch[2 * i, k], -DEEPEST)
        for k in range(held):
            flux[k] = exp(flux[k])
        for k in range(held):
            x[k] += voice.mix[i] * flux[k] * string.batch[2 * i + 1, k]
    for k in range(held):
        if string.answer[k] != 0.0:
            x[k] += string.answer[k]
        out[end - held + k] = filter_sample(voice, x[k])
    return np.int64(0)


@jit
def filter_sample(voice, x):
    """Filters one sample of the pickup mix: coil and tone circuit, DC blocker, volume."""
    out = voice.b[0] * x + voice.z[0]
    voice.z[0] = voice.b[1] * x - voice.a[1] * out + voice.z[1]
    voice.z[1] = voice.b[2] * x - voice.a[2] * out + voice.z[2]
    voice.z[2] = voice.b[3] * x - voice.a[3] * out
    high = out - voice.block_in + voice.block * voice.block_out
    voice.block_in = out
    voice.block_out = high
    voice.gain += voice.gain_pole * (voice.gain_wanted - voice.gain)
    return high * voice.gain


@jit
def flush_filters(voice):
    """Flushes the filters to zero once their memory is inaudible or NaN."""
    maximum = abs(voice.block_in) + abs(voice.block_out)
    for i in range(3):
        maximum += abs(voice.z[i])
    if maximum < INAUDIBLE or not maximum < np.inf:
        voice.block_in = 0.0
        voice.block_out = 0.0
        voice.z[:3] = 0.0


@jit
def move_string(string, ops):
    """Moves both slots by one frame.

    C functions, called by address, handle frames with possible contact: they are compiled once, not inlined into every
    caller, and the one for boards only if there is a board.
    """
    voice = string.voice
    after = (voice.frame + 1) * voice.numerator
    if voice.denominator > 1:
        after = -(-after // voice.denominator)  # rounded up: a tap may look back, not ahead
    steps = after - voice.step
    tighter, own_due = 0.0, False
    if sliding.is_vibrating(voice):
        tighter = sliding.vibrato_tension(voice, string.slots[voice.slot])
    for k in range(2):
        slot = string.slots[k]
        if not slot.on:
            continue
        op = glide.current_operator(string, ops, k)
        leap = records.LONGER if steps > op.steps else records.WHOLE
        if slot.thumb.on != records.NONE:
            thumb.press_on(slot, op, voice, steps, leap)
        if slot.active == 0 or op.points == 0 or slot.moving or after <= slot.quiet or after <= slot.due:
            modal.leap_fading(slot.u, slot.active, leap, slot.hand)
            modal.leap_fading(slot.v, slot.v_active, leap, slot.hand)
        else:
            over = voice.over_board if op.points > records.MAX_NEAR else voice.over_frets
            call_4(over, record_address(string), np.int64(k), record_address(op), steps)
            if slot.hand < 1.0:
                draped.leave_rest(slot, op)
                modal.scale(slot.u, slot.active, slot.hand)
                modal.scale(slot.v, slot.v_active, slot.hand)
                draped.return_to_rest(slot, op)
        if slot.thumb.on != records.NONE:
            thumb.take_off(slot, op, after)
        if slot.offset != 0.0:
            stop.fade_offset(slot, voice.rate)
        if slot.between:
            glide.advance_ends(slot, steps * op.fine)
        elif slot.moving:
            stop.advance_stop(slot, op, steps * op.fine, after)
        elif slot.sunk > 0:
            stop.raise_obstacles(slot, op, after)
        due = turning.count_frame(slot)
        own_due = own_due or (due and k == voice.slot)
        from_rest = op.draped and not slot.moving and is_touched(voice)
        if from_rest:
            draped.leave_rest(slot, op)
        touch.touch_string(voice, slot, op, due)
        if from_rest:
            draped.return_to_rest(slot, op)
        if voice.stretch > 0.0 and slot.active > 0 and not slot.steady:
            tension.tighten_by_motion(voice, slot, op, steps * op.fine)
        if tighter != 0.0:
            tension.tighten_by_vibrato(slot, op, steps * op.fine, tighter)
        if op.turned > 0:
            turning.exchange(voice, slot, op, after, due)
    if voice.idle != 0:
        answers.excite_answers(string, ops, after, voice.frame + 1, records.QUARTET if own_due else 0)
    voice.step = after
    voice.frame += 1


@jit
def rest_in_time(string, ops):
    """Every REST_EVERY frames, drops what is dead, and marks a string at rest as still."""
    voice = string.voice
    if until_rest(voice) == REST_EVERY:
        answers.drop_dead_answers(string)
        for k in range(2):
            slot = string.slots[k]
            working = voice.pulling > 0 or voice.striking > 0 or voice.landing > 0
            busy = slot.thumb.on != records.NONE or (k == voice.slot and working)
            op = glide.current_operator(string, ops, k)
            if slot.on and not busy:
                rest_slot(slot, op, voice)
            elif slot.on and op.turned > 0:
                allow_exchange(slot, op)
            if slot.on and not is_exact(op):
                slot.fourth = 0  # from here on quartets end with rests, so that long runs fit in between
        if at_rest(string):
            note_stillness(string)  # first: only zeros have gone through the filters since they were flushed
            flush_filters(voice)
