"""What is fitted: measured rows in blocks that count as independent, and a process for each from the table of runs."""

import math

import emulator
import numpy
from experiment_runs import Refused
from known import ran_at

# Share of the value (curves) or of load, load x radius and radius (wheels) that grains are typically off by: plates
# and pressed wheels as in surrogate/calibrate; wheels by what trial sets of grains missed (docs/calibration.md).
TYPICAL = {"plate": 0.10, "press": 0.10, "wheel f_x": 0.05, "wheel f_y": 0.07, "wheel torque": 0.05,
           "wheel sinkage": 0.08}
LEAST_RUNS = 4  # beyond twice the parameters
SAME = 1e-9     # of a range


def least_runs(columns):
    """That an emulator is fitted to."""
    return 2 * len(columns) + LEAST_RUNS


class Block:
    """Rows of one test that count as one observation. value: their mean, of the logarithm for curves; sd: of it, 0
    where none is stated; scale: what a share is of; run: blocks of one run err together."""

    def __init__(self, rows, radius):
        first = self.first = rows[0]
        self.rows, self.kind, self.group, self.is_log = rows, first.kind, first.group, first.is_log
        self.test, at = first.test, first.at
        self.run = {"plate": "plate {mm:g}", "press": "press"}.get(self.kind, "wheel {slip:g} {angle:g} {load:g}"
                                                                   ).format(**at)
        values = [self.compared(row.value) for row in rows]
        sds = [(row.sd or 0.0) / (row.value if self.is_log else 1.0) for row in rows]
        self.value, self.sd = float(numpy.mean(values)), float(numpy.mean(sds))
        self.scale = 1.0
        if not self.is_log:
            self.scale = {"sinkage": radius, "torque": radius * at["load"]}.get(first.measured, at["load"])
        self.typical = TYPICAL[self.group]

    def compared(self, value):
        return math.log(value) if self.is_log else value

    @property
    def name(self):
        if not self.is_log:
            return f"{self.run} {self.first.measured}"
        ends = [1e3 * self.rows[k].at["sinkage"] for k in (0, -1)]
        return f"{self.test} at {ends[0]:.4g}" + (f" to {ends[1]:.4g}" if ends[1] > ends[0] else "") + " mm"

    def of_runs(self, outputs):
        """What a point of the design gave, compared alike; nan: a row is missing."""
        if any(row.key not in outputs for row in self.rows):
            return math.nan
        return float(numpy.mean([self.compared(outputs[row.key]["value"]) for row in self.rows]))


def says_nothing(row):
    """The side force of a wheel that goes straight is zero by symmetry, whatever the grains."""
    return row.kind == "wheel" and row.measured == "f_y" and row.at["angle"] == 0


def blocks_of(targets, radius):
    """Fitted rows in blocks: as many for a curve as it counts."""
    found = []
    for test in targets.tests:
        own = [row for row in targets.rows if row.test == test["name"] and not row.held_out and not says_nothing(row)]
        if own and own[0].is_log:
            own.sort(key=lambda row: row.at["sinkage"])
            count = max(1, min(len(own), round(test["counts_as"] or len(own))))
            found += [Block([own[i] for i in part], radius) for part in numpy.array_split(range(len(own)), count)]
        else:
            found += [Block([row], radius) for row in own]
    return found


