"""A made-up gear as a measuring machine writes it: curves (.mka) by formula."""

import math

TEETH, MODULE, WIDTH = 24, 3.0, 30.0
BEGIN, END = 69.0, 77.0  # diameters [mm]
POINTS = 33
OFFSETS = {1: 1.5, 9: -1.5, 17: 0.0}  # µm, by tooth; they cancel in the mean
UNDEFINED = "-2147483.648"
HEAD = f"""HEADER KS.MK.FILE
TYPE STI ! MADE UP
UNDEFINED {UNDEFINED} ! Undefined
LANGUAGE 44 !
   7 :name................: made-up-24
  21 :mn..................:   {MODULE}
  22 :z...................:  {TEETH} external
  23 :beta................:   .0
  24 :alpha...............:  20.0
  26 :face................:  {WIDTH}
  41 :da..................: {BEGIN} {BEGIN}
  44 :de..................: {END} {END}
  61 :ba..................: 2.0 2.0
  64 :be..................: 28.0 28.0
 178 :Vorzeichen: LVORZ: 1: DIN
"""


def base_radius() -> float:
    """Return the radius of the base circle [mm]."""
    return 0.5 * MODULE * TEETH * math.cos(math.radians(20.0))


def roll_lengths() -> list[float]:
    """Return the length of roll of every point, evenly spaced [mm]."""
    first, last = (math.sqrt((d / 2) ** 2 - base_radius() ** 2) for d in (BEGIN, END))
    return [first + (last - first) * n / (POINTS - 1) for n in range(POINTS)]


def deviation(roll: float) -> float:
    """Return what the machine prints of the right side: a relief at the tip [µm]."""
    return -2.0 * max(0.0, roll - 12.0) ** 2


def lead(position: float) -> float:
    """Return what the machine prints of a lead: crowning and a slope [µm]."""
    return -0.03 * position**2 + 0.1 * position


def _curve(tooth: int, side: str, values: list[str], axis: str) -> str:
    rows = [" ".join(values[n : n + 12]) for n in range(0, len(values), 12)]
    head = f"Tooth-No.: {tooth} {side} / {len(values)}  Values / {axis}= 15.0"
    return "\n".join(["", head, *rows, ""])


def mka(order: int = 1) -> str:
    """Return the whole file; pitch deviations are a sine of one order."""
    text = HEAD + "\nProfil:"
    for tooth, offset in OFFSETS.items():
        right = [f"{deviation(roll) + offset:.3f}" for roll in roll_lengths()]
        right[0] = right[-1] = UNDEFINED
        left = [f"{-offset:.3f}"] * POINTS  # raw: the other sign of what is printed
        text += _curve(tooth, "left", left, "z") + _curve(tooth, "right", right, "z")
    text += (
        "\nVerschränkung: Tooth-No.: 1k /Flankenlinie:3 right / 2 Values z= 5\n9 9\n"
    )

    text += "\nFlankenlinie:"
    for tooth, offset in OFFSETS.items():
        places = [-13.0 + 26.0 * n / 20 for n in range(21)]
        raw = [f"{-(lead(place) + offset):.3f}" for place in places]
        text += _curve(tooth, "left", raw, "x") + _curve(tooth, "right", raw, "x")

    for word in ("linke", "rechte"):
        text += f"\n  {word} Zahnflanke\n  Zahn-Nr. fp Fp Fr\n\n"
        cumulative = [
            6.0 * math.sin(math.tau * order * n / TEETH) for n in range(1, 25)
        ]
        previous = 0.0
        for number, value in enumerate(cumulative, 1):
            text += f" {number} {value - previous:.3f} {value:.3f} 0.0\n"
            previous = value
    return text
