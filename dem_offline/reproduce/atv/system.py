"""A non-driven all-terrain wheel towed at attack angles (reference 2; tests by Czapla et al.)."""

import math

import numpy
from matplotlib import pyplot

from rows import at_least, between, failed, mean_and_error, printed

TITLE = "All-terrain wheel at attack angles"
ABOUT = ("A rigid wheel without tread, 508 x 254 mm and 61.19 kg, is dropped on dry sand and its axle moved at "
         "0.5 m/s; the wheel plane stands at 0, 30, 60 or 90 degrees to the motion and the hub is free. Slip is "
         "rim speed over the speed along the wheel plane, less 1. Signs: longitudinal force against the motion, "
         "lateral force to the left of it, moment about the vertical, all by the sand on the wheel.")

RADIUS, MASS, GRAVITY, SPEED, DEPTH = 0.254, 61.19, 9.81, 0.5, 0.086
LOAD = MASS * GRAVITY
ANGLES = (0, 30, 60, 90)
LENGTH, WIDTH = 1.012, 0.412
STEADY_FROM_M = 0.12  # towed, before means are taken
STILL_FROM_S, DROP_S = 0.3, 0.7
PUBLISHED_DIAMETER = 0.0035

TRIED = ("tried against the skidding (-0.6 in an earlier campaign, whose files are gone): one bed each of "
         "20 mm grains in the published box, slip at 0 degrees and sinkage: -0.65 at 50 mm (as it falls, solid "
         "fraction 0.55), -0.2 at 23 mm (0.60), -0.15 at 17 mm (0.62), -0.08 at 13 mm (0.60, rolling friction "
         "twice as large), +0.03 at 9 mm (0.62 and that, chosen; 0.00 at 8 mm with 15 mm grains). Slip goes with "
         "sinkage. The mean moment about the hub is near zero throughout. Not measured, the likely "
         "mechanism: sand that is pushed up the front of a deep wheel holds its turning back. Packing and "
         "convention were chosen after these runs, so the slip row is no independent check of them")


class Level:
    """diameter: mean of the grains; seeds: beds of the published box; wide: angles on the long, wide
    bed, whose grains are wide_diameter large."""

    def __init__(self, diameter, softer, seeds, way, wide=(), wide_diameter=0.0):
        self.diameter, self.softer, self.seeds, self.way = diameter, softer, seeds, way
        self.wide, self.wide_diameter = wide, wide_diameter


LEVELS = {"quick": Level(0.022, 100, (1,), 0.3), "coarse": Level(0.015, 100, (1, 2, 3), 0.35, (0, 90), 0.018),
          "full": Level(PUBLISHED_DIAMETER, 1, (1, 2, 3), 0.4, ANGLES, PUBLISHED_DIAMETER)}
WIDE = (1.2, 0.7, 0.1)  # length, width, depth of the long, wide bed


def overrides(level, seed, angle, size, sides):
    (length, width, depth), walls = size, sides == "wall"
    d = level.diameter if walls else level.wide_diameter
    volume = math.pi / 6 * d**3 * 0.97  # of a grain, mean by number
    region = {"low_m": [0, 0, 0], "high_m": [length, width, 0.9]}
    fields = [round(length / (1.2 * d)), round(width / (1.2 * d)), 1]
    return {
        "seed": seed,
        "materials[0].youngs_modulus_pa": 7.5e8 / level.softer,
        "box.length_m": length, "box.width_m": width, "box.x": sides, "box.y": sides,
        "grains.count": math.ceil(0.64 * length * width * (depth + 2 * d) / volume),
        "grains.sizes": [{"diameter_m": round(f * d, 6), "mass_fraction": m}
                         for f, m in ((0.857, 0.33), (1.0, 0.34), (1.143, 0.33))],
        "preparation[1].height_m": depth,
        "bodies[0].position_m": [0.31, width / 2, 0],
        "bodies[0].turn_deg": [0, 0, angle],
        "bodies[0].motion[1].distance_m": level.way * (1 if walls else 1.6),
        "probes[3].region": region, "probes[3].n": fields,
        "probes[4].region": region, "probes[4].n": fields,
    }


def runs(name):
    level = LEVELS[name]
    box = [(f"box-{seed}-{angle}", "box.yaml", overrides(level, seed, angle, (LENGTH, WIDTH, DEPTH), "wall"))
           for seed in level.seeds for angle in ANGLES]
    return box + [(f"wide-1-{angle}", "box.yaml", overrides(level, 1, angle, WIDE, "periodic"))
                  for angle in level.wide]


