"""Tao and Kokotovic's hysteresis between four lines, and its inverse (equation 2.44, 2.45)."""

from __future__ import annotations

from dataclasses import dataclass

from recordings import BadParameter


@dataclass(frozen=True)
class Lines:
    """Slopes m and crossings c of the four lines: u = mt v + ct, mb v + cb, mr (v - cr) and ml (v - cl).

    Raises BadParameter unless left and right lines are steeper than top and bottom and these rise.
    """

    mt: float
    ct: float
    mb: float
    cb: float
    mr: float
    cr: float
    ml: float
    cl: float

    def __post_init__(self) -> None:
        flat = max(self.mt, self.mb)
        for name in ("mt", "mb"):
            if not getattr(self, name) > 0:
                raise BadParameter(name, f"{getattr(self, name):g}", "the line does not rise", "give more than 0")
        for name in ("mr", "ml"):
            if not getattr(self, name) > flat:
                found = f"the side is not steeper than top and bottom, {flat:g}"
                raise BadParameter(name, f"{getattr(self, name):g}", found, "m_r, m_l > m_t, m_b")

    @property
    def corners(self) -> tuple[float, float, float, float]:
        """v1 to v4: the inputs at the upper left, lower right, upper right and lower left corner."""
        return (
            (self.ct + self.ml * self.cl) / (self.ml - self.mt), (self.cb + self.mr * self.cr) / (self.mr - self.mb),
            (self.ct + self.mr * self.cr) / (self.mr - self.mt), (self.cb + self.ml * self.cl) / (self.ml - self.mb),
        )  # fmt: skip

    def enclosing(self) -> Lines:
        """These lines. Raises BadParameter where they have crossed, so that no loop is between them."""
        v1, v2, v3, v4 = self.corners
        if not (v1 < v3 and v4 < v2):
            found = f"the right line is not right of the left one, whose crossing is {self.cl:g}"
            raise BadParameter("cr", f"{self.cr:g}", found, "v1 < v3 and v4 < v2, as where c_r > c_l")
        if not (v4 < v1 and v2 < v3):
            found = f"the top line is not above the bottom one, whose crossing is {self.cb:g}"
            raise BadParameter("ct", f"{self.ct:g}", found, "v4 < v1 and v2 < v3, as where c_t > c_b")
        return self


def moved_to(k: Lines, before: float, value: float, output: float) -> float:
    """u of (2.44) after v moved one way from `before` to `value`, u having been `output`."""
    moved, top, bottom = value - before, k.mt * value + k.ct, k.mb * value + k.cb
    if moved > 0:
        return min(max(output + k.mb * moved, k.mr * (value - k.cr)), top)
    if moved < 0:
        return max(min(output + k.mt * moved, k.ml * (value - k.cl)), bottom)
    return output


class Quadrilateral:
    """u = H(v) of (2.44): up along a parallel of the bottom line, then the right and the top one; down likewise.

    lines : as keywords mt, ct, mb, cb, mr, cr, ml, cl; start : first v and u. Raises BadParameter for lines that do not
    rise, are too flat, or have crossed.

    >>> loop = Quadrilateral(mt=0.1, ct=1, mb=0.1, cb=-1, mr=2, cr=1, ml=2, cl=-1)
    >>> [round(loop.update(v), 6) for v in (1.0, 1.25, 3.0, 0.0, -3.0)]
    [0.1, 0.5, 1.3, 1.0, -1.3]
    """

    def __init__(self, *, start: tuple[float, float] = (0.0, 0.0), **lines: float) -> None:
        self.lines = Lines(**lines).enclosing()
        self._input, self.output = start

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value."""
        self._input, self.output = value, moved_to(self.lines, self._input, value, self.output)
        return self.output


class QuadrilateralInverse:
    """v = HI(ud) of (2.45): with the same lines, and started on the loop, H(HI(ud)) = ud from then on (proposition 1).

    lines, and start as first ud and v: as of `Quadrilateral`, whose start has v before u.
    """

    def __init__(self, *, start: tuple[float, float] = (0.0, 0.0), **lines: float) -> None:
        self.lines = Lines(**lines).enclosing()
        self._wanted, self.output = start

    def update(self, value: float) -> float:
        """The input that the hysteresis needs for its output to move one way to a value."""
        k, moved = self.lines, value - self._wanted
        top, bottom = (value - k.ct) / k.mt, (value - k.cb) / k.mb
        if moved > 0:
            self.output = max(min(self.output + moved / k.mb, value / k.mr + k.cr), top)
        elif moved < 0:
            self.output = min(max(self.output + moved / k.mt, value / k.ml + k.cl), bottom)
        self._wanted = value
        return self.output
