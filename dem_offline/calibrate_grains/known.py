"""Outputs of an earlier design.json, taken over where a point of this design would make the same runs.

A test depends on the parameters that act on it (vary.KNOWN). What the earlier design held and this one varies may
differ: an output of a test on which such a parameter acts stays the measurement of another point of the space, and
enters the emulator at the values at which it was run (`ran_at`); an output of any other test is that of the point
itself. Where every test depends on such a parameter, the points of the earlier design stand beside those of this one,
at the values at which they were run; so do those that no point of this design is at, as those that emulators chose."""

import math

from experiment_runs import Refused
from targets import kind_of
from vary import ANY, KNOWN, TESTS


def ran_at(point, kind):
    """{parameter: value} of a point of a table in which a kind of test was not run at the point's own values."""
    return point.get("known", {}).get("ran_at", {}).get(kind, {})


class Taken:
    """What is known of one point. entry: as its line of the table has it; asked: keys of rows that need no run, with
    an output or without; of a point that failed all rows."""

    def __init__(self, point, asked, ran):
        self.outputs, self.reasons, self.asked = point["outputs"], point.get("reasons", []), asked
        self.solid_fraction, self.top_solid_fraction = (
            point.get(key, {}) for key in ("solid_fraction", "top_solid_fraction"))
        self.failed = point["status"] == "failed"
        self.entry = {"label": point["label"], "ran_at": ran, "seconds": {
            name: value + point.get("known", {}).get("seconds", {}).get(name, 0.0)
            for name, value in point["seconds"].items()}}


class Known:
    """table: of the earlier design, from the file `path`; head: of this one's table (head_of in calibrate_grains.py),
    vary: what it varies. Refused where the runs would not be the same: what, there, expected."""

    def __init__(self, path, table, head, vary, say):
        self.path, self.vary = path, vary
        self.asked = set(table.get("rows") or {key for one in table["points"] for key in one["outputs"]})
        for what in ("soil", "scene"):
            self._expect(f"{what} file", table[what]["sha256"][:12], head[what]["sha256"][:12])
        self._expect("beds", table["beds"], head["beds"])
        if "engine" in table:
            self._expect("engine", table["engine"], head["engine"])
        else:
            say(f"--known {path}: its engine version is not recorded, here {head['engine']}")
        there, here = {**table["ranges"], **table["fixed"]}, {**vary.ranges, **vary.fixed}
        absent = {name: KNOWN[name].absent for name in here
                  if name not in there and KNOWN[name].absent is not None}
        self._expect("parameters", sorted({**there, **absent}), sorted(here))
        self.held = {name: value for name, value in vary.fixed.items() if name in absent}
        for name, value in self.held.items():
            if absent[name] not in (ANY, value):
                self._expect(name, absent[name], value)
        curves, here = (sorted(key for key in rows if kind_of(key) != "wheel") for rows in (self.asked, head["rows"]))
        if curves and curves != here:  # box and depth of the bed go with them
            raise Refused(f"--known {path}: {len(curves)} rows of plates and pressed wheel, expected the {len(here)} "
                          f"rows that are run here: {difference(curves, here)}")
        self.new = {**{name: value for name, value in absent.items() if name in vary.ranges}, **{name: table["fixed"][name] for name in vary.ranges if name in table["fixed"]}}
        self.beside = any(set(KNOWN[name].acts_on) == set(TESTS) for name in self.new)
        self.shared = [name for name in (*vary.ranges, *vary.fixed) if name not in self.new and name not in self.held]
        self.table, self.say = table["points"], say
        self.points = {self._place(one["values"]): one for one in self.table}

    def _expect(self, what, there, here):
        if there != here:
            raise Refused(f"--known {self.path}: {what}: {there}, expected {here} as here")

    def _place(self, values):
        return tuple(values[name] for name in self.shared)

    def of(self, values):
        """Taken of a point at `values`; none: nothing is known."""
        point = None if self.beside else self.points.get(self._place(values))
        if not point:
            return None
        ran = {kind: {**{name: held for name, held in self.new.items()
                         if kind in KNOWN[name].acts_on and held != values[name]}, **ran_at(point, kind)}
               for kind in TESTS if any(kind_of(key) == kind for key in point["outputs"])}
        asked = set(point["outputs"]) if point.get("left") else self.asked
        return Taken(point, asked, {kind: one for kind, one in ran.items() if one})

    def own_points(self, design):
        """Lines of the table for points that stand beside those of the design ([values]): those that `of` gives to none
        of them. Says how many have values that this design does not."""
        taken = set() if self.beside else set(map(self._place, design))
        rest = [one for one in self.table if self._place(one["values"]) not in taken]
        inside = [one for one in rest if all(self._is_here(name, one["values"][name]) for name in self.shared)]
        if len(inside) < len(rest):
            self.say(f"--known {self.path}: {len(rest) - len(inside)} points left out: they lie outside the ranges, or "
                     "have another value of what is held here")
        return [self._own(one, where) for one, where in zip(inside, self.vary.points(len(inside)) if inside else ())]

    def _is_here(self, name, value):
        if name in self.vary.fixed:
            return value == self.vary.fixed[name]
        low, high = self.vary.ranges[name]
        return low <= value <= high

    def _own(self, one, where):
        """where: a point of the sequence, for what may have any value."""
        new = {name: where[name] if value == ANY else value for name, value in self.new.items()}
        return {**one, "label": "k" + one["label"], "values": {**one["values"], **new, **self.held},
                "seconds": dict.fromkeys(one["seconds"], 0.0),
                "known": Taken(one, self.asked, one.get("known", {}).get("ran_at", {})).entry}

    def check(self, design):
        """design: [values]. Refused where not one of its points is known."""
        if not self.beside and not any(self.of(values) for values in design):
            raise Refused(f"--known {self.path}: none of its {len(self.points)} points is one of this design, expected "
                          f"the ranges that it has of {', '.join(self.vary.names)}")


def difference(there, here):
    more, less = (sorted(set(a) - set(b)) for a, b in ((there, here), (here, there)))
    return "; ".join(f"{len(keys)} only {where}, as {keys[0]}" for keys, where in ((more, "there"), (less, "here"))
                     if keys)


def misfit(taken, rows):
    """rms of ln(DEM/measured) over the rows that are fitted and of curves, as far as they are known: how near a point
    is to what was measured before anything is run; infinite: not told."""
    errors = [math.log(taken.outputs[row.key]["value"] / row.value) for row in rows
              if taken and row.is_log and not row.held_out and row.key in taken.outputs]
    return math.sqrt(sum(e * e for e in errors) / len(errors)) if errors else math.inf