# What is read from a run.

def angle_of(name):
    return math.radians(float(name.rsplit("-", 1)[1]))


def histories(result):
    """Way, forces in both frames [N], moment [N m], slip, sinkage of one run."""
    s, yaw = result.series, angle_of(result.plan.name)
    c, n = math.cos(yaw), math.sin(yaw)
    fx, fy = s["wheel.f_x_n"], s["wheel.f_y_n"]
    spin = -n * s["wheel.w_x_rad_per_s"] + c * s["wheel.w_y_rad_per_s"]
    speed = s["wheel.v_x_m_per_s"]
    scale = numpy.maximum(numpy.maximum(numpy.abs(spin * RADIUS), numpy.abs(speed)), 1e-9)
    return {"time": s["time_s"], "way": s["wheel.x_m"] - s["wheel.x_m"][0], "longitudinal": -fx, "lateral": fy,
            "vertical": s["wheel.f_z_n"], "moment": s["wheel.t_z_n_m"],
            "x_wheel": c * fx + n * fy, "y_wheel": -n * fx + c * fy,
            "slip": (spin * RADIUS - speed * c) / scale, "sinkage": s["wheel.sinkage_m"]}


def steady(result, key):
    """Mean over the tow, once its first part is over."""
    h = histories(result)
    return float(numpy.mean(h[key][h["way"] >= STEADY_FROM_M]))


def of_beds(results, angle, key, kind="box"):
    return [steady(r, key) for name, r in results.items()
            if name.startswith(kind) and name.endswith(f"-{angle}")]


def after_drop(results):
    """Vertical force from 0.3 s after the drop until the tow, a mean over the angles, by bed."""
    beds = {}
    for name, r in results.items():
        if name.startswith("box"):
            h = histories(r)
            still = (h["time"] > STILL_FROM_S) & (h["time"] <= DROP_S)
            beds.setdefault(name.split("-")[1], []).append(float(numpy.mean(h["vertical"][still])))
    return [sum(v) / len(v) for v in beds.values()]


def changed_words(name):
    level = LEVELS[name]
    return (f"grains {level.diameter / PUBLISHED_DIAMETER:.1f} times as large (mean diameter "
            f"{1e3 * level.diameter:g} mm), NORMK E {level.softer:g} times softer; speed as printed")


def changed(name):
    return [changed_words(name),
            "the packing, which is not printed, is dense: friction between grains is 0.02 while they settle, "
            "their own 0.6 after it",
            "the inertia of the wheel, not printed, is that of a full cylinder",
            "rolling friction 0.1 is taken on the full radius of a grain (0.2 on the reduced radius between grains, "
            "0.1 at wheel and walls); the paper does not say on which",
            TRIED]


def rows(results, level):
    words = changed_words(level)
    bad = [f"{name}: {r.reason}" for name, r in results.items() if not r.done]
    if bad:
        return [failed("runs that failed", "none", "0", words, "; ".join(bad))]
    coarse = level != "quick"
    note = "" if coarse else "one bed of few grains: printed only"
    force = {a: of_beds(results, a, "longitudinal") for a in ANGLES}
    side = {a: of_beds(results, a, "lateral") for a in ANGLES}
    turn = {a: of_beds(results, a, "moment") for a in ANGLES}
    mean = {key: {a: mean_and_error(v)[0] for a, v in by.items()}
            for key, by in (("force", force), ("side", side), ("turn", turn))}
    peak = max(ANGLES, key=lambda a: abs(mean["side"][a]))
    ratio = [b / a for a, b in zip(force[0], force[60])]
    out = [between("runs that failed", 0.0, 0, 0, "none", words),
           between("vertical force from 0.3 s after the drop [N]", after_drop(results), 0.98 * LOAD, 1.02 * LOAD,
                   600.3, words)]
    for a in ANGLES:
        out.append(between(f"vertical force in the tow at {a} deg [N]", of_beds(results, a, "vertical"),
                           0.98 * LOAD, 1.02 * LOAD, 600.3, words, note, held=coarse))
    out += [at_least("longitudinal force at 60 deg over that at 0", ratio, 1.5, ">= 1.5", words, note, held=coarse),
            between("longitudinal force at 90 deg over that at 60",
                    [b / a for a, b in zip(force[60], force[90])], 0.85, 1.15, "similar", words, note, held=coarse)]
    for a in (0, 90):
        out.append(between(f"lateral force at {a} deg over the load", [v / LOAD for v in side[a]], -0.05, 0.05, 0,
                           words, note, held=coarse))
    out += [at_least("lateral force at 30 deg over the load (size)", [abs(v) / LOAD for v in side[30]], 0.1,
                     ">= 0.1", words, note, held=coarse),
            between("angle of the largest lateral force [deg]", float(peak), 30, 60, "30 (test), 60 (simulation)",
                    words, "as in the test" if peak == 30 else "as in the paper's simulation", held=coarse),
            at_least("moment about the vertical: largest of 30 and 60 deg over the larger of 0 and 90 (sizes)",
                     max(abs(mean["turn"][30]), abs(mean["turn"][60]))
                     / max(abs(mean["turn"][0]), abs(mean["turn"][90]), 1e-9), 2, "near zero at 0 and 90",
                     words, note, held=coarse),
            between("towed slip at 0 deg", of_beds(results, 0, "slip"), -0.2, 0, "-0.2 to 0 (not published)", words,
                    note, held=coarse)]
    for a in ANGLES:
        for key, unit, values in (("longitudinal force", "N", force[a]), ("lateral force", "N", side[a]),
                                  ("moment about the vertical", "N m", turn[a]),
                                  ("sinkage", "m", of_beds(results, a, "sinkage"))):
            out.append(printed(f"{key} at {a} deg [{unit}]", values, "figure", words))
        wide = of_beds(results, a, "longitudinal", "wide")
        if wide:
            out.append(printed(f"longitudinal force at {a} deg on a long, wide bed of "
                               f"{1e3 * LEVELS[level].wide_diameter:g} mm grains [N]", wide, "-", words))
    return out


