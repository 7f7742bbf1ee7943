"""Track names: decodes their bytes, in any encoding, and tells whether they name a bass or drums.

The page uses the same patterns. They match alike in Python and JavaScript: `\\w` stands only where a letter that
JavaScript does not count may just as well end the word, and `\\W` nowhere.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence

# "Bass", "E-Bass", "bass 2", "BassGtr", "Contrabbasso", "FINGERED BS", and names in other languages
BASS_WORD = "|".join(
    (
        r"bass(?:es|[eio]|lines?|guit\w*|git\w*|gtr?|ist[ae]?|okitara|zus\w*)?(?![a-z])",
        r"(?<![a-z])(?:contra|kontra|el|e)?(?:bas|bajo|baixo)s?(?:[gģ]\w*|ov[aáeé]?|ow[aey])?(?![a-z])",
        r"(?<![a-z])(?:bs|bss|bsgtr?|b\.\s?g(?:ui)?ta?r)(?![a-z])",
        r"(?<![a-z])(?:baix|baxua?|bosas|bosin(?:is|[eė])|(?:elektro)?baso|basovska)(?![a-z])|bass?(?:o?syn|kita)",
        r"[ck]ontr[ae]?bb?(?:[aäo]s|ax|aix)|(?:dobbelt|dubbel)bas(?![a-z])|b[őö]g[őö]",
        r"(?<![a-z])fretless(?![a-z])",
        r"(?<![а-яёії])(?:контра|суб|синт|электро)?бас(?:[\s_.-]?г[иі]тар[а-яії]*|ов[а-яії]*\sг[иі]тар[а-яії]*)?(?![а-яёії])",
        r"контрабас|μπ[άα]σ[οσ]|באס|(?<![א-ת])(?:קונטר)?בס(?![א-ת])|بيس|بیس|کنترباس|ベース|ベイス|コントラバス|贝斯|貝斯|贝司|貝司",
        "低音(?:電子)?[吉結]他|低音大?提琴|倍大提琴|베이스|เบส",
    )
)
# Instruments and voices whose low member is called bass, too, but is not one
OTHER_WORD = (
    r"drum|kick|bassoon|basson(?![a-z])|fagot|clarin|klarin|clarone|trom(?!os)|tbn|posaun|fl[uû]|flaut|flöt|sax|tuba|oboe|hautb|recorder|horn|cor[\s_.,'()/&+-]|gamb"
    r"|viol|marimba|harmonica|vo[ciz]|voix|(?<![a-z])sing(?:er|in|en)|chor(?!us|d)|choir|(?<![a-z])coro(?![a-z])|accord|кларн|бараб|тромб|флейт|саксо|голос"
    r"|ドラム|クラリネット|トロンボーン|鼓|드럼|클라리넷"
)
DRUM_WORD = (
    r"drum|perc|kick|snare|cymbal|hi-?hat|(?<![a-z])(?:kit|hats?|toms?|batt?erie|bater[ií]a|schlagzeug|slagwerk)(?![a-z])"
    r"|удар|бараб|ドラム|鼓|드럼"
)
# Tracks of charts for music games, whose keys are buttons
GAME_TRACK = r"PART (?:REAL_)?(?:BASS|GUITAR|DRUMS|KEYS|VOCALS|RHYTHM)(?:[ _].*)?|EVENTS|BEAT|T1 GEMS"
MIN_GAME = 2  # tracks that tell such a chart
GAME_REFUSAL = "is a chart for a music game, which has buttons, not notes"
# Words that tell the encoding of a name
TELLING_WORD = (
    "ピアノ|ギター|ドラム|メロディ|トラック|ボーカル|ストリングス|音轨|音軌|钢琴|鋼琴|吉他|架子鼓|旋律|主音|鼓组"
    "|пианино|фортепиано|гитара|ударные|барабаны|соло|вокал|피아노|기타|드럼|πιάνο"
)
ENCODINGS = {
    "cp932": "shift_jis", "gb18030": "gb18030", "big5hkscs": "big5", "cp949": "euc-kr", "cp1251": "windows-1251",
    "koi8_r": "koi8-r", "cp1253": "windows-1253", "cp1255": "windows-1255", "cp874": "windows-874",
}  # fmt: skip  # tried in turn; values: names in browsers
_ASCII = bytes(range(0x20, 0x7F))


def _first_word(words: str, name: str) -> re.Match[str] | None:
    """The first of the words in a name; `re` keeps the compiled pattern."""
    return re.search(words, name, re.IGNORECASE)


def _plain(name: str) -> str:
    """The name in the letters of the patterns."""
    return unicodedata.normalize("NFKC", name).replace("İ", "I").replace("ı", "i")


def is_bass(name: str) -> bool:
    """True if a track of this name plays a bass."""
    return bool(_first_word(BASS_WORD, _plain(name))) and not is_other(name)


def is_other(name: str) -> bool:
    """True if a track of this name plays another low instrument or voice."""
    return bool(_first_word(OTHER_WORD, _plain(name)))


def is_drums(name: str) -> bool:
    """True if a track of this name plays drums."""
    return bool(_first_word(DRUM_WORD, _plain(name)))


def is_game(names: Iterable[str]) -> bool:
    """True if tracks of these names are a chart for a music game."""
    return sum(bool(re.fullmatch(GAME_TRACK, name)) for name in names) >= MIN_GAME


def decode(texts: Sequence[bytes]) -> list[str]:
    """Decodes the texts of one file, which share an encoding.

    Valid UTF-8 is read as such; the rest in the encoding in which one of them names an instrument, else in the
    likeliest one, else in Latin-1.
    """
    doubtful = [text for text in texts if not _is(text, "utf-8")]
    if not doubtful:
        return [text.decode() for text in texts]
    encoding = next((e for e in ENCODINGS if any(_tells(text, e) for text in doubtful)), None)
    if encoding is None:
        from charset_normalizer import from_bytes  # rarely needed, and slow to import

        guesses = (guess.encoding for guess in from_bytes(b"\n".join(doubtful)))
        encoding = next((e for e in guesses if _is(_ASCII, e) and _ASCII.decode(e) == _ASCII.decode()), "latin-1")
    return [text.decode() if _is(text, "utf-8") else text.decode(encoding, "replace") for text in texts]


def _is(text: bytes, encoding: str) -> bool:
    try:
        text.decode(encoding)
    except UnicodeError:
        return False
    return True


def _tells(text: bytes, encoding: str) -> bool:
    """True if the text, in this encoding, names an instrument in letters outside ASCII."""
    if not _is(text, encoding):
        return False
    name = _plain(text.decode(encoding))
    found = _first_word(BASS_WORD, name)
    return bool(_first_word(TELLING_WORD, name)) or (found is not None and not found[0][0].isascii())
