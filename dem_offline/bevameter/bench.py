"""The tests of the bevameter: the example experiments with a soil and sizes put over them.

All tests of a bed stand on the same grains: one box, one depth, one seed. So what one run has found
for its preparation holds for the others. Sizes are those of the examples for grains of 8 mm,
larger where grains are (a shallow bed of few grains does not pack loosely); speeds go with sqrt(g d)."""

import math
import os
import re

from experiment_runs import Plan, Refused

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
EXPERIMENTS = os.path.join(ROOT, "dem_offline", "experiments")
LEAST_GRAINS = 5.0      # across a plate, a pressed wheel
RING_GRAINS = 3.5       # across the ring
EXAMPLE_DIAMETER = 0.008  # [m] of the grains that the examples' sizes are for
TAPS, TAP_OVER_GRAVITY, TAP_DIAMETERS = 30, 3.0, 0.05  # number, acceleration, amplitude
CONE_RADIUS, CONE_SPEED = 0.016, 0.05  # [m], [m/s] of the example's cone
CONE_ANGLE = 60         # [deg] between opposite flanks
SHEAR_DEPTHS = (0.08, 0.16, 0.32)  # [m] of soil whose weight is the pressure on the ring
SINKAGE = 0.03          # [m] of plates and wheel; plates from 60 mm: half their diameter
SIDE = 2.25             # of the box over the widest plate
CHORDS = 2.0            # of the box over the chord of a given wheel at its greatest sinkage
TEST_NAMES = "plateNN (NN: its diameter in mm), press, shear, cone, repose, density"


def default_plates(diameter):
    """[mm] the two smallest multiples of 20 mm, from 40 on, of at least LEAST_GRAINS grains."""
    first = max(40, 20 * math.ceil(round(1e3 * LEAST_GRAINS * diameter / 20, 6)))
    return [first, first + 20]


