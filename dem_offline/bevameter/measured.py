"""From runs to measured rows: curves in bins, CSVs and the file for ./grouser calibrate soil."""

import json
import math
import os
import statistics

import numpy
from bench import CONE_ANGLE, CONE_SPEED
from processes import write_atomically

BINS = 15  # rows of one curve
OVERLAP = 0.05  # over the radius: numerics.overlap of the examples


def binned(at, values, low, high):
    """Means of `values` (columns) in BINS equal bins of `at`; rows (at, values...)."""
    edges = numpy.linspace(low, high, BINS + 1)
    rows = []
    for a, b in zip(edges[:-1], edges[1:]):
        inside = (at > a) & (at <= b)
        if inside.any():
            rows.append([float(at[inside].mean()), *(float(v[inside].mean()) for v in values)])
    return rows


class Measured:
    """Everything that the runs of a bench have measured. results: {(name, seed): Result}."""

    def __init__(self, bench, results):
        self.bench, self.results = bench, {key: r for key, r in results.items() if r.done}

    def _each(self, name):
        return [(seed, result) for (one, seed), result in self.results.items() if one == name]

    def sinkage_rows(self, name, body, most):
        """[(bed, sinkage m, force N)] from half a grain on: above it single grains carry."""
        rows = []
        for seed, result in self._each(name):
            s = result.series
            rows += [(seed, z, f) for z, f in binned(s[f"{body}.sinkage_m"], [s[f"{body}.f_z_n"]],
                                                     0.5 * self.bench.soil.diameter, most) if f >= 0]
        return rows

    def shear_rows(self, name):
        """[(bed, turn rad, torque N m)] of the ring that turns under its load."""
        rows = []
        for seed, result in self._each(name):
            s = result.series
            turn = s["ring.turned_z_rad"]
            rows += [(seed, t, m) for t, m in binned(turn, [-s["ring.t_z_n_m"]], 0, turn[-1]) if m >= 0]
        return rows

    def cone(self):
        """Penetration resistance, force over base area, against depth of the base [m, Pa]: curves by
        bed; their mean from 0 to the depth reached is the cone index (ASABE S313 takes 0 to 150 mm), the slope of
        the line through each by least squares the gradient."""
        area = math.pi * self.bench.cone_radius**2
        curves = {}
        for seed, result in self._each("cone"):
            s = result.series
            depth = s["cone.sinkage_m"] - self.bench.cone_height
            inside = (depth >= 0) & (depth <= 0.15)
            curves[seed] = numpy.column_stack((depth[inside], s["cone.f_z_n"][inside] / area))
        if not curves:
            return None, {}
        each = [float(c[:, 1].mean()) for c in curves.values()]
        slopes = [float(numpy.polyfit(c[:, 0], c[:, 1], 1)[0]) for c in curves.values()]
        return {**summary(each), "unit": "Pa", "to_depth_m": float(min(c[-1, 0] for c in curves.values())),
                "gradient": {**summary(slopes), "unit": "Pa/m"}, "diameter_m": 2 * self.bench.cone_radius,
                "angle_deg": CONE_ANGLE, "speed_m_per_s": CONE_SPEED * self.bench.speed}, curves

    def repose(self):
        each = [math.degrees(r.series["repose.angle_rad"][-1]) for _, r in self._each("repose")]
        return {**summary(each), "unit": "deg"} if each else None

    def density(self):
        """Bulk densities [kg/m^3]: of the file, of the beds, poured, tapped."""
        soil = self.bench.soil
        grain = soil.grains["grain_density_kg_per_m3"]

        def of(names):
            by_seed = {seed: grain * float(r.record["bed"]["solid_fraction"])
                       for (name, seed), r in self.results.items() if name in names}
            return {**summary(list(by_seed.values())), "unit": "kg/m^3"} if by_seed else None
        found = {"bed": of(self.bench.bed_tests()), "poured": of(["poured"]), "tapped": of(["tapped"])}
        return {"soil_file": {**summary([soil.bulk_density]), "unit": "kg/m^3"},
                **{key: value for key, value in found.items() if value}}


