"""Wheel states that ./grouser validate has run with grains of this design's space: rows.json as a point of a table."""

import glob
import hashlib
import math
import os

import table_check
import wheel_campaign
from experiment_runs import Refused
from plain_yaml import load
from point import counts, over_beds
from targets import wheel_key
from vary import KNOWN, between

ROUNDED = 1e-4  # more than vary.round_to takes off
NOT_COMPARED = {"soil": ("name", "source"), "scene": ("name", "soil")}  # words


def is_rows(kept):
    """Whether a JSON document is rows.json of ./grouser validate."""
    return isinstance(kept, dict) and "soil_sha256" in kept and isinstance(kept.get("rows"), list)


def point_of(path, kept, label, start, head, vary):
    """A line of the table of what rows.json has, with the wheel states of which all beds were run and went the equal
    travel. head: of the table; start: vary.Start. Refused: another engine, or grains, wheel or rig that no values of
    the parameters give."""
    try:
        if kept["engine_version"] != head["engine"]:
            raise Refused(f"--known {path}: engine {kept['engine_version']}, expected {head['engine']} as here")
        soil, scene = (beside(path, kept[f"{what}_sha256"], what) for what in ("soil", "scene"))
        values = values_of(path, soil, scene, start, vary)
        outputs, seconds = outputs_of(kept["rows"], head)
        beds = [kept["bed_reached"][str(seed)] for seed in range(1, head["beds"] + 1)] if outputs else []
        fractions = {key: {"wheels": sum(bed[key] for bed in beds) / len(beds)} if all(bed[key] for bed in beds) else {}
                     for key in ("solid_fraction", "top_solid_fraction") if beds}
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        raise Refused(f"--known {path}: {type(error).__name__} {error}, expected rows.json of ./grouser validate"
                      ) from None
    if not outputs:
        raise Refused(f"--known {path}: no wheel state that is run here was run there on {head['beds']} beds")
    point = {"label": label, "values": values, "asked": "", "status": "part", "seconds": {"tests": 0.0, "wheels": 0.0},
             "known": {"label": os.path.basename(path), "ran_at": {}, "seconds": {"wheels": seconds}},
             **fractions, "outputs": outputs, "reasons": []}
    fault = table_check.fault_of_point(point, values)
    if fault:
        raise Refused(f"--known {path}: {fault}, expected rows.json of ./grouser validate")
    return point


def values_of(path, soil, scene, start, vary):
    """{parameter: value} that make these documents of the start. Refused: a parameter that is held here has another
    value there."""
    values = {**middle_of(vary), **vary.fixed}  # of what is in neither file: it does not act on wheels
    there = start.values_of(soil, scene)
    for name, held in vary.fixed.items():
        if name in there and not math.isclose(there[name], held, rel_tol=ROUNDED):
            raise Refused(f"--known {path}: {name}: {there[name]:g}, expected {held:g} as it is held here")
    values.update({name: value for name, value in there.items() if name in vary.ranges})
    for what, document, made in zip(("soil", "scene"), (soil, scene), start.made(values, "")):
        key = first_difference(document, made, NOT_COMPARED[what])
        if key:
            raise Refused(f"--known {path}: {what} file beside it: {key} is not what the {what} file here has at "
                          + ", ".join(f"{name} {value:g}" for name, value in values.items()))
    return values


def outputs_of(rows, head):
    """({key: as over_beds}, seconds of these runs) of what the table asks for."""
    seeds, found, seconds = range(1, head["beds"] + 1), {}, 0.0
    for row in rows:
        state = wheel_campaign.rounded(row["slip"], row["attack_angle_deg"], row["load_n"])
        runs = {run["seed"]: run for run in row["dem"]["runs"] if counts(run)}
        each = [(seed, runs[seed]) for seed in seeds if seed in runs]
        wanted = {name for _, run in each for name in run["outputs"] if wheel_key(state, name) in head["rows"]}
        if len(each) < len(seeds) or not wanted:
            continue
        seconds += sum(run["wall_s"] or 0.0 for _, run in each)
        for name in wanted:
            found[wheel_key(state, name)] = over_beds({
                seed: (run["outputs"][name]["mean"], run["outputs"][name]["standard_error"]) for seed, run in each})
    return found, round(seconds, 1)


def middle_of(vary):
    return {name: between(KNOWN[name], *ends, 0.5) for name, ends in vary.ranges.items()}


def beside(path, sha256, what):
    """The document of the file in the folder of rows.json that has that hash."""
    for name in sorted(glob.glob(os.path.join(os.path.dirname(os.path.abspath(path)), f"*.{what}.yaml"))):
        with open(name, "rb") as file:
            if hashlib.sha256(file.read()).hexdigest() == sha256:
                return load(name)
    raise Refused(f"--known {path}: no {what} file of hash {sha256[:12]} beside it, expected the *.{what}.yaml that "
                  "its runs were made with")


def first_difference(one, other, left_out=(), at=""):
    """Key of the first value in which two documents differ, words of sources aside; none."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({**one, **other}):
            if key in left_out or key == "source":
                continue
            found = first_difference(one.get(key), other.get(key), (), f"{at}.{key}".lstrip("."))
            if found:
                return found
        return None
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return next(filter(None, (first_difference(a, b, (), f"{at}[{k}]")
                                  for k, (a, b) in enumerate(zip(one, other)))), None)
    try:
        same = float(one) == float(other)
    except (TypeError, ValueError):
        same = one == other
    return None if same else at or "it"
