"""The page of a fit: a sentence, a bar for each bass, doubts, numbers, then a comparison on the notes that judge."""

from __future__ import annotations

import base64
import math
from dataclasses import replace

from livebass import __version__
from livebass.lab.comparison.comparing import compare_basses
from livebass.lab.comparison.page import page as comparison_page
from livebass.lab.comparison.rows import ALL, ROWS, Row
from livebass.lab.comparison.summary import Bass
from livebass.lab.fitting.bounds import STEP
from livebass.lab.fitting.fit import Fitted
from livebass.lab.fitting.judge import Judged
from livebass.lab.fitting.preset_text import shown_deviation
from livebass.lab.fitting.target import Difference
from livebass.report.page import html_page
from livebass.report.picture import figure, image
from livebass.report.progress import Progress

MAX_ROWS = 16  # that are told in words
CREST = Row("crest", ALL, "peak over the level of the first 0.3 s", "dB")


def page(fitted: Fitted, name: str, progress: Progress | None = None) -> str:
    """The page as HTML. `name`: of the new preset. Needs matplotlib and Jinja2."""
    recorded, judges = fitted.recorded, fitted.plan.judges
    real = tuple(replace(recorded.takes[p][0], rank=p.rank) for p in sorted(judges))
    basses = [Bass(recorded.name, recorded.technique, False, real)]
    for title, each in ((f"before: {fitted.problem.label}", fitted.before), (f"after: {name}", fitted.after)):
        basses.append(Bass(title, recorded.technique, True, each.notes))
    bars = [each for each in (fitted.own_take, fitted.after, fitted.before, *fitted.others) if each is not None]
    above = html_page(
        "livebass.lab.fitting", "fit.html", version=__version__, sentence=fitted.sentence, name=name,
        like=fitted.problem.label, bars=_bars(bars), curve=base64.b64encode(_curve(fitted)).decode(),
        numbers=_numbers(fitted), rows=_rows(fitted), doubts=fitted.doubts, trials=fitted.best.trials,
        judges=len(fitted.after.each), notes=len(fitted.plan.fitted),
    )  # fmt: skip
    return comparison_page(compare_basses(basses, progress), f"A fit to {recorded.name}", above)


def _bars(found: list[Judged]) -> list[dict[str, object]]:
    known = [each for each in found if not math.isnan(each.distance)]
    maximum = max(each.distance for each in known)
    return [
        {"name": each.name, "distance": f"{each.distance:.1f}", "half": f"{each.half:.1f}",
         "equalized": f"{each.equalized:.1f}", "width": round(100 * each.distance / maximum),
         "rows": "" if math.isnan(each.inside) else f"{100 * each.inside:.0f} %"}
        for each in known
    ]  # fmt: skip


def _numbers(fitted: Fitted) -> list[dict[str, object]]:
    """The free numbers: before, after, deviation, and whether the notes tell them."""
    best, problem = fitted.best, fitted.problem
    made = []
    for f, value, u, start, deviation, known in zip(
        problem.free, fitted.values, best.scaled, problem.start(), best.deviations, best.known, strict=True
    ):
        unit = f" {f.unit}" if f.unit else ""
        before = "" if f.section == STEP else f"{f.value(start):.3g}{unit}"
        at_end = min(u, 1 - u) < 0.02
        made.append({
            "title": f.title, "key": f.name, "before": before, "after": f"{value:.3g}{unit}",
            "deviation": shown_deviation(f, u, deviation).removeprefix("sd "),
            "known": "not told by your notes" if not known else "at the end of its range" if at_end else "told",
        })  # fmt: skip
    return made


def _rows(fitted: Fitted) -> list[str]:
    """The rows farther than a spread, in words, the farthest first."""
    layers = fitted.recorded.layers
    return [
        _in_words(key, layers[rank], d) for key, rank, d in fitted.after.off if abs(d.spreads) >= 1
    ][:MAX_ROWS]  # fmt: skip


def _in_words(key: str, layer: str, d: Difference) -> str:
    row = next(row for row in (*ROWS, CREST) if row.key == key)
    unit = f" {row.unit}" if row.unit else ""
    title = f"{row.title.strip()}, {layer} notes"
    if math.isnan(d.ours):
        return f"{title}: your notes show it, the preset's do not"
    return (
        f"{title}: {row.shown(d.ours)}{unit}, recorded {row.shown(d.theirs)}{unit}, "
        f"{abs(d.spreads):.1f} times what real basses differ by"
    )


def _curve(fitted: Fitted) -> bytes:
    drawn = figure(6.4, 2.6)
    ax = drawn.subplots()
    ax.plot(*zip(*fitted.best.curve, strict=True), color="#1f4e79")
    ax.set(xlabel="trials", ylabel="best score")
    ax.grid(alpha=0.3)
    return image(drawn)