class Bench:
    """Plans of all chosen tests. chosen: names; beds: seeds 1 to that. As another bench had them: wheel, radius
    and width [m] of the pressed wheel, with a box for its chord; sinkages [m] by the name of a test;
    wheel_friction, where the pressed wheel is of another material than the other tools."""

    def __init__(self, soil, chosen, beds, quick, tool_friction=None, depth=None, wheel=None, sinkages=None,
                 wheel_friction=None):
        self.soil, self.beds, self.quick = soil, beds, quick
        d = soil.diameter
        self.plates = [float(name[5:]) for name in chosen if name.startswith("plate")]
        self.plates = [int(mm) if mm.is_integer() else mm for mm in self.plates]
        self.sinkages = sinkages or {}
        self.names = chosen
        self.grain_scale = max(1.0, d / EXAMPLE_DIAMETER)
        self.wheel_radius, self.wheel_width = wheel or (max(0.05, LEAST_GRAINS * d),) * 2
        self.ring = max(1.0, RING_GRAINS * d / 0.03)  # scale of the example's
        self.cone_radius = max(CONE_RADIUS, 2 * d)
        widest = 1e-3 * max(self.plates, default=0)
        self.depth = depth or max(0.12 * self.grain_scale, 1.25 * widest, 3 * max(self.sinkages.values(), default=0))
        self.side = max(0.18 if depth is None else 0, SIDE * widest, 0.18 * self.ring if "shear" in chosen else 0,
                        0.18 * self.cone_radius / CONE_RADIUS if "cone" in chosen else 0,
                        CHORDS * self.chord if wheel and "press" in chosen else 0)
        self.speed = math.sqrt(soil.gravity * d / (9.81 * EXAMPLE_DIAMETER))  # over the examples'
        if "cone" in chosen and self.cone_travel < self.cone_height + soil.largest:
            least = self.cone_height + 5 * soil.largest
            raise Refused(f"--depth {self.depth:g}: a bed for the cone, expected at least {least:.3g} m")
        self.settings = soil.settings(tool_friction)
        self.tool_friction = soil.grains["friction"] if tool_friction is None else tool_friction
        self.wheel_settings = self.settings if wheel_friction is None else soil.settings(wheel_friction)
        self.pressures = [soil.bulk_density * soil.gravity * h
                          for h in (SHEAR_DEPTHS[::2] if quick else SHEAR_DEPTHS)]

    # What is pressed and turned.
    def plate_sinkage(self, mm):
        return min(self.sinkages.get(f"plate{mm}", max(SINKAGE, 0.5e-3 * mm)), self.depth / 3)

    @property
    def wheel_sinkage(self):
        return min(self.sinkages.get("press", max(SINKAGE, 0.5 * self.wheel_radius)), self.depth / 3)

    @property
    def chord(self):
        """Of the pressed wheel in the plane of the bed, at its greatest sinkage [m]."""
        z = min(self.wheel_sinkage, self.wheel_radius)
        return 2 * math.sqrt(z * (2 * self.wheel_radius - z))

    @property
    def cone_travel(self):
        """Of the tip: it stays four grains above the floor, as in the example."""
        return self.depth - 4 * self.soil.largest

    @property
    def cone_height(self):
        return self.cone_radius / math.tan(math.radians(CONE_ANGLE / 2))

    @property
    def ring_radii(self):
        return 0.03 * self.ring, 0.06 * self.ring

    @property
    def ring_area(self):
        inner, outer = self.ring_radii
        return math.pi * (outer**2 - inner**2)

    def _lower(self, sinkage, speed):
        way = sinkage + 0.001 + self.soil.largest  # the plane of sinkage 0 lies under the grains' tops
        return {"do": "lower", "speed_m_per_s": speed * self.speed, "ramp_s": 0.05, "distance_m": way}

    def _on_bed(self, name, file, seed, body, packed_with):
        scale = max(self.grain_scale, self.ring, self.wheel_radius / 0.05, self.cone_radius / 0.016)
        settings = self.wheel_settings if name == "press" else self.settings
        sets = {"seed": seed, **settings, "grains": self.soil.bed(self.depth, packed_with),
                "box.length_m": self.side, "box.width_m": self.side, "box.height_m": self.depth + 0.2 * scale,
                "bodies[0].position_m": [self.side / 2, self.side / 2, 0], "bodies[0].material": "tool",
                "output": {"sample_s": 0.01 / self.speed}}
        sets.update({f"bodies[0].{key}": value for key, value in body.items()})
        return Plan(f"{name}_bed{seed}", os.path.join(EXPERIMENTS, file), sets)

    def _plate(self, mm):
        return "plate.yaml", {"parts": {"shape": "cylinder", "radius_m": 0.5e-3 * mm, "length_m": 0.01},
                              "motion": [self._lower(self.plate_sinkage(mm), 0.03)]}

    def _press(self):
        return "wheel_press.yaml", {"parts": {"shape": "wheel", "radius_m": self.wheel_radius,
                                              "width_m": self.wheel_width},
                                    "motion": [self._lower(self.wheel_sinkage, 0.03)]}

    def _cone(self):
        r = self.cone_radius
        return "cone.yaml", {"parts": {"shape": "cone", "radius_m": r, "height_m": self.cone_height,
                                       "shaft_radius_m": 0.625 * r, "shaft_length_m": self.cone_travel},
                             "motion": [self._lower(self.cone_travel - 0.001 - self.soil.largest, CONE_SPEED)]}

    def _shear(self, pressure):
        inner, outer = self.ring_radii
        load = pressure * self.ring_area
        height = 0.01 * self.ring
        size = {"inner_radius_m": inner, "outer_radius_m": outer, "height_m": height}
        return "shear_ring.yaml", {
            "parts": [{"shape": "ring", **size},
                      {"shape": "vanes", "count": 12, **size, "thickness_m": 0.002 * self.ring}],
            "motion": [{"do": "lower", "speed_m_per_s": 0.05 * self.speed, "force_n": load / 2},
                       {"do": "hold_force", "hold_force_n": load, "for_s": 0.4},
                       {"do": "turn", "axis": "z", "rate_deg_per_s": 30 * self.speed / self.ring, "ramp_s": 0.1,
                        "hold_force_n": load, "angle_deg": 40}]}

    def bed_tests(self):
        """{name of a run, without its bed: (file, keys of the body)}."""
        tests = {f"plate{mm}": self._plate(mm) for mm in self.plates}
        if "press" in self.names:
            tests["press"] = self._press()
        if "shear" in self.names:
            tests.update({f"shear{k + 1}": self._shear(p) for k, p in enumerate(self.pressures)})
        if "cone" in self.names:
            tests["cone"] = self._cone()
        return tests

    def on_bed(self, name, seed, packed_with=None):
        file, body = self.bed_tests()[name]
        return self._on_bed(name, file, seed, body, packed_with)

    def _repose(self, seed):
        """The example's heap, its lengths those of the grains."""
        s = self.soil.diameter / EXAMPLE_DIAMETER
        region = {"low_m": [0.24 * s, 0.24 * s, 0], "high_m": [0.36 * s, 0.36 * s, 0.4 * s], "radius_m": 0.06 * s}
        tube = {"shape": "tube", "radius_m": 0.06 * s, "length_m": 0.4 * s, "wall_m": 0.003 * s}
        lift = {"do": "lift", "speed_m_per_s": 0.1 * self.speed, "ramp_s": 0.2, "distance_m": 0.25 * s}
        return Plan(f"repose_bed{seed}", os.path.join(EXPERIMENTS, "repose.yaml"), {
            "seed": seed, **self.settings, "grains": self.soil.poured(1500 if self.quick else 3000, region=region),
            "box.length_m": 0.6 * s, "box.width_m": 0.6 * s, "box.height_m": 0.45 * s,
            "bodies[0].parts": tube, "bodies[0].position_m": [0.3 * s, 0.3 * s, 0.2 * s],
            "bodies[0].motion": [lift, {"do": "wait", "rest": "1e-6", "most_s": 5}],
            "probes": [{"kind": "repose"}, {"kind": "rest"}]})

    def _density(self, seed, tapped):
        d, s = self.soil.diameter, self.soil.diameter / EXAMPLE_DIAMETER
        amplitude = TAP_DIAMETERS * d
        frequency = math.sqrt(TAP_OVER_GRAVITY * self.soil.gravity / amplitude) / (2 * math.pi)
        shake = {"do": "shake", "amplitude_m": [0, 0, amplitude], "frequency_hz": frequency, "for_s": TAPS / frequency}
        settle = {"do": "settle"}
        return Plan(f"{'tapped' if tapped else 'poured'}_bed{seed}", os.path.join(EXPERIMENTS, "density.yaml"), {
            "seed": seed, **self.settings, "grains": self.soil.poured(1000 if self.quick else 2000),
            "box.length_m": (0.08 if self.quick else 0.1) * s, "box.width_m": (0.08 if self.quick else 0.1) * s,
            "box.height_m": 0.35 * s, "preparation": [settle, shake, settle] if tapped else [settle]})

    def off_bed(self):
        seeds = range(1, self.beds + 1)
        plans = [self._repose(seed) for seed in seeds] if "repose" in self.names else []
        if "density" in self.names:
            plans += [self._density(seed, tapped) for seed in seeds for tapped in (False, True)]
        return plans


