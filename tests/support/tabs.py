"""Small tablatures: a notation for them, and writers of each format."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from livebass import Score, read_tab
from livebass.tab import model
from livebass.tab.model import NATURAL, Bar, Beat, Note, Tab, Tempo, Track
from livebass.tab.perform import Performance, perform

BASS = (28, 33, 38, 43)
BEAT = Fraction(1)
# The note value, dot and tuplet of a length in quarters; of several the plainest, which comes last
LENGTHS = {
    Fraction(4, value) * (Fraction(3, 2) if dotted else 1) * times / enters: (value, dotted, (enters, times))
    for value in (32, 16, 8, 4, 2, 1) for dotted in (True, False) for enters, times in ((3, 2), (1, 1))
}  # fmt: skip


def note(string: int, fret: int, **signs: Any) -> Note:
    return Note(string, fret, **signs)


def beats(*rows: Sequence[Note] | Note | None, length: Fraction = BEAT) -> list[Beat]:
    """Beats of one length: a note, notes, or None for a rest."""
    notes = [[] if row is None else [row] if isinstance(row, Note) else list(row) for row in rows]
    return [Beat(k * length, length, each) for k, each in enumerate(notes)]


def hard_tab() -> Tab:
    """Two bars of all hands: thumb, pop, hammer-on, slide, harmonic, dead note, bend and palm mute."""
    first = beats(note(0, 3, technique="slap"), note(3, 5, technique="pop"), note(1, 2, hammer=True), note(1, 4))
    bent = note(0, 5, bend=((Fraction(0), 0.0), (Fraction(1), 2.0)), palm=True)
    slide, natural = note(2, 5, slides=frozenset([model.LEGATO])), note(3, 12, harmonic=model.NATURAL, node=12.0)
    return tab(first, beats(slide, [note(2, 7), note(1, 3, dead=True)], natural, bent), bpm=240.0)


def hard_score(folder: Path) -> Score:
    """`hard_tab`, read at 48 kHz from a file in `folder`."""
    (song := folder / "song.gp").write_bytes(as_gp(hard_tab()))
    return read_tab(song, 48000)[1]


def tab(*bars: list[Beat], tuning: tuple[int, ...] = BASS, bpm: float = 120.0, **track: Any) -> Tab:
    """A piece with a bass in bars of 4/4."""
    whole = [Bar(Fraction(4)) for _ in bars]
    whole[0].tempos.append(Tempo(Fraction(0), bpm))
    made = Track("Bass", tuning, 0, 33, False, [[each] if each else [] for each in bars])
    return Tab(whole, [replace(made, **track)])


def play(piece: Tab) -> Performance:
    """The performance of the first track."""
    return perform(piece, piece.tracks[0])


# ---- Guitar Pro 5, by PyGuitarPro


def as_gp5(piece: Tab, version: tuple[int, int, int] = (5, 1, 0)) -> bytes:
    import guitarpro
    from guitarpro import models as gp

    song = gp.Song()
    song.tempo = round(piece.bars[0].tempos[0].bpm) if piece.bars[0].tempos else 120
    song.measureHeaders = [_header(gp, bar, number) for number, bar in enumerate(piece.bars, 1)]
    song.tracks = []
    for number, track in enumerate(piece.tracks, 1):
        strings = [gp.GuitarString(k, value) for k, value in enumerate(reversed(track.tuning), 1)]
        made = gp.Track(song, number, name=track.name, strings=strings, offset=track.capo)
        made.channel.instrument, made.channel.channel = track.program or 0, number - 1
        made.isPercussionTrack = track.drums
        made.measures = [gp.Measure(made, header) for header in song.measureHeaders]
        for measure, bar, voices in zip(made.measures, piece.bars, track.bars, strict=True):
            for voice, own in zip(measure.voices, voices or [[Beat(Fraction(0), bar.length, [])]], strict=False):
                voice.beats = [_gp_beat(gp, voice, beat, len(track.tuning), version) for beat in own]
                for tempo in bar.tempos:
                    place = next((k for k, beat in enumerate(own) if beat.at == tempo.at), None)
                    if place is not None and (tempo.at or bar is not piece.bars[0]):
                        change = gp.MixTableChange(tempo=gp.MixTableItem(round(tempo.bpm), int(tempo.over)))
                        voice.beats[place].effect.mixTableChange = change
        song.tracks.append(made)
    out = io.BytesIO()
    guitarpro.write(song, out, version=version)
    return out.getvalue()


def _header(gp: Any, bar: Bar, number: int) -> Any:
    header = gp.MeasureHeader(number)
    header.timeSignature = gp.TimeSignature(int(bar.length / bar.beat), gp.Duration(int(4 / bar.beat)))
    header.isRepeatOpen, header.repeatClose = bar.opens, bar.plays - 1 if bar.plays > 1 else -1
    header.repeatAlternative = sum(1 << n - 1 for n in bar.endings)
    header.tripletFeel = gp.TripletFeel.eighth if bar.swing else gp.TripletFeel.none
    for sign in bar.signs:
        name = gp.DirectionSign(" ".join("al" if word == "al" else word.title() for word in sign.split()))
        if sign.startswith("da "):
            header.fromDirection = name
        else:
            header.direction = name
    if bar.name:
        header.marker = gp.Marker(bar.name)
    return header


def _gp_length(gp: Any, length: Fraction) -> Any:
    value, dotted, (enters, times) = LENGTHS[length]
    return gp.Duration(value, dotted, tuplet=gp.Tuplet(enters, times))


def _gp_beat(gp: Any, voice: Any, beat: Beat, strings: int, version: tuple[int, ...]) -> Any:
    made = gp.Beat(voice, duration=_gp_length(gp, beat.length))
    made.status = gp.BeatStatus.normal if beat.notes else gp.BeatStatus.rest
    if beat.stroke:
        made.effect.pickStroke = gp.BeatStrokeDirection[beat.stroke]
    if beat.brush:
        way = gp.BeatStrokeDirection.down if beat.brush > 0 else gp.BeatStrokeDirection.up
        made.effect.stroke = gp.BeatStroke(way, int(4 / abs(beat.brush)))
    made.effect.fadeIn = "fade in" in beat.signs
    for each in beat.notes:
        own = gp.Note(made, each.fret, each.velocity, strings - each.string, type=gp.NoteType.normal)
        own.type = gp.NoteType.tie if each.tie else gp.NoteType.dead if each.dead else own.type
        made.notes.append(own)
        effect = own.effect
        effect.ghostNote, effect.hammer, effect.letRing = each.ghost, each.hammer, each.let_ring
        effect.staccato, effect.palmMute, effect.vibrato = each.staccato, each.palm, each.vibrato == 0.5
        effect.accentuatedNote, effect.heavyAccentuatedNote = each.accent == 1, each.accent == 2
        names = {"tap": "tapping", "slap": "slapping", "pop": "popping"}
        made.effect.vibrato = made.effect.vibrato or each.vibrato == 1.0
        if each.technique:
            made.effect.slapEffect = gp.SlapEffect[names[each.technique]]
        ways = {
            model.SHIFT: "shiftSlideTo", model.LEGATO: "legatoSlideTo", model.OUT_DOWN: "outDownwards",
            model.OUT_UP: "outUpwards", model.IN_BELOW: "intoFromBelow", model.IN_ABOVE: "intoFromAbove",
        }  # fmt: skip
        effect.slides = [gp.SlideType[ways[slide]] for slide in sorted(each.slides)]
        if each.bend:
            points = [gp.BendPoint(round(12 * x), round(2 * y)) for x, y in each.bend]
            effect.bend = gp.BendEffect(gp.BendType.bend, 100, points)
        if each.trill:
            effect.trill = gp.TrillEffect(each.trill[0], _gp_length(gp, each.trill[1]))
        if each.tremolo:
            effect.tremoloPicking = gp.TremoloPickingEffect(_gp_length(gp, each.tremolo))
        if each.harmonic == model.NATURAL:
            effect.harmonic = gp.NaturalHarmonic()
        elif each.harmonic:
            effect.harmonic = gp.ArtificialHarmonic(gp.PitchClass(0), gp.Octave.ottava)
        for grace in each.graces:
            way = gp.GraceEffectTransition[grace.joined or "none"]
            length = int(4 / grace.length)
            if version[0] < 5:  # where PyGuitarPro confuses these two
                way, length = gp.GraceEffectTransition(8 - length.bit_length()), 1 << 7 - way.value
            effect.grace = gp.GraceEffect(length, grace.fret, grace.dead, grace.on_beat, way)
    return made


# ---- Guitar Pro 6 and 7


def as_gpif(piece: Tab) -> bytes:
    """The XML of Guitar Pro 6 to 8."""
    tables: dict[str, list[str]] = {name: [] for name in ("Bars", "Voices", "Beats", "Notes", "Rhythms")}

    def put(table: str, content: str) -> int:
        tables[table].append(f'<{table[:-1]} id="{len(tables[table])}">{content}</{table[:-1]}>')
        return len(tables[table]) - 1

    rows: list[list[int]] = [[] for _ in piece.bars]
    tracks = []
    for track in piece.tracks:
        pitches, kind = " ".join(map(str, track.tuning)), "drumKit" if track.drums else "electricBass"
        tracks.append(
            f"<Track><Name>{track.name}</Name><InstrumentSet><Type>{kind}</Type></InstrumentSet><Sounds><Sound><MIDI>"
            f"<Program>{track.program or 0}</Program></MIDI></Sound></Sounds><Staves><Staff><Properties>"
            f'<Property name="Tuning"><Pitches>{pitches}</Pitches></Property>'
            f'<Property name="CapoFret"><Fret>{track.capo}</Fret></Property></Properties></Staff></Staves></Track>'
        )
        for row, voices in zip(rows, track.bars, strict=True):
            own = [put("Voices", f"<Beats>{' '.join(_gpif_beats(put, voice, track))}</Beats>") for voice in voices]
            row.append(put("Bars", f"<Voices>{' '.join(map(str, own)) or '-1'}</Voices>"))
    masters = "".join(
        f"<MasterBar>{_gpif_bar(bar, row)}</MasterBar>" for bar, row in zip(piece.bars, rows, strict=True)
    )
    automations = "".join(_gpif_tempos(piece))
    body = "".join(f"<{name}>{''.join(content)}</{name}>" for name, content in tables.items())
    return (
        f"<GPIF><MasterTrack><Automations>{automations}</Automations></MasterTrack><Tracks>{''.join(tracks)}</Tracks>"
        f"<MasterBars>{masters}</MasterBars>{body}</GPIF>"
    ).encode()


def _gpif_tempos(piece: Tab) -> list[str]:
    found = []
    for number, bar in enumerate(piece.bars):
        for tempo in bar.tempos:
            before = next((t.bpm for b in reversed(piece.bars[:number]) for t in reversed(b.tempos)), 120.0)
            rows = [(tempo.at, before, "true"), (tempo.at + tempo.over, tempo.bpm, "false")][0 if tempo.over else 1 :]
            for at, bpm, linear in rows:
                value = f"<Bar>{number}</Bar><Position>{float(at / bar.length)}</Position><Value>{bpm} 2</Value>"
                found.append(f"<Automation><Type>Tempo</Type><Linear>{linear}</Linear>{value}</Automation>")
    return found


def _gpif_bar(bar: Bar, bars: list[int]) -> str:
    text = f"<Time>{int(bar.length / bar.beat)}/{int(4 / bar.beat)}</Time><Bars>{' '.join(map(str, bars))}</Bars>"
    if bar.opens or bar.plays > 1:
        text += f'<Repeat start="{str(bar.opens).lower()}" end="{str(bar.plays > 1).lower()}" count="{bar.plays}"/>'
    if bar.endings:
        text += f"<AlternateEndings>{' '.join(map(str, sorted(bar.endings)))}</AlternateEndings>"
    names = {sign: "".join(word.title() for word in sign.split()) for sign in bar.signs}
    tags = {sign: "Jump" if sign.startswith("da ") else "Target" for sign in bar.signs}
    signs = "".join(f"<{tags[sign]}>{names[sign]}</{tags[sign]}>" for sign in bar.signs)
    text += f"<Directions>{signs}</Directions>" if signs else ""
    text += f"<Key><AccidentalCount>{bar.fifths}</AccidentalCount></Key>"
    text += "<TripletFeel>Triplet8th</TripletFeel>" if bar.swing else ""
    return text + (f"<Section><Text>{bar.name}</Text></Section>" if bar.name else "")


def _gpif_rhythm(length: Fraction) -> str:
    words = {1: "Whole", 2: "Half", 4: "Quarter", 8: "Eighth", 16: "16th", 32: "32nd"}
    value, dotted, (num, den) = LENGTHS[length]
    dot = '<AugmentationDot count="1"/>' if dotted else ""
    return f'<NoteValue>{words[value]}</NoteValue>{dot}<PrimaryTuplet num="{num}" den="{den}"/>'


def _gpif_beats(put: Callable[[str, str], int], voice: list[Beat], track: Track) -> list[str]:
    found = []
    for beat in voice:
        graces = [(each, grace) for each in beat.notes for grace in each.graces]
        for each, grace in graces:
            before = Note(each.string, grace.fret, dead=grace.dead, hammer=grace.joined == "hammer")
            before.slides = frozenset([model.SHIFT]) if grace.joined == "slide" else frozenset()
            kind = "OnBeat" if grace.on_beat else "BeforeBeat"
            found.append(_gpif_beat(put, Beat(beat.at, grace.length, [before]), track, kind))
        found.append(_gpif_beat(put, beat, track, ""))
    return found


def _gpif_beat(put: Callable[[str, str], int], beat: Beat, track: Track, grace: str) -> str:
    notes = [str(put("Notes", _gpif_note(each, track))) for each in beat.notes]
    dynamics = {each.velocity: model.DYNAMICS[(each.velocity - model.SOFTEST) // model.STEP] for each in beat.notes}
    text = f'<Rhythm ref="{put("Rhythms", _gpif_rhythm(beat.length))}"/>'
    text += "".join(f"<Dynamic>{name.upper()}</Dynamic>" for name in dynamics.values())
    text += f"<Notes>{' '.join(notes)}</Notes>" if notes else ""
    text += f"<GraceNotes>{grace}</GraceNotes>" if grace else ""
    text += "<Fadding>FadeIn</Fadding>" if "fade in" in beat.signs else ""
    hairpins = {"crescendo": "Crescendo", "diminuendo": "Decrescendo"}
    text += f"<Hairpin>{hairpins[beat.hairpin]}</Hairpin>" if beat.hairpin else ""
    properties = {"slap": "Slapped", "pop": "Popped"}
    own = "".join(
        f'<Property name="{properties[each.technique]}"><Enable/></Property>'
        for each in beat.notes
        if each.technique in properties
    )
    if beat.stroke:
        own += f'<Property name="PickStroke"><Direction>{beat.stroke.title()}</Direction></Property>'
    if beat.brush:
        own += f'<Property name="Brush"><Direction>{"Down" if beat.brush > 0 else "Up"}</Direction></Property>'
        ticks = int(480 * abs(beat.brush))
        text += f'<XProperties><XProperty id="687935489"><Int>{ticks}</Int></XProperty></XProperties>'
    for each in beat.notes:
        text += f"<Tremolo>{each.tremolo}</Tremolo>" if each.tremolo else ""
        own += '<Property name="VibratoWTremBar"><Strength>Wide</Strength></Property>' if each.vibrato == 1 else ""
    return str(put("Beats", f"{text}<Properties>{own}</Properties>"))


def _gpif_note(each: Note, track: Track) -> str:
    rows = {"String": f"<String>{each.string}</String>", "Fret": f"<Fret>{each.fret}</Fret>"}
    switches = (each.dead, "Muted"), (each.palm, "PalmMuted"), (each.hammer, "HopoOrigin")
    rows |= {name: "<Enable/>" for on, name in (*switches, (each.technique == "tap", "Tapped")) if on}
    if each.slides:
        bits = (model.SHIFT, model.LEGATO, model.OUT_DOWN, model.OUT_UP, model.IN_BELOW, model.IN_ABOVE, model.SCRAPE)
        rows["Slide"] = f"<Flags>{sum(1 << k for k, slide in enumerate(bits) if slide in each.slides)}</Flags>"
    if each.harmonic:
        rows["HarmonicType"] = f"<HType>{each.harmonic.title()}</HType>"
        rows["HarmonicFret"] = f"<HFret>{each.node}</HFret>"
    if each.bend:
        (begin, first), *middle, (end, last) = each.bend
        numbers = {"OriginOffset": 100 * begin, "OriginValue": 50 * first, "DestinationOffset": 100 * end,
                   "DestinationValue": 50 * last}  # fmt: skip
        for k, (at, height) in enumerate(middle, 1):
            numbers |= {f"MiddleOffset{k}": 100 * at, "MiddleValue": 50 * height}
        rows["Bended"] = "<Enable/>"
        rows |= {f"Bend{name}": f"<Float>{number}</Float>" for name, number in numbers.items()}
    text = "".join(f'<Property name="{name}">{content}</Property>' for name, content in rows.items())
    text = f"<Properties>{text}</Properties>"
    accent = each.staccato | {0: 0, 1: 8, 2: 4}[each.accent]
    text += f"<Accent>{accent}</Accent>" if accent else ""
    text += '<Tie origin="false" destination="true"/>' if each.tie else ""
    text += "<AntiAccent>Normal</AntiAccent>" if each.ghost else ""
    text += "<LetRing/>" if each.let_ring else ""
    text += "<Vibrato>Slight</Vibrato>" if each.vibrato == 0.5 else ""
    ornaments = {"mordent": "LowerMordent", "inverted mordent": "UpperMordent", "turn": "Turn",
                 "inverted turn": "InvertedTurn"}  # fmt: skip
    text += f"<Ornament>{ornaments[each.ornament]}</Ornament>" if each.ornament else ""
    if each.trill:
        text += f"<Trill>{track.tuning[each.string] + track.capo + each.trill[0]}</Trill>"
        ticks = int(480 * each.trill[1])
        text += f'<XProperties><XProperty id="688062467"><Int>{ticks}</Int></XProperty></XProperties>'
    return text


def as_gp(piece: Tab) -> bytes:
    """Guitar Pro 7: a zip archive."""
    return zip_files({"VERSION": b"7.0", "Content/score.gpif": as_gpif(piece)})


def zip_files(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()


def lock_archive(archive: bytes) -> bytes:
    """A zip archive whose files are marked as locked."""
    made = bytearray(archive)
    for head, flags in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        at = -1
        while (at := made.find(head, at + 1)) >= 0:
            made[at + flags] |= 1
    return bytes(made)


def as_gpx(piece: Tab) -> bytes:
    """Guitar Pro 6: sectors, packed as literal bytes."""
    content = as_gpif(piece)
    count = -(-len(content) // 4096)
    entry = struct.pack("<i127s", 2, b"score.gpif").ljust(0x8C, b"\0") + struct.pack("<ii", len(content), 0)
    entry += struct.pack(f"<{count + 1}i", *range(2, 2 + count), 0)
    sectors = bytes(4096) + entry.ljust(4096, b"\0") + content.ljust(4096 * count, b"\0")
    data = b"BCFS" + sectors
    bits = "".join(
        f"0{int(f'{len(part):02b}'[::-1], 2):02b}" + "".join(f"{byte:08b}" for byte in part)
        for part in (data[k : k + 3] for k in range(0, len(data), 3))
    )
    packed = int(bits.ljust(-(-len(bits) // 8) * 8, "0"), 2).to_bytes(-(-len(bits) // 8))
    return b"BCFZ" + struct.pack("<i", len(data)) + packed


# ---- MusicXML


def as_musicxml(piece: Tab) -> bytes:
    """MusicXML of what it can say: no slides from nowhere, and bends of the first and last height."""
    parts = "".join(
        f'<part id="P{k}">{"".join(_measure(piece, track, n) for n in range(len(piece.bars)))}</part>'
        for k, track in enumerate(piece.tracks)
    )
    names = "".join(
        f'<score-part id="P{k}"><part-name>{track.name}</part-name><midi-instrument id="I{k}"><midi-channel>'
        f"{10 if track.drums else 1}</midi-channel><midi-program>{(track.program or 0) + 1}</midi-program>"
        "</midi-instrument></score-part>"
        for k, track in enumerate(piece.tracks)
    )
    head = '<?xml version="1.0"?><!DOCTYPE score-partwise PUBLIC "-//Recordare//DTD MusicXML 4.0 Partwise//EN" "a.dtd">'
    return f'{head}<score-partwise version="4.0"><part-list>{names}</part-list>{parts}</score-partwise>'.encode()


DIVISIONS = 96
STOP, GHOST = '<tie type="stop"/>', '<notehead parentheses="yes">normal</notehead>'


def _measure(piece: Tab, track: Track, number: int) -> str:
    bar = piece.bars[number]
    text = f"<attributes><divisions>{DIVISIONS}</divisions>"
    text += f"<time><beats>{int(bar.length / bar.beat)}</beats><beat-type>{int(4 / bar.beat)}</beat-type></time>"
    if number == 0:
        lines = "".join(
            f'<staff-tuning line="{k}">{_pitch(value, "tuning-")}</staff-tuning>'
            for k, value in enumerate(track.tuning, 1)
        )
        capo = f"<capo>{track.capo}</capo>" if track.capo else ""
        text += f"<staff-details><staff-lines>{len(track.tuning)}</staff-lines>{lines}{capo}</staff-details>"
    text += f"<key><fifths>{bar.fifths}</fifths></key></attributes>"
    if bar.opens:
        text += '<barline location="left"><repeat direction="forward"/></barline>'
    if bar.endings:
        numbers = ",".join(map(str, sorted(bar.endings)))
        text += f'<barline location="left"><ending number="{numbers}" type="start"/></barline>'
    for sign in bar.signs:
        text += _direction(sign)
    if bar.name:
        text += f"<direction><direction-type><rehearsal>{bar.name}</rehearsal></direction-type></direction>"
    for tempo in bar.tempos:
        if tempo.at == 0:
            text += f'<direction><sound tempo="{tempo.bpm}"/></direction>'
    for k, voice in enumerate(track.bars[number]):
        if k:
            text += f"<backup><duration>{int(bar.length * DIVISIONS)}</duration></backup>"
        before = [beat for voices in track.bars[:number] for beat in voices[k] if beat.notes] if not k else []
        for beat in voice:
            text += _xml_force(beat, before[-1] if before else None) if not k else ""
            text += _xml_beat(beat, k + 1, track)
            before += [beat]
    end = f'<ending number="{",".join(map(str, sorted(bar.endings)))}" type="stop"/>' if bar.endings else ""
    end += f'<repeat direction="backward" times="{bar.plays}"/>' if bar.plays > 1 else ""
    return f'<measure number="{number + 1}">{text}{f"<barline>{end}</barline>" if end else ""}</measure>'


def _direction(sign: str) -> str:
    names = {"da capo": "dacapo", "da segno": "dalsegno", "da coda": "tocoda"}
    name = next((found for begin, found in names.items() if sign.startswith(begin)), sign)
    words = f"<direction-type><words>{sign}</words></direction-type>"
    return f'<direction>{words}<sound {name}="{"yes" if name == "dacapo" else "a"}"/></direction>'


def _pitch(value: int, prefix: str = "") -> str:
    step = "CCDDEFFGGAAB"[value % 12]
    alter = f"<{prefix}alter>1</{prefix}alter>" if value % 12 in (1, 3, 6, 8, 10) else ""
    return f"<{prefix}step>{step}</{prefix}step>{alter}<{prefix}octave>{value // 12 - 1}</{prefix}octave>"


def _xml_force(beat: Beat, before: Beat | None) -> str:
    """The dynamic and the hairpin that begin at a beat, and the end of the hairpin of the one before."""
    rows = []
    last = before.hairpin if before else ""
    if last and beat.hairpin != last:
        rows.append('<wedge type="stop"/>')
    if beat.hairpin and beat.hairpin != last:
        rows.append(f'<wedge type="{beat.hairpin}"/>')
    now, then = (each.notes[0].velocity if each and each.notes else model.FORTE for each in (beat, before))
    if beat.notes and now != then:
        rows.append(f"<dynamics><{model.DYNAMICS[(now - model.SOFTEST) // model.STEP]}/></dynamics>")
    return "".join(f"<direction><direction-type>{row}</direction-type></direction>" for row in rows)


def _xml_beat(beat: Beat, voice: int, track: Track) -> str:
    if not beat.notes:
        return f"<note><rest/><duration>{int(beat.length * DIVISIONS)}</duration><voice>{voice}</voice></note>"
    text = ""
    for each in beat.notes:
        for grace in each.graces:
            hammer, slide = ("".join(f'<{tag} type="start"/>' * (grace.joined == name)) for tag, name in (
                ("hammer-on", "hammer"), ("slide", "slide")))  # fmt: skip
            kind = {8: "eighth", 16: "16th", 32: "32nd"}[int(2 / grace.length)]
            head = "<notehead>x</notehead>" * grace.dead
            steal = ' steal-time-following="50"' * grace.on_beat
            text += (
                f"<note><grace{steal}/><voice>{voice}</voice><type>{kind}</type>{head}<notations>{slide}<technical>"
                f"<string>{len(track.tuning) - each.string}</string><fret>{grace.fret}</fret>{hammer}</technical>"
                "</notations></note>"
            )
    for k, each in enumerate(beat.notes):
        pitch = _pitch(track.tuning[each.string] + track.capo + each.fret)
        text += f"<note>{'<chord/>' * (k > 0)}<pitch>{pitch}</pitch>"
        text += f"<duration>{int(beat.length * DIVISIONS)}</duration>{STOP * each.tie}"
        text += f"<voice>{voice}</voice>{'<notehead>x</notehead>' * each.dead}"
        text += f"{GHOST * each.ghost}{_xml_notations(beat, each, track)}"
        text += f"{'<play><mute>palm</mute></play>' * each.palm}</note>"
    return text


def _xml_notations(beat: Beat, each: Note, track: Track) -> str:
    technical = f"<string>{len(track.tuning) - each.string}</string><fret>{each.fret}</fret>"
    technical += '<hammer-on type="start"/>' * each.hammer + "<tap/>" * (each.technique == "tap")
    technical += f"<other-technical>{each.technique}</other-technical>" * (each.technique in ("slap", "pop"))
    technical += f"<{beat.stroke}-bow/>" * bool(beat.stroke)
    if each.harmonic:
        technical += f"<harmonic><{each.harmonic}/></harmonic>"
    if each.bend:
        technical += f"<bend><bend-alter>{each.bend[-1][1]}</bend-alter></bend>"
    text = f"<technical>{technical}</technical>"
    names = {model.SHIFT: '<slide type="start"/>', model.LEGATO: '<slide type="start"/><slur type="start"/>'}
    text += "".join(names.get(slide, "") for slide in sorted(each.slides))
    text += '<tied type="let-ring"/>' * each.let_ring
    articulations = {"staccato": each.staccato, "accent": each.accent == 1, "strong-accent": each.accent == 2,
                     "scoop": model.IN_BELOW in each.slides, "plop": model.IN_ABOVE in each.slides,
                     "falloff": model.OUT_DOWN in each.slides, "doit": model.OUT_UP in each.slides}  # fmt: skip
    text += f"<articulations>{''.join(f'<{tag}/>' for tag, on in articulations.items() if on)}</articulations>"
    ornaments = '<wavy-line type="start"/>' * bool(each.vibrato) + "<trill-mark/>" * bool(each.trill)
    ornaments += f"<{each.ornament.replace(' ', '-')}/>" if each.ornament else ""
    if each.tremolo:
        ornaments += f'<tremolo type="single">{(1 / each.tremolo).numerator.bit_length() - 1}</tremolo>'
    text += f"<ornaments>{ornaments}</ornaments>"
    way = ' direction="down"' if beat.brush < 0 else ""
    text += f"<arpeggiate{way}/>" * bool(beat.brush)
    return f"<notations>{text}</notations>"


def as_mxl(piece: Tab) -> bytes:
    return zip_files({"META-INF/container.xml": b"<container/>", "song.xml": as_musicxml(piece)})


WRITERS: dict[str, Callable[[Tab], bytes]] = {
    "gp3": lambda piece: as_gp5(piece, (3, 0, 0)), "gp4": lambda piece: as_gp5(piece, (4, 0, 6)), "gp5": as_gp5,
    "gpx": as_gpx, "gp": as_gp, "musicxml": as_musicxml, "mxl": as_mxl,
}  # fmt: skip


def song() -> Tab:
    """Four bars; the second has a hammer-on, a pop and a harmonic."""
    signs = note(3, 7, technique="pop"), note(2, 12, harmonic=NATURAL, node=12.0)
    piece = tab(
        beats(note(0, 3), note(0, 5)), beats(note(1, 5, hammer=True), note(1, 7), *signs),
        beats(note(2, 5)), beats(note(0, 0)), tuning=(26, 33, 38, 43), bpm=240.0,
    )  # fmt: skip
    piece.bars[1].name = "Riff"
    return piece