# Pictures.

def smooth(values, n=9):
    window = numpy.ones(min(n, len(values)))
    counts = numpy.convolve(numpy.ones(len(values)), window, mode="same")  # fewer at either end
    return numpy.convolve(values, window, mode="same") / counts


def history_figure(results, keys, kind="box-1"):
    figure, axes = pyplot.subplots(1, len(keys), figsize=(4.2 * len(keys), 3.2), layout="constrained")
    for name, r in results.items():
        if not name.startswith(kind + "-") or not r.done:
            continue
        h = histories(r)
        tow = h["way"] > 0.005
        for axis, (key, label) in zip(axes, keys):
            axis.plot(h["way"][tow], smooth(h[key][tow]), lw=1, label=f"{name.rsplit('-', 1)[1]} deg")
            axis.set_xlabel("way [m]")
            axis.set_ylabel(label)
    axes[0].legend()
    return figure


def map_figure(results):
    names = [n for n in results if n.startswith("box-1-") and results[n].done]
    figure, axes = pyplot.subplots(2, len(names), figsize=(3.4 * len(names), 3.6), layout="constrained",
                                   squeeze=False)
    image = None
    for k, name in enumerate(names):
        begin, end = results[name].table("surface"), results[name].table("surface_end")
        first = begin["time_s"] == begin["time_s"][0]
        flat = numpy.nanmedian(begin["height_m"][first])
        for row, (table, pick) in enumerate(((begin, first), (end, slice(None)))):
            x, y, z = (table[c][pick] for c in ("x_m", "y_m", "height_m"))
            grid = (z - flat).reshape(len(set(x)), len(set(y)))
            image = axes[row][k].pcolormesh(sorted(set(x)), sorted(set(y)), 1e3 * grid.T, vmin=-50, vmax=50,
                                            cmap="RdBu_r", shading="nearest")
            axes[row][k].set_aspect("equal")
            axes[row][k].set_title(f"{name.rsplit('-', 1)[1]} deg, {('drop', 'tow')[row]}", fontsize=9)
    figure.colorbar(image, ax=axes, label="height over the prepared surface [mm]")
    return figure


def figures(results, _level):
    motion = (("longitudinal", "longitudinal force [N]"), ("lateral", "lateral force [N]"),
              ("vertical", "vertical force [N]"), ("moment", "moment about z [N m]"))
    wheel = (("x_wheel", "along the wheel plane [N]"), ("y_wheel", "along the axle [N]"), ("slip", "slip"),
             ("sinkage", "sinkage [m]"))
    out = [("Histories in the frame of the motion", history_figure(results, motion), "Means over 45 ms; bed 1."),
           ("Histories in the frame of the wheel", history_figure(results, wheel),
            "Slip (r w - v cos b)/max(|r w|, v), b the attack angle.")]
    if any(r.done for n, r in results.items() if n.startswith("box-1-")):
        out.append(("Vertical displacement of the surface", map_figure(results),
                    "After the drop and after the tow, in the published box; motion to the right."))
    return out