class Runs:
    """The table's points as arrays. unit(kind): coordinates in the unit cube at which that kind of test was run, the
    solid fraction as it was reached in its beds. unseen: kinds without an emulator, as their runs do not tell what a parameter that acts on
    them does: what it may do would be missing in every interval; notes: the same in words."""

    def __init__(self, table, vary):
        self.vary = vary
        self.points = [one for one in table["points"] if one["status"] != "failed"
                       and all(one["values"].get(name) == value for name, value in vary.fixed.items())]
        self._processes, self.notes, self.unseen = {}, [], set()

    def unit(self, kind):
        return numpy.array([self.vary.to_unit(self._reached(one, kind)) for one in self.points])

    def _reached(self, point, kind):
        values = {**point["values"], **ran_at(point, kind)}
        what = "wheels" if kind == "wheel" else "tests"
        whole, top = (point.get(key, {}).get(what) for key in ("solid_fraction", "top_solid_fraction"))
        upper = top or whole  # layers that are alike, or one too thin for a layer, are one bed
        if upper and "solid_fraction" in values:
            values["solid_fraction"] = upper
            if whole and values.get("denser_below"):
                values["denser_below"] = whole - upper
        return values

    def process(self, block, needed=True):
        """Fitted to a block's results; none where the runs never had it, or do not tell what each of
        its parameters does. Where too few points gave it: Refused, or
        none if it is not needed."""
        keys = tuple(row.key for row in block.rows)
        if self._processes.get(keys) is None:
            self._processes[keys] = self._fitted(block, needed)
        return self._processes[keys]

    def _fitted(self, block, needed):
        y = numpy.array([block.of_runs(one["outputs"]) for one in self.points])
        known = numpy.isfinite(y)
        if not known.any():
            return None
        x = self.unit(block.kind)
        columns, notes = self._columns(block.kind, x[known])
        least = least_runs(columns)
        if known.sum() < least and not needed:
            return None
        if known.sum() < least:
            raise Refused(f"{block.name}: {known.sum()} points of the design gave it, expected at least {least}: run "
                          "more points (--points, --budget)")
        if notes:
            self.notes += [note for note in notes if note not in self.notes]
            self.unseen.add(block.kind)
            return None
        return emulator.fit(x[known], y[known], columns)

    def _columns(self, kind, x):
        """(of the parameters that a kind of test depends on those that its runs tell apart, notes about the others).
        Where the runs are too few for all of these: without those that all but LEAST_RUNS - 1 or fewer have alike."""
        acting = self.vary.acting_on(kind)
        same = {k: int(numpy.unique((x[:, k] / SAME).round(), return_counts=True)[1].max()) for k in acting}
        seen = [k for k in acting if same[k] < max(len(x), 2)]
        if len(x) < least_runs(seen):
            seen = [k for k in seen if same[k] <= max(len(x) - LEAST_RUNS, len(x) / 2, 1)]
        return seen, [f"{kind}: {same[k]} of its {len(x)} runs have one {self.vary.names[k]}; what another does to it "
                      "is not seen: neither fitted nor predicted" for k in acting if k not in seen]


class Evidence:
    """Fitted blocks that the runs answer, with their processes; correlation: of the processes' errors."""

    def __init__(self, blocks, processes):
        self.blocks = [block for block, one in zip(blocks, processes) if one]
        self.processes = [one for one in processes if one]
        self.unanswered = [block for block, one in zip(blocks, processes) if not one]
        if not self.blocks:
            raise Refused("the design has no run of any row that is fitted, or none that tells what each parameter does: "
                          "another measurement file, or more points?")
        self.groups = list(dict.fromkeys(block.group for block in self.blocks))
        self.group = numpy.array([self.groups.index(block.group) for block in self.blocks])
        self.value, self.sd, self.scale = (numpy.array([getattr(block, name) for block in self.blocks])
                                           for name in ("value", "sd", "scale"))
        self.typical = numpy.array([TYPICAL[name] for name in self.groups])
        self.correlation = self._correlation()

    def _correlation(self):
        """Of leave-one-out errors within one run, drawn towards none as if four more runs had shown none."""
        n = len(self.blocks)
        result = numpy.eye(n)
        errors = []
        for one in self.processes:
            mean, sd = one.left_out()
            errors.append({tuple(x): z for x, z in zip(numpy.round(one.x, 9).tolist(), (one.y - mean) / sd)
                           if math.isfinite(z)})
        for i in range(n):
            for k in range(i):
                if self.blocks[i].run != self.blocks[k].run:
                    continue
                both = [(errors[i][x], errors[k][x]) for x in errors[i] if x in errors[k]]
                a, b = numpy.array(both).T
                share = float(a @ b) / math.sqrt(float(a @ a) * float(b @ b))
                result[i, k] = result[k, i] = share * len(both) / (len(both) + 4)
        values, vectors = numpy.linalg.eigh(result)
        result = vectors @ numpy.diag(numpy.maximum(values, 1e-3)) @ vectors.T
        scale = numpy.sqrt(numpy.diag(result))
        return result / scale[:, None] / scale[None, :]

    def clusters(self):
        """Indices of blocks that err together."""
        runs = dict.fromkeys(block.run for block in self.blocks)
        return [numpy.array([k for k, block in enumerate(self.blocks) if block.run == run]) for run in runs]

    def at(self, unit):
        """(means, sds of the surface) at (m, p): (m, n) each."""
        each = [one.at(unit) for one in self.processes]
        return numpy.column_stack([one[0] for one in each]), numpy.column_stack([one[1] for one in each])

    @property
    def noise(self):
        """Variance of one point's beds and runs: counted once, as all points stand on the same beds."""
        return numpy.array([one.noise for one in self.processes])
