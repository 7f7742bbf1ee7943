"""The quantities that `livebass study sweep` measures at each point, for the table, the picture and the help."""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """One column of the table."""

    name: str
    unit: str  # "": a plain number
    meaning: str

    @property
    def title(self) -> str:
        """Name and unit, "last_contact [s]"."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


QUANTITIES = {
    row.name: row
    for row in (
        Quantity("contacts", "", "how often the string meets a fret"),
        Quantity("frets", "", "how many frets it meets"),
        Quantity("first_fret", "", "the fret it meets first"),
        Quantity("first_contact", "s", "time of the first contact"),
        Quantity("last_contact", "s", "time of the last contact"),
        Quantity("contact_phase", "s", "time of the last contact before three periods without any"),
        Quantity("hardness", "", "apex, relative to the one that just grazes a fret"),
        Quantity("characteristic_frequency", "Hz", "eq. 14, mean over the duration (43 ms at least)"),
        Quantity("characteristic_start", "Hz", "eq. 14, in the first 43 ms"),
        Quantity("peak", "m", "greatest displacement at the sensor"),
        Quantity("rms", "m", "displacement at the sensor, root mean square"),
        Quantity("glide", "", "how sharp the fundamental is in the first 0.1 s (YIN), relative to the first mode"),
        Quantity("t60", "s", "decay by 60 dB of the first mode, from its damping"),
        Quantity("energy", "J", "energy of the plucked string"),
        Quantity("energy_left", "", "share of it that is left at the end"),
        Quantity("heard_peak", "", "peak of the preset's output (pickups and circuit, or sensor); 1 is full scale"),
        Quantity("heard_characteristic_frequency", "Hz", "eq. 14 of that output, mean over the duration"),
    )
}
DEFAULT_QUANTITIES = ("last_contact", "characteristic_frequency")
