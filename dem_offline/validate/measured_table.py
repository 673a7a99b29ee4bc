"""Measured wheel tests, as grouser-calibrate reads them, with the regions that grouser-fit tells of their rows."""

import json
import math
import os
import subprocess

OUTPUTS = ("f_x", "f_y", "torque", "sinkage")


class TableError(Exception):
    """What, where, expected."""


class Row:
    """One state with what was measured there: SI, radians. Missing values are not in `value`."""

    def __init__(self, line, slip, angle, load):
        self.line, self.slip, self.angle, self.load = line, slip, angle, load
        self.value, self.standard_error = {}, {}
        self.held_out = False
        self.regions = ()  # names of the regions that the row is in

    def error(self, output):
        """Standard error of a measured mean; nan: unknown."""
        return self.standard_error.get(output, math.nan)


def read(program, path, wheel, columns=()):
    """Rows of a CSV of wheel tests. program: grouser-calibrate, which reads it (docs/calibration.md);
    wheel: radius and width [m]. Throws TableError with what it says."""
    command = [program, "rows", path, "--kind", "wheel"]
    for quantity, value in zip(("radius", "width"), wheel):
        command += ["--constant", f"{quantity}={value!r} m"]
    for text in columns:
        command += ["--columns", text]
    rows = rows_of(answer_of(command)["observations"])
    find_regions(os.path.join(os.path.dirname(program), "grouser-fit"), rows)
    return rows


def rows_of(observations):
    """A row for each line of the wheel tests among the observations of `grouser-calibrate rows`, without regions."""
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


def find_regions(program, rows):
    """Sets the rows' regions (surrogate/models/form_error.h); returns the names of all, in the order of tables."""
    states = [f"--slip={','.join(repr(row.slip) for row in rows)}",
              f"--angle-deg={','.join(repr(math.degrees(row.angle)) for row in rows)}"] if rows else []
    answer = answer_of([program, "regions", "--json", *states])
    for row, state in zip(rows, answer["states"]):
        row.regions = tuple(state["groups"])
    return answer["groups"]


def answer_of(command):
    """JSON that a program of ours prints. Throws TableError with what it says."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
                          check=False, text=True)
    if done.returncode != 0:
        raise TableError(done.stderr.strip().removeprefix(os.path.basename(command[0]) + ": "))
    return json.loads(done.stdout)


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
