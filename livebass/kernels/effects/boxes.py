"""Three bass cabinets as numbers: loudspeakers, boxes and microphones, and the filters that follow from them.

Closed boxes follow Small 1972 ("Closed-box loudspeaker systems, part I", eq. 15), vented ones Small 1973 ("Vented-box
loudspeaker systems, part I", eq. 13), both in half space. The cones: a conical shell moves as a whole up to the ring
frequency of its edge, c cos(angle) / (2 pi a). Above, the ring that resonates moves inward, until at the radius of the
coil little is left that radiates (Frankort 1978, "Vibration patterns and radiation behavior of loudspeaker cones"). So
the response has peaks between these two frequencies, and ends at the second. BREAK_UP and ROLL_OFF are our choice
within that picture; a real cone differs from piece to piece.

Data. 10 inches: Celestion Pulse10, fs, Qts and Vas as an owner quotes them (diyaudio.com, thread 406292); the moving
diameter of 8.3 inches and the coil are those of usual drivers of this size. 15 inches: FaitalPRO 15PR400, by values
that users of it pass on; nobody compared either with the maker's sheet. A vented box of 4.5 cubic feet is what
Electro-Voice names as typical for their 15BX, a driver for bass guitars, whose coil has 2.5 inches. Volumes of the
closed boxes and places of the microphones are our choice.
"""

import math
from typing import NamedTuple

SOUND = 343.0  # m/s, in air
PAPER, ANGLE_COSINE = 1800.0, 0.5  # m/s, longitudinal waves in paper; of the angle between axis and cone: 60 degrees
LEAKS = 7.0  # Q of a vented box, through its losses by leakage: Small's usual value
# Of the cone's resonances: frequency over that of its ring, gain at the peak (dB), Q
BREAK_UP = ((1.0, -3.0, 2.5), (1.45, 5.0, 3.0), (2.1, 3.0, 4.0), (3.0, 4.0, 3.5))
ROLL_OFF = (0.5411961001461969, 1.3065629648763764)  # Q of its two sections: Butterworth's filter of fourth order


class Driver(NamedTuple):
    """A loudspeaker."""

    resonance: float  # Hz, in free air
    q: float  # total
    compliance: float  # l, of the air that is as stiff as its suspension
    radius: float  # m, of the cone
    coil: float  # m, radius

    @property
    def ring(self) -> float:
        """Frequency (Hz) at which the cone's edge resonates as a ring."""
        return PAPER * ANGLE_COSINE / (2.0 * math.pi * self.radius)

    @property
    def end(self) -> float:
        """Frequency (Hz) at which the ring has come in to the coil."""
        return self.ring * self.radius / self.coil


class Cabinet(NamedTuple):
    """Equal drivers in a row of columns, each in its part of a box, and a microphone."""

    driver: Driver
    volume: float  # l, for each driver
    tuning: float  # Hz, of the vent; 0: closed
    columns: int
    rows: int
    apart: float  # m, between the centres of neighbours
    before: tuple[int, int]  # column and row of the driver that the microphone faces
    distance: float  # m, of the microphone from the front
    beside: float  # m, of the microphone from that driver's axis, toward the next column ...
    above: float  # ... and toward the next row


TEN = Driver(66.3, 0.444, 30.0, 0.1054, 0.0254)
FIFTEEN = Driver(35.0, 0.32, 248.9, 0.1652, 0.03175)
BOXES = {
    "closed-4x10": Cabinet(TEN, 30.0, 0.0, 2, 2, 0.27, (0, 0), 0.1, 0.0, 0.0),
    "closed-8x10": Cabinet(TEN, 40.0, 0.0, 2, 4, 0.27, (0, 1), 1.5, 0.135, 0.135),
    "vented-1x15": Cabinet(FIFTEEN, 127.4, 43.0, 1, 1, 0.0, (0, 0), 0.3, 0.03, 0.0),
}


def closed_box(cabinet: Cabinet) -> list[tuple[float, float]]:
    """Frequency (Hz) and Q of a closed box's high pass of second order."""
    driver = cabinet.driver
    stiffer = math.sqrt(1.0 + driver.compliance / cabinet.volume)
    return [(driver.resonance * stiffer, driver.q * stiffer)]


def vented_box(cabinet: Cabinet) -> tuple[float, ...]:
    """Denominator of a vented box's high pass, in rising powers of s up to s^4; its numerator is the last term."""
    driver = cabinet.driver
    tb, ts = 1.0 / (2.0 * math.pi * cabinet.tuning), 1.0 / (2.0 * math.pi * driver.resonance)
    ratio, q = driver.compliance / cabinet.volume, driver.q
    return (
        1.0,
        tb / LEAKS + ts / q,
        (ratio + 1.0) * (tb * tb) + tb * ts / (LEAKS * q) + ts * ts,
        tb * tb * ts / q + tb * (ts * ts) / LEAKS,
        tb * tb * (ts * ts),
    )


def resonances_of(polynomial: tuple[float, ...]) -> list[tuple[float, float]]:
    """Frequency (Hz) and Q of the two quadratic factors of a polynomial of fourth degree, by Bairstow's method.

    It uses only operations that round alike everywhere.
    """
    scale = math.sqrt(math.sqrt(polynomial[0] / polynomial[4]))
    power, a = 1.0, list[float]()
    for x in polynomial:
        a.append(x * power / polynomial[0])
        power *= scale
    u, v = 1.0, 1.0  # s^2 + u s + v
    for _ in range(200):
        b4, b3 = a[4], a[3] - u * a[4]
        b2 = a[2] - u * b3 - v * b4
        b1 = a[1] - u * b2 - v * b3
        b0 = a[0] - u * b1 - v * b2
        c4, c3 = b4, b3 - u * b4
        c2 = b2 - u * c3 - v * c4
        c1 = b1 - u * c2 - v * c3
        by = c2 * c2 - c1 * c3
        u, v = u + (b1 * c2 - b0 * c3) / by, v + (b0 * c2 - b1 * c1) / by
    rest_u, rest_v = (a[3] - u * a[4]) / a[4], a[0] / (a[4] * v)
    return [(scale * math.sqrt(y) / (2.0 * math.pi), math.sqrt(y) / x) for x, y in ((u, v), (rest_u, rest_v))]


def high_passes(cabinet: Cabinet) -> list[tuple[float, float]]:
    """Frequency (Hz) and Q of each section of a box's high pass."""
    return resonances_of(vented_box(cabinet)) if cabinet.tuning else closed_box(cabinet)


def sources(cabinet: Cabinet) -> list[tuple[float, float]]:
    """Distance (m) of each driver's centre from the microphone, and the sine of its angle from that driver's axis."""
    made = []
    for column in range(cabinet.columns):
        for row in range(cabinet.rows):
            x = cabinet.apart * (column - cabinet.before[0]) - cabinet.beside
            y = cabinet.apart * (row - cabinet.before[1]) - cabinet.above
            beside = math.sqrt(x * x + y * y)
            far = math.sqrt(beside * beside + cabinet.distance * cabinet.distance)
            made.append((far, beside / far))
    return sorted(made)
