"""Numbers for people: no more digits than are known, groups of three, a real minus sign, powers of ten written out."""

from __future__ import annotations

import math

from identification.uncertainty.covariance import NINETY

NARROW = "\N{NARROW NO-BREAK SPACE}"
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MOST_DIGITS = 7


def number(value: float, digits: int = 3) -> str:
    """A value to some significant digits.

    >>> number(0.012345), number(-4.0), number(1.7e-8)
    ('0.0123', '−4.00', '1.70×10⁻⁸')
    """
    if not math.isfinite(value):
        return "unknown"
    if value == 0.0:
        return "0"
    exponent = _exponent(value, digits)
    if not -4 <= exponent < MOST_DIGITS:
        return f"{_fixed(value / 10.0**exponent, digits - 1)}×10{str(exponent).translate(SUPERSCRIPT)}"
    return _fixed(value, digits - 1 - exponent)


def with_std(value: float, std: float | None) -> tuple[str, str]:
    """A value and its standard deviation, this one to two digits and the value to the same place.

    >>> with_std(287.1650, 0.0051), with_std(3.2e8, 4e6)
    (('287.1650', '0.0051'), ('3.200×10⁸', '0.040×10⁸'))
    """
    if std is None or not math.isfinite(std) or std <= 0.0 or not math.isfinite(value):
        return number(value, 5), "" if std is None else number(std, 2)
    exponent = _exponent(value, 2) if value else 0
    shown = 0 if -4 <= exponent < MOST_DIGITS else exponent
    power = f"×10{str(shown).translate(SUPERSCRIPT)}" if shown else ""
    unit = 10.0**shown
    places = min(1 - _exponent(std / unit, 2), MOST_DIGITS - 1 - _exponent(value / unit, 2) if value else 12)
    small = _fixed(std / unit, places) if round(std / unit, places) > 0 else f"<{NARROW}{_fixed(10.0**-places, places)}"
    return _fixed(value / unit, places) + power, small + power


def interval(value: float, std: float, positive: bool) -> tuple[str, str]:
    """The 90 % interval; of a positive parameter in its logarithm, in which it was fitted: it stays positive."""
    if positive and value > 0:
        factor = math.exp(min(NINETY * std / value, 50.0))
        low, high = value / factor, value * factor
    else:
        low, high = value - NINETY * std, value + NINETY * std
    if std > 0.1 * abs(value) or std <= 0.0:
        return number(low), number(high)
    return with_std(low, std)[0], with_std(high, std)[0]


def percent(share: float) -> str:
    """A share in percent, to two or three digits."""
    return f"{number(100 * share, 3 if abs(share) >= 0.1 else 2)}{NARROW}%"


def count(value: int) -> str:
    """A whole number in groups of three.

    >>> count(200000) == "200\N{NARROW NO-BREAK SPACE}000"
    True
    """
    return _fixed(float(value), 0)


def plain(value: float) -> str:
    """A given value, without zeros that say nothing.

    >>> plain(0.01), plain(3.87529)
    ('0.01', '3.87529')
    """
    text, times, power = number(value, 6).partition("×")
    return (text.rstrip("0").rstrip(".") if "." in text else text) + times + power


def force_words(newtons: float) -> str:
    """A force in N, a large one in kN."""
    return f"{number(newtons)}{NARROW}N" if abs(newtons) < 1e4 else f"{number(newtons / 1e3)}{NARROW}kN"


def mm_words(metres: float) -> str:
    """A length in mm."""
    return f"{number(1e3 * metres)}{NARROW}mm"


def small_words(metres: float) -> str:
    """A length in µm, in mm from a tenth of one up."""
    return f"{number(1e6 * metres)}{NARROW}µm" if abs(metres) < 1e-4 else mm_words(metres)


def _exponent(value: float, digits: int) -> int:
    """Decimal exponent of a value after it has been rounded to some significant digits."""
    return int(f"{abs(value):.{digits - 1}e}".partition("e")[2])


def _fixed(value: float, places: int) -> str:
    """Fixed-point digits; negative places round to tens, hundreds."""
    text = f"{round(value, places):.{max(places, 0)}f}"
    whole, dot, fraction = text.lstrip("-").partition(".")
    grouped = f"{int(whole):,}".replace(",", NARROW) if len(whole) > 4 else whole
    sign = "−" if text.startswith("-") and float(text) != 0.0 else ""
    return f"{sign}{grouped}{dot}{fraction}"