def packing_of(result):
    """Frictions with which the bed of a run settled and, where there is one, its top layer: for each the keys of
    `preparation`; none where unknown."""
    bed = result.record["bed"]

    def layer(prefix):  # as text: every digit, so that the same bed comes again
        return {key: repr(float(bed.get(f"{prefix}preparation_{key}", 0))) for key in ("friction", "rolling_friction")}
    if not float(bed.get("preparation_friction", 0)) > 0:
        return None
    return [layer(""), layer("top_")] if float(bed.get("top_solid_fraction", 0)) > 0 else [layer("")]


def first_on(bench, seed, execution):
    """The test that finds the preparation of a bed: one that has done so before, else the first."""
    plans = [bench.on_bed(name, seed) for name in bench.bed_tests()]
    return next((plan for plan in plans if execution.is_done(plan)), plans[0])


def wheel_for(soil, measured):
    """The measured pressed wheel (radius, width) [m], where it is wide enough for the grains; else none."""
    return measured if measured and measured[1] >= LEAST_GRAINS * soil.diameter * (1 - 1e-9) else None


def choose(text, soil):
    """Names of tests of a comma-separated list; none: all."""
    d = soil.diameter
    if not text:
        return [f"plate{mm}" for mm in default_plates(d)] + ["press", "shear", "cone", "repose", "density"]
    names = list(dict.fromkeys(one.strip() for one in text.split(",") if one.strip()))
    for name in names:
        plate = re.fullmatch(r"plate([1-9]\d*)", name)
        if not plate and name not in ("press", "shear", "cone", "repose", "density"):
            raise Refused(f"--tests: unknown test '{name}', expected {TEST_NAMES}")
        if plate and 1e-3 * int(plate[1]) < LEAST_GRAINS * d * (1 - 1e-9):
            raise Refused(f"--tests {name}: {int(plate[1])} mm across, expected at least "
                          f"{1e3 * LEAST_GRAINS * d:.3g} mm, {LEAST_GRAINS:g} grains of {1e3 * d:.3g} mm")
    if not names:
        raise Refused(f"--tests '{text}': none, expected {TEST_NAMES}")
    return names