def summary(each):
    """Mean and standard deviation over beds; none of one bed."""
    return {"value": statistics.fmean(each), "sd_of_beds": statistics.stdev(each) if len(each) > 1 else None,
            "beds": len(each)}


def large_overlaps(results):
    """{run: 99th percentile of the overlaps over the radius}, where it is above what the time step bears."""
    found = {r.plan.name: float(r.numerics["overlap_p99_over_radius"]) for r in results.values()}
    return {name: overlap for name, overlap in found.items() if overlap > OVERLAP}


def counts_as(span, diameter, beds):
    """Independent observations in a curve: one for a grain's diameter of way, by judgement."""
    return max(1, min(BINS, round(span / diameter))) * beds


def write_csv(path, header, rows):
    text = ",".join(header) + "\n" + "".join(",".join(f"{v:.6g}" for v in row) + "\n" for row in rows)
    write_atomically(path, text)


def entry(name, kind, file, columns, constants, count):
    return [f"  - name: {name}", f"    kind: {kind}", f"    file: {file}",
            "    columns: {" + ", ".join(f"{q}: {c}" for q, c in columns.items()) + "}",
            "    constants: {" + ", ".join(f"{q}: {v}" for q, v in constants.items()) + "}",
            f"    counts_as: {count}"]


def write_measurements(measured, folder, kind, engine):
    """CSVs and measurements.yaml in `folder`; its path, or None where no test tells of pressure or shear."""
    bench, d, tests = measured.bench, measured.bench.soil.diameter, []

    def add(name, kind_, header, rows, columns, constants, span):
        if rows:
            write_csv(os.path.join(folder, name + ".csv"), header, rows)
            tests.extend(entry(TITLES.get(name, name), kind_, name + ".csv", columns, constants,
                               counts_as(span, d, len({row[0] for row in rows}))))
    sunk = ("bed", "sinkage_m", "force_n")
    by_sinkage = {"sinkage": "sinkage_m", "force": "force_n"}
    for mm in bench.plates:
        rows = measured.sinkage_rows(f"plate{mm}", "plate", bench.plate_sinkage(mm))
        add(f"plate{mm}", "plate", sunk, rows, by_sinkage, {"diameter": f"{mm} mm"}, bench.plate_sinkage(mm) - d / 2)
    rows = measured.sinkage_rows("press", "wheel", bench.wheel_sinkage)
    radius, width = (f"{1e3 * size:.6g} mm" for size in (bench.wheel_radius, bench.wheel_width))
    add("press", "press", sunk, rows, by_sinkage, {"radius": radius, "width": width}, bench.wheel_sinkage - d / 2)
    inner, outer = bench.ring_radii
    for k, pressure in enumerate(bench.pressures):
        rows = measured.shear_rows(f"shear{k + 1}")
        arm = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2)
        add(f"shear{k + 1}", "shear", ("bed", "turn_rad", "torque_n_m"), rows,
            {"rotation": "turn_rad", "torque": "torque_n_m"},
            {"load": f"{pressure * bench.ring_area:.6g} N", "inner_radius": f"{1e3 * inner:.6g} mm",
             "outer_radius": f"{1e3 * outer:.6g} mm"}, arm * max((row[1] for row in rows), default=0))
    if not tests:
        return None
    bed = measured.density().get("bed")
    source = (f"virtual bevameter: DEM engine {engine}, soil file {os.path.basename(bench.soil.path)}, grains of "
              f"{1e3 * d:.3g} mm, {bench.beds} bed{'s' if bench.beds > 1 else ''}")
    lines = ["# Written by ./grouser bevameter.", "soil: " + json.dumps(f"{bench.soil.name}, DEM"),
             "source: " + json.dumps(source), f"kind: {kind}", f"density_kg_per_m3: {bed['value']:.6g}",
             f"gravity_m_per_s2: {bench.soil.gravity:.9g}", "tests:", *tests]
    path = os.path.join(folder, "measurements.yaml")
    write_atomically(path, "\n".join(lines) + "\n")
    return path


TITLES = {"press": "pressed wheel", "shear1": "shear ring 1", "shear2": "shear ring 2", "shear3": "shear ring 3"}
