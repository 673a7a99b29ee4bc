"""What the posterior predicts for every measured row that enough runs answer, fitted or held out."""

import math

import numpy
from evidence import TYPICAL, Block, says_nothing

Z90 = 1.645       # two-sided 90 % of a normal distribution
HALF_RADIAN = 0.5  # [rad] of a wheel's motion, over which the error of the form counts once more


class Reach:
    """How far a row lies beyond what was fitted of its kind: in doublings of sinkage or size for curves, in half
    radians from the nearest fitted motion for wheels (as surrogate/calibrate/soil_fit.h)."""

    def __init__(self, blocks):
        self.ends, self.motions = {}, []
        for block in blocks:
            for row in block.rows:
                if row.kind == "wheel":
                    self.motions.append(motion(row))
                    continue
                for axis in ("sinkage", "mm"):
                    if axis in row.at:
                        low, high = self.ends.get((row.kind, axis), (math.inf, 0.0))
                        self.ends[row.kind, axis] = min(low, row.at[axis]), max(high, row.at[axis])

    def beyond(self, row):
        if row.kind == "wheel":
            if not self.motions:
                return 0.0
            return min(angle_between(motion(row), one) for one in self.motions) / HALF_RADIAN
        most = 0.0
        for axis in ("sinkage", "mm"):
            low, high = self.ends.get((row.kind, axis), (None, None))
            if axis in row.at and low:
                most = max(most, math.log2(row.at[axis] / high), math.log2(low / row.at[axis]))
        return most


def motion(row):
    """Unit vector along (v_x, v_y, r w) of slip (r w - V cos b)/max(|r w|, V); V = 1 or r w = 1."""
    slip, angle = row.at["slip"], math.radians(row.at["angle"])
    rim = slip + math.cos(angle)  # V = 1 >= |r w|
    v = 1.0
    if abs(rim) > 1:
        sign = math.copysign(1.0, rim)
        v, rim = ((sign - slip) / math.cos(angle) if abs(math.cos(angle)) > 1e-9 else 0.0), sign
    one = numpy.array([v * math.cos(angle), v * math.sin(angle), rim])
    return one / numpy.linalg.norm(one)


def angle_between(a, b):
    return math.acos(max(-1.0, min(1.0, float(a @ b))))


def draws_of_share(evidence, posterior, group, random):
    """Of the form's error in a group; of one without a fitted row the typical error."""
    if group in evidence.groups:
        return posterior.share[:, evidence.groups.index(group)]
    return TYPICAL[group] * numpy.sqrt(2 / random.chisquare(2, len(posterior.u)))


def rows_of(targets, runs, evidence, posterior, radius):
    """A dictionary a row, in the order of the file. sd_grains: of what is not known of the parameters; sd_runs: of
    emulator and beds; low90, high90: for one measurement."""
    reach, random, found = Reach(evidence.blocks), numpy.random.default_rng(1), []
    shares = {}
    for row in targets.rows:
        block = Block([row], radius)
        zero = says_nothing(row)
        process = None if zero else runs.process(block, needed=False)
        entry = {"test": row.test, "kind": row.kind, "measured": row.measured, "key": row.key, "held_out": row.held_out,
                 **row.at, "value": row.value, "sd": row.sd, "zero_by_symmetry": zero}
        found.append(entry)
        if process is None:
            continue
        mean, sd = process.at(posterior.u)
        share = shares.setdefault(row.group, draws_of_share(evidence, posterior, row.group, random))
        form = share * block.scale * (1 + reach.beyond(row))
        runs_sd = math.sqrt(float(numpy.mean(sd**2)) + process.noise)
        # The share has no variance before many rows are seen: quantiles of draws, not a sum of squares.
        drawn = mean + random.standard_normal(len(mean)) * numpy.sqrt(sd**2 + process.noise + form**2 + block.sd**2)
        low, high = numpy.quantile(drawn, [0.05, 0.95])
        back = math.exp if row.is_log else float
        entry.update(model=back(float(mean.mean())), low90=back(float(low)), high90=back(float(high)),
                     sd_grains=float(mean.std()), sd_runs=runs_sd, sd_form=float(numpy.median(form)))
        entry["held"] = bool(entry["low90"] <= row.value <= entry["high90"])
    return found


def errors_of(rows):
    """rms of what was fitted and what was predicted, never mixed, by test and measured number."""
    table = []
    for name in dict.fromkeys((row["test"], row["measured"]) for row in rows):
        own = [row for row in rows if (row["test"], row["measured"]) == name and not row["zero_by_symmetry"]]
        entry = {"test": name[0], "measured": name[1], "not_run": sum("model" not in row for row in own)}
        for held_out in (False, True):
            some = [row for row in own if row["held_out"] is held_out and "model" in row]
            summary = {"n": len(some), "rms": None, "relative_rms": None, "covered90": None}
            if some:
                errors = numpy.array([row["model"] - row["value"] for row in some])
                summary["rms"] = float(numpy.sqrt(numpy.mean(errors**2)))
                summary["covered90"] = float(numpy.mean([row["held"] for row in some]))
                if some[0]["kind"] != "wheel":
                    values = numpy.array([row["value"] for row in some])
                    summary["relative_rms"] = float(numpy.sqrt(numpy.mean((errors / values)**2)))
            entry["held_out" if held_out else "fitted"] = summary
        table.append(entry)
    return table
