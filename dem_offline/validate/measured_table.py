"""Measured wheel tests, as grouser-calibrate reads them, and the regions of their rows."""

import json
import math
import os
import subprocess

OUTPUTS = ("f_x", "f_y", "torque", "sinkage")
LOCKED_RIM = 1e-3  # of the hub's speed


class TableError(Exception):
    """What, where, expected."""


class Row:
    """One state with what was measured there: SI, radians. Missing values are not in `value`."""

    def __init__(self, line, slip, angle, load):
        self.line, self.slip, self.angle, self.load = line, slip, angle, load
        self.value, self.standard_error = {}, {}
        self.held_out = False

    @property
    def rim_over_hub(self):
        """Rim speed over the hub's speed V; inf where the hub stands. Of a rim that turns backwards, whose
        slip fits two speeds, the one up to V."""
        with_v = self.slip + math.cos(self.angle)  # V >= |r w|: slip = (r w - V cos b)/V
        if abs(with_v) <= 1:
            return with_v
        sign = math.copysign(1.0, with_v)  # |r w| > V: slip = (r w - V cos b)/|r w|
        over = sign - self.slip
        return sign * abs(math.cos(self.angle) / over) if abs(over) > 1e-12 else math.inf

    @property
    def regions(self):
        """Names of the regions that the row is in. Braking is told by the rim against the hub's whole
        speed, so that it means the same at every slip angle."""
        locked = abs(self.rim_over_hub) < LOCKED_RIM
        gentle = self.rim_over_hub >= 0.8 - 1e-3
        names = []
        if gentle:
            names.append("braking <= 0.2, driving")
            if abs(self.angle) < math.radians(0.5):
                names.append("straight of these")
        names.append("locked" if locked else "not locked")
        return names

    def error(self, output):
        """Standard error of a measured mean; nan: unknown."""
        return self.standard_error.get(output, math.nan)


REGIONS = ("braking <= 0.2, driving", "straight of these", "not locked", "locked")


def read(program, path, wheel, columns=()):
    """Rows of a CSV of wheel tests. program: grouser-calibrate, which reads it (docs/calibration.md);
    wheel: radius and width [m]. Throws TableError with what it says."""
    command = [program, "rows", path, "--kind", "wheel"]
    for quantity, value in zip(("radius", "width"), wheel):
        command += ["--constant", f"{quantity}={value!r} m"]
    for text in columns:
        command += ["--columns", text]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
                          check=False, text=True)
    if done.returncode != 0:
        raise TableError(done.stderr.strip().removeprefix(os.path.basename(program) + ": "))
    return rows_of(json.loads(done.stdout)["observations"])


def rows_of(observations):
    """A row for each line of the wheel tests among the observations of `grouser-calibrate rows`."""
    rows = {}
    for one in observations:
        if one["kind"] != "wheel" or one["measured"] not in OUTPUTS:
            continue
        line = one["test_index"], one["line"]
        if line not in rows:
            rows[line] = Row(one["line"], one["slip"], math.radians(one["attack_angle_deg"]), one["load_n"])
            rows[line].held_out = one["held_out"]
        rows[line].value[one["measured"]] = one["value"]
        if one["sd"] is not None:
            rows[line].standard_error[one["measured"]] = one["sd"]
    return list(rows.values())


def choose(rows, text):
    """Rows by number, from 1: '1,3-5'; empty: all."""
    if not text:
        return rows
    chosen = []
    for part in text.split(","):
        first, dash, last = part.partition("-")
        try:
            low, high = int(first), int(last if dash else first)
        except ValueError:
            raise TableError(f"--rows {text}: '{part}', expected numbers as 1,3-5") from None
        if not 1 <= low <= high <= len(rows):
            raise TableError(f"--rows {text}: '{part}', expected rows 1 to {len(rows)}")
        chosen += rows[low - 1:high]
    return chosen
