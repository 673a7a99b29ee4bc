"""design.json as it is read: all of it checked here, so that what reads it need not."""

import math

from experiment_runs import Refused, read_kept
from targets import CURVES, kind_of
from vary import KNOWN, TESTS

VERSION = 1
KINDS = {"version": int, "soil": dict, "scene": dict, "beds": int, "fixed": dict, "ranges": dict, "points": list}
OF_POINT = {"label": str, "values": dict, "status": str, "seconds": dict, "outputs": dict}
STATUSES = ("done", "part", "failed")


def read_table(path):
    """As design.json has it. Refused: what, where, expected."""
    origin = "the design.json of ./grouser calibrate grains"
    table = read_kept(path, KINDS, origin)
    fault = fault_of(table) if table else "no such file"
    if fault:
        raise Refused(f"{path}: {fault}, expected {origin}")
    return table


def fault_of(table):
    """What is wrong below the keys of KINDS, in words; none."""
    if table["version"] != VERSION:
        return f"version {table['version']}, not {VERSION}"
    for name in ("soil", "scene"):
        if not all(isinstance(table[name].get(key), str) for key in ("file", "sha256")):
            return f"{name}: no file and sha256"
    for name in (*table["ranges"], *table["fixed"]):
        if name not in KNOWN:
            return f"unknown parameter '{name}', not one of {', '.join(KNOWN)}"
    for name, ends in table["ranges"].items():
        if not (isinstance(ends, list) and len(ends) == 2 and all(map(is_number, ends)) and ends[0] < ends[1]):
            return f"ranges: {name}: got {ends!r}, not [LOW, HIGH]"
    if not table["ranges"] or not all(map(is_number, table["fixed"].values())):
        return "ranges: none" if not table["ranges"] else "fixed: no numbers"
    if not is_texts(table.get("rows", [])):
        return "rows: no list of keys"
    if not isinstance(table.get("engine", ""), str):
        return "engine: no text"
    names = (*table["ranges"], *table["fixed"])
    return next(filter(None, (f and f"points[{k}]: {f}" for k, f in enumerate(
        fault_of_point(point, names) for point in table["points"]))), None)


def fault_of_point(point, names):
    """What is wrong in a line of the table, in words; none. names: parameters whose values it has to have."""
    for key, kind in OF_POINT.items():
        if not isinstance(point, dict) or not isinstance(point.get(key), kind):
            return f"no {key}"
    missing = [name for name in names if not is_number(point["values"].get(name))]
    if missing:
        return f"values: no number for {', '.join(missing)}"
    if point["status"] not in STATUSES:
        return f"status: got {point['status']!r}, not one of {', '.join(STATUSES)}"
    if not is_known(point.get("known", {"ran_at": {}})):
        return "known: no ran_at with numbers by parameter and kind of test"
    for name, seconds in (("seconds", point["seconds"]), ("known: seconds", point.get("known", {}).get("seconds", {}))):
        if not is_numbers(seconds, 0):
            return f"{name}: no numbers from 0 on"
    for name in ("solid_fraction", "top_solid_fraction"):
        if not is_numbers(point.get(name, {}), 0):
            return f"{name}: no numbers from 0 on"
    if not is_texts(point.get("reasons", [])):
        return "reasons: no list of texts"
    return next(filter(None, (fault_of_output(key, one) for key, one in point["outputs"].items())), None)


def fault_of_output(key, output):
    """What is wrong in what a point gave for a row, in words; none."""
    if kind_of(key) not in TESTS:
        return f"outputs: unknown row '{key}'"
    if not isinstance(output, dict) or not is_number(output.get("value")):
        return f"outputs: {key}: no value that is a number"
    if kind_of(key) in CURVES and not output["value"] > 0:
        return f"outputs: {key}: force {output['value']:g} N, not more than 0"
    error = output.get("standard_error")
    if error is not None and not (is_number(error) and error >= 0):
        return f"outputs: {key}: standard_error: got {error!r}, not a number from 0 on or null"
    return None if is_numbers(output.get("beds", {})) else f"outputs: {key}: beds: no numbers"


def is_known(entry):
    """Whether what a point has of an earlier design is as known.Taken writes it."""
    ran = entry.get("ran_at") if isinstance(entry, dict) else None
    return isinstance(ran, dict) and all(
        isinstance(values, dict) and set(values) <= set(KNOWN) and all(map(is_number, values.values()))
        for values in ran.values())


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def is_numbers(entry, least=-math.inf):
    """Whether it is a mapping of numbers of that size at least."""
    return isinstance(entry, dict) and all(is_number(value) and value >= least for value in entry.values())


def is_texts(entry):
    return isinstance(entry, list) and all(isinstance(one, str) for one in entry)
