"""Measured plates and a measured pressed wheel (--beside): what is pressed as it was measured, and the force of the runs
at the same sinkages."""

import math

import numpy
from experiment_runs import Refused

WINDOW = 0.25  # grain diameters to each side of a sinkage, over which a force is fitted by a line
STEP = 0.005   # [m] between the sinkages of the table


class Beside:
    """curves: {name of the bench's test: [(sinkage m, force N)] by sinkage}; press_wheel: (radius, width) [m] or none."""

    def __init__(self, read):
        """read: what `grouser-calibrate rows` says of every file."""
        found, self.press_wheel = {}, None
        for one in read:
            for row in one["observations"]:
                name, force = self._of(row, one["tests"][row["test_index"]])
                if name:
                    found.setdefault(name, []).append((row["sinkage_m"], force))
        self.curves = {name: sorted(rows) for name, rows in found.items()}

    def _of(self, row, test):
        if row["kind"] == "plate" and test["shape"] == "disc":
            return f"plate{2e3 * row['width_m']:.6g}", row["value"] * math.pi * row["width_m"]**2
        if row["kind"] != "press":
            return None, None
        self.press_wheel = same_wheel(self.press_wheel, test, "pressed")
        return "press", row["value"]

    def forces(self, bench, results):
        """[{test, sinkage_m, measured_n, value, sd_of_beds, beds}] at every STEP of sinkage that was measured and
        reached, from half a grain on."""
        rows, d = [], bench.soil.diameter
        for name, curve in self.curves.items():
            if name == "press" and (bench.wheel_radius, bench.wheel_width) != self.press_wheel:
                continue  # a wheel too narrow for the grains: another one was pressed
            series = [r.series for (one, _), r in results.items() if one == name and r.done]
            body = "wheel" if name == "press" else "plate"
            for k in range(math.ceil(0.5 * d / STEP), math.floor(curve[-1][0] / STEP + 1e-9) + 1):
                each = [force_at(one, body, k * STEP, WINDOW * d) for one in series]
                each = [force for force in each if force is not None]
                if each and k * STEP >= curve[0][0]:
                    rows.append({"test": name, "sinkage_m": k * STEP,
                                 "measured_n": float(numpy.interp(k * STEP, *zip(*curve))), "value": float(numpy.mean(each)),
                                 "sd_of_beds": float(numpy.std(each, ddof=1)) if len(each) > 1 else None,
                                 "beds": len(each)})
        return rows


def same_wheel(before, test, how):
    """(radius, width) [m] of a test's wheel. Raises Refused where another one was before."""
    wheel = test["radius_m"], test["width_m"]
    if before not in (None, wheel):
        raise Refused(f"{test['name']}: a second {how} wheel ({wheel[0]:g} m by {wheel[1]:g} m, the first "
                      f"{before[0]:g} by {before[1]:g}), expected one in all")
    return wheel


def force_at(series, body, sinkage, half_width):
    """Of a line through what was recorded within half_width [m] of a sinkage; none: not reached, or no force."""
    z, f = series[f"{body}.sinkage_m"], series[f"{body}.f_z_n"]
    near = numpy.abs(z - sinkage) <= half_width
    if near.sum() < 3 or z.max() < sinkage:
        return None
    value = float(numpy.polyval(numpy.polyfit(z[near] - sinkage, f[near], 1), 0.0))
    return value if value > 0 else None
