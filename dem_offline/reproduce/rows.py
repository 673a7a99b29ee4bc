"""Rows of a reproduced table: what was got, what was expected, whether it holds."""

import dataclasses
import math


@dataclasses.dataclass
class Row:
    """`passed` None: printed only. `limit`: what must hold, in words. `changed`: grains,
    stiffness, speed against the paper. `standard_error`: over the beds, None for one bed."""
    row: str
    got: float | str
    expected: float | str
    limit: str = ""
    passed: bool | None = None
    changed: str = ""
    standard_error: float | None = None
    beds: int = 1
    note: str = ""

    def as_json(self):
        out = {"row": self.row, "got": plain(self.got), "expected": plain(self.expected),
               "limit": self.limit, "pass": self.passed, "changed": self.changed,
               "standard_error": plain(self.standard_error), "beds": self.beds}
        return {**out, "note": self.note} if self.note else out


def plain(value):
    """A value that JSON knows: NaN and infinity become null, numbers of numpy Python's."""
    if value is None or isinstance(value, str):
        return value
    return float(value) if math.isfinite(value) else None


def mean_and_error(values):
    """Mean and its standard error over beds; the error is None for one bed."""
    n = len(values)
    if n == 0:
        return math.nan, None
    mean = sum(values) / n
    if n == 1:
        return mean, None
    return mean, math.sqrt(sum((v - mean) ** 2 for v in values) / (n - 1) / n)


def between(row, values, low, high, expected, changed, note="", held=True):
    """A row whose mean over beds must lie in [low, high]. held=False: the runs of this level
    cannot hold it, so it is printed; `note` says why."""
    values = values if isinstance(values, (list, tuple)) else [values]
    mean, error = mean_and_error(values)
    good = bool(low <= mean <= high)  # false for NaN
    if math.isinf(low):
        limit = f"<= {high:g}"
    else:
        limit = f">= {low:g}" if math.isinf(high) else f"{low:g} to {high:g}"
    return Row(row, mean, expected, limit, good if held else None, changed, error, len(values), note)


def at_most(row, values, high, expected, changed, note="", held=True):
    return between(row, values, -math.inf, high, expected, changed, note, held)


def at_least(row, values, low, expected, changed, note="", held=True):
    return between(row, values, low, math.inf, expected, changed, note, held)


def printed(row, values, expected, changed, note=""):
    values = values if isinstance(values, (list, tuple)) else [values]
    mean, error = mean_and_error(values)
    return Row(row, mean, expected, "printed", None, changed, error, len(values), note)


def failed(row, expected, limit, changed, note):
    """A row that has no number, because its runs failed."""
    return Row(row, "none", expected, limit, False, changed, None, 0, note)
