"""The studies there are, by name. A new one is a row here: what it needs solved, and what it makes of that."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from livebass import (
    study_cases,
    study_claims,
    study_convergence,
    study_energy,
    study_linear,
    study_measure,
    study_variations,
)
from livebass.motion import Trial
from livebass.study_parts import Findings, Solved, Study


def cases(*names: str) -> Callable[[float | None], dict[str, Trial]]:
    """The trials of these cases of the paper."""
    return lambda duration: {name: study_measure.case_trial(name, duration) for name in names}


def one_case(name: str, title: str) -> Callable[[Mapping[str, Solved]], Findings]:
    """All there is to say of one case."""
    return lambda motions: study_cases.case_findings(name, title, motions[name])


SEEN = "displacement, spectrogram, characteristic frequency"
STUDIES = {
    study.name: study
    for study in (
        Study(
            "linear", "The string and the neck at rest", "2.2, 3.2",
            "figures 1 and 3: fret crowns; frequencies and quality factors, measured and modelled",
            study_linear.trials, study_linear.report,
        ),
        Study("a", "Case A: 0.87 mm, no contact", "4.1", SEEN, cases("a"), one_case("a", "Case A")),
        Study(
            "b", "Case B: 3.6 mm, 8 MHz", "4.1.1",
            f"{SEEN}, contacts and pitch, shapes (figure 8), energies, T60", study_energy.trials, study_energy.report,
        ),
        Study(
            "c", "Case C: 7.8 mm, 16 MHz", "4.1.2", f"{SEEN}, contacts and pitch (figures 5 and 7)",
            cases("c"), one_case("c", "Case C"),
        ),
        Study(
            "cases", "Cases A, B and C together", "4.1", "figures 4 and 6", cases("a", "b", "c"), study_cases.together
        ),
        Study(
            "oblique", "Second polarisation: plucked 3.1 mm up and 2.2 mm across", "4.1.3",
            "figure 9: both displacements, zooms and spectrograms", cases("oblique"), study_variations.oblique,
        ),
        Study(
            "dispersion", "Without dispersion", "4.2.1", "figures 7a and 10: spectrogram, contacts, pitch",
            cases("b", "harmonic"), study_variations.dispersion,
        ),
        Study(
            "plucking-point", "Plucked near the bridge, in the middle, near the nut", "4.2.2",
            "figure 11: spectrograms, first shapes, contacts", cases(*study_variations.PLUCKED),
            study_variations.plucking_point,
        ),
        Study(
            "neck", "The neck: as measured, half straightened, straight, sixth fret up", "4.2.3",
            "figure 12: spectrograms, necks, contacts, pitch", cases(*study_variations.NECKS), study_variations.neck,
        ),
        Study(
            "stiffness", "Soft frets: K = 1e9", "4.2.4", "figure 13: spectrogram, contacts, pitch",
            cases("b", "soft"), study_variations.stiffness,
        ),
        Study(
            "fretless", "A fretless bass, plucked as in case B", "5", f"{SEEN}, places of contact and pitch",
            cases("fretless"), one_case("fretless", "Fretless"),
        ),
        Study(
            "convergence", "Contact rates and numbers of modes", "4",
            "errors of displacement and characteristic frequency against the finest",
            study_convergence.trials, study_convergence.report,
        ),
        Study(
            "statements", "What the paper says, and what comes out", "2 to 4",
            "each statement that can be checked, what is expected and what was measured",
            study_claims.trials, study_claims.report,
        ),
    )
}  # fmt: skip


def chosen(names: Iterable[str]) -> list[Study]:
    """The studies called so, each once, in the order of the table; "all" for all. ValueError names those there are."""
    asked = [name.lower() for name in names]
    for name in asked:
        if name not in STUDIES and name != "all":
            raise ValueError(f"study {name!r}: there are {', '.join(STUDIES)}, and all of them as all")
    return [study for name, study in STUDIES.items() if name in asked or "all" in asked]
