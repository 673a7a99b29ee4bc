"""Annular shear cell: McCarthy, Jasti, Marinack, Higgs, Powder Technol. 203 (2010) 70."""

import copy
import math
import os

import matplotlib.pyplot as plt
import numpy
import yaml

import rows as r

TITLE = "Annular shear cell (McCarthy, Jasti, Marinack, Higgs 2010)"
ABOUT = (
    "Steel balls of 4.76 mm between a wheel with hemispheres on its rim, which turns, and a rim that "
    "stands. Which details of a contact model matter? Variants are named as in the paper: normal law "
    "N plastic (Thornton) or n Hertz spring with the damper beta a da/dt (Oden-Martins); dissipation "
    "D as in drop tests or d more than that; friction F Mindlin-Deresiewicz or f a linear spring; "
    "rolling friction R 0.01, R' 0.5 or r none; head space 3d exact, 3D wide, 2D a plane; balls S of "
    "slight asphericity or s spheres. The figures of the paper are curves whose numbers this project "
    "does not have, so rows compare what the paper says in words.")

HERE = os.path.dirname(os.path.abspath(__file__))
CELL = os.path.join(os.pardir, os.pardir, "experiments", "shear_cell.yaml")
PLANAR = "planar.yaml"
DROP = "drop.yaml"

WHEEL_M, RIM_M, DIAMETER_M = 0.085725, 0.142875, 0.0047625
STEEL_PA, POISSON, YIELD_N = 193e9, 0.29, 48.0
# beta a da/dt of the drop tests [kg/(m s)] with steel's stiffness: the restitution between two balls
# is that of the plastic law between 2 and 3 m/s.
BETA = 1.0e6
MORE = {"N": 0.1, "n": 5.0}  # d: yield force and beta, over those of D
ROLLING = {"R": 0.01, "R'": 0.5, "r": 0.0}

# Young's modulus [Pa], turns of the wheel before the mean and in it, trials.
LEVELS = {
    "quick": {"modulus": 6e6, "before": 0.8, "mean": 0.6, "trials": 1},
    "coarse": {"modulus": 6e6, "before": 1.6, "mean": 1.6, "trials": 3},
    "full": {"modulus": 193e7, "before": 20.0, "mean": 20.0, "trials": 5},
}
# Profiles swing by 14 % (velocity) and 20 % (temperature) from one tenth of a second to the next:
# cases of rows within 10 % have longer means in the coarse form.
LONG = {"before": 2.0, "mean": 5.2}
LONG_CASES = ("NDFR3dS", "NDfR3dS", "220rpm", "270rpm")
BASE = "NDFR3dS"
VARIANTS = ("NdFR3dS", "nDFR3dS", "ndFR3dS", "NDfR3dS", "NDFr3dS", "NDFR'3dS", "NDFR3ds",
            "NDFR3DS", "NDFR2Ds")
VARIANTS_FULL = ("NDfr3dS", "ndfr3dS", "nDfR3dS", "ndFR2Ds")
COARSE_ONCE = ("NdFR3dS", "NDFr3dS", "NDFR3DS")  # printed only
QUICK = ("ndFR3dS", "NDFR2Ds", "NDFR3ds")
RPM, SPACING, FRACTION = 240, 0.6, 0.75
OTHER_RPM, OTHER_SPACING, OTHER_FRACTION = (220, 270), (0.0, 1.0), (0.65, 0.708)


def load(file):
    with open(os.path.join(HERE, file), encoding="utf-8") as stream:
        return yaml.safe_load(stream)


def laws_of(variant, modulus):
    """Laws and interface of a variant at a Young's modulus. Yield force and beta go with it, so
    that restitution against speed stays: F_y ~ E^(2/5), beta ~ E^(4/5)."""
    soft = modulus / STEEL_PA
    normal, more = variant[0], variant[1] == "d"
    rolling = ROLLING[variant[3:variant.index("3" if "3" in variant else "2")]]
    factor = MORE[normal] if more else 1.0
    interface = {"between": ["steel", "steel"], "restitution": 1, "friction": 0.3,
                 "rolling_friction": rolling}
    if normal == "N":
        law = "elasto_plastic"
        interface[law] = {"yield_force_n": YIELD_N * factor * soft ** 0.4}
    else:
        law = "hertz_oden_martins"
        interface[law] = {"damping_kg_per_m_s": BETA * factor * soft ** 0.8}
    tangential = "mindlin_deresiewicz" if variant[2] == "F" else "linear_history"
    if tangential == "linear_history":
        # 8 G* a, with which F begins, over the secant 4/3 E* a of the normal spring: 6 G*/E*.
        interface[tangential] = {"stiffness_ratio": 3 * (1 - POISSON) / (2 - POISSON)}
    return {"normal": law, "tangential": tangential, "rolling": "own_spin"}, interface


def changes(variant, level, rpm=RPM, spacing=SPACING, fraction=FRACTION, seed=1, turns=None):
    """(file, {key: value}) of a run of the cell."""
    planar = "2D" in variant
    file = PLANAR if planar else CELL
    spec = load(file)
    what = {**LEVELS[level], **(turns or {})}
    laws, interface = laws_of(variant, what["modulus"])
    grains = copy.deepcopy(spec["grains"])
    grains["areal_fraction"] = fraction
    if variant.endswith("s"):
        grains.pop("clump", None)
    parts = copy.deepcopy(spec["bodies"][0]["parts"])
    parts[1]["spacing"] = spacing
    turn_s = 60 / rpm  # windows in turns, so that normalised profiles compare at any rotation
    sets = {"seed": seed, "laws": laws, "interfaces[0]": interface,
            "materials[0].youngs_modulus_pa": what["modulus"], "bodies[0].parts": parts,
            "bodies[0].motion[0].rate_deg_per_s": rpm * 6.0, "bodies[0].motion[0].for_s": (what["before"] + what["mean"]) * turn_s,
            "bodies[0].motion[0].ramp_s": 0.4 * turn_s, "probes[0].every_s": what["mean"] * turn_s / 5,
            "probes[0].from_s": what["before"] * turn_s}
    if "3D" in variant:
        high = 4 * DIAMETER_M
        grains["region"]["high_m"][2] = high
        region = copy.deepcopy(spec["probes"][0]["region"])
        region["high_m"][2] = high
        roof = spec["bodies"][2]["position_m"][:2] + [high]
        sets.update({"box.height_m": high, "probes[0].region": region,
                     "bodies[2].position_m": roof})
    sets["grains"] = grains
    return file, sets


def cases(level):
    """{name: (variant, other keys of `changes`)} of one trial."""
    if level == "quick":
        return {v: (v, {}) for v in (BASE, *QUICK)}
    out = {v: (v, {}) for v in (BASE, *VARIANTS, *(VARIANTS_FULL if level == "full" else ()))}
    out.update({f"{rpm}rpm": (BASE, {"rpm": rpm}) for rpm in OTHER_RPM})
    out.update({f"R{s:g}": (BASE, {"spacing": s}) for s in OTHER_SPACING})
    out.update({f"nu{f:g}": (BASE, {"fraction": f}) for f in OTHER_FRACTION})
    return out


def trials(name, level):
    """What no row needs runs once in the coarse form."""
    alone = name in COARSE_ONCE or name.startswith("nu")
    return 1 if level == "coarse" and alone else LEVELS[level]["trials"]


def runs(level):
    out = []
    for normal in "Nn":
        laws, interface = laws_of(normal + "DFr3ds", STEEL_PA)
        out.append((f"drop-{normal}", DROP, {"laws": laws, "interfaces[0]": interface}))
        modulus = LEVELS[level]["modulus"]
        laws, interface = laws_of(normal + "DFr3ds", modulus)
        soft = modulus / STEEL_PA
        out.append((f"drop-{normal}-soft", DROP,
                    {"laws": laws, "interfaces[0]": interface, "duration_s": 3e-4 + 5e-5 * soft ** -0.4,
                     "materials[0].youngs_modulus_pa": modulus}))
    for trial in range(LEVELS[level]["trials"]):
        for name, (variant, other) in cases(level).items():
            if trial >= trials(name, level):
                continue
            file, sets = changes(variant, level, seed=trial + 1, **other,
                                 turns=LONG if level == "coarse" and name in LONG_CASES else None)
            out.append((f"{name.replace(chr(39), 'p')}-{trial + 1}", file, sets))
    return out


# What the runs say.

def restitution(result):
    """(speeds, on a plate, between balls) of a drop test."""
    first = numpy.genfromtxt(os.path.join(HERE, "drop.csv"), delimiter=",", names=True)
    v = result.table("balls")["v_z_m_per_s"][numpy.argsort(result.table("balls")["id"])]
    n = len(first) // 3
    speed = -first["v_z"][:n]
    return speed, v[:n] / speed, (v[n + 1::2] - v[n::2]) / speed


class Profile:
    """Means over the steady time of one run, normalised: radius by the gap, velocity by the rim of
    the wheel, temperature by its square."""

    def __init__(self, result, rpm):
        t = result.table("rings")
        n = len(set(t["low_m"]))
        ring = {k: v.reshape(-1, n) for k, v in t.items()}
        count = ring["grains"]
        self.count = count.mean(axis=0)
        self.total = count.sum(axis=1)
        self.radius = (0.5 * (ring["low_m"] + ring["high_m"])[0] - WHEEL_M) / (RIM_M - WHEEL_M)
        speed = 2 * math.pi * rpm / 60 * WHEEL_M
        weight = count / numpy.maximum(self.count, 1e-9) / len(count)
        self.fraction = ring["areal_fraction"].mean(axis=0)
        self.velocity = (weight * ring["v_t_m_per_s"]).sum(axis=0) / speed
        self.temperature = (weight * ring["temperature_m2_per_s2"]).sum(axis=0) / speed ** 2


class Profiles:
    """{case: [Profile of each trial]} and the grains of each run."""

    def __init__(self, results, level):
        self.level = level
        self.of, self.grains, self.failed = {}, {}, []
        for name, (variant, other) in cases(level).items():
            file_name = name.replace("'", "p")
            self.of[name], self.grains[name] = [], []
            for trial in range(trials(name, level)):
                result = results[f"{file_name}-{trial + 1}"]
                if not result.done:
                    self.failed.append(f"{name} ({result.reason})")
                    continue
                self.of[name].append(Profile(result, other.get("rpm", RPM)))
                members = 2 if variant.endswith("S") else 1
                self.grains[name].append(float(result.record["bed"]["grains"]) / members)

    def pairs(self, a, b, f):
        """f(profile of a, profile of b) for each trial that both have."""
        return [f(p, q) for p, q in zip(self.of[a], self.of[b])]

    def mean(self, name, what):
        return numpy.mean([getattr(p, what) for p in self.of[name]], axis=0)


INNER = slice(0, 3)  # of six rings


def change_row(all_, a, b, key, text, expected, what):
    """Largest difference of two mean profiles over the peak of the second, within 10 %."""
    p, q = all_.mean(a, key), all_.mean(b, key)
    ring = int(numpy.abs(p - q).argmax())
    errors = [r.mean_and_error([getattr(one, key)[ring] for one in all_.of[n]])[1] or 0.0 for n in (a, b)]
    row = r.at_most(text, float(numpy.abs(p - q).max() / q.max()), 0.10, expected, what,
                    f"ring {ring + 1} of 6; means over {len(all_.of[a])} and {len(all_.of[b])} trials")
    row.standard_error, row.beds = math.hypot(*errors) / float(q.max()), len(all_.of[a])
    return row


def changed(level):
    what = LEVELS[level]
    e = what["modulus"]
    return (
        f"Young's modulus {e:.3g} Pa in place of 1.93e11 Pa; yield force "
        f"{YIELD_N * (e / STEEL_PA) ** 0.4:.3g} N in place of 48 N and the damper by E^(4/5), so that "
        "restitution against speed stays (shown by the drop tests)",
        f"means over {what['mean']:g} turns of the wheel after {what['before']:g} (coarse: {LONG['mean']:g} after "
        f"{LONG['before']:g} for the base case, f, 220 and 270 rpm); trials: {what['trials']}",
        "wheel, rim and plates are of the balls' steel; hemispheres at half of the head space",
        "asphericity S: two spheres whose centres are 0.05 mm apart, the printed tolerance; the planar "
        "case has spheres (clumps cannot move in a plane yet)",
        "friction law f: a linear spring of the stiffness that F begins with (Mindlin's, 8 G* a)",
        "beta of the damper is not printed: it is chosen so that restitution between balls equals that of "
        "the plastic law between 2 and 3 m/s; d: yield force 0.1 times, beta 5 times",
        "normalising speed: that of the wheel's rim, 0.0857 m (the paper's printed speeds imply 0.0988 m, "
        "which would lower velocities by 13 % and temperatures by 25 %)",
    )


def short(level):
    what = LEVELS[level]
    return (f"E {what['modulus']:.3g} Pa for 193 GPa, yield force and damper scaled with it; "
            f"means over {what['mean']:g} turns or more")


def drop_rows(results, level):
    out = []
    names = {"N": "plastic law", "n": "damper"}
    for key in "Nn":
        for place, where in ((1, "plate"), (2, "ball")):
            got = restitution(results[f"drop-{key}"])
            soft = restitution(results[f"drop-{key}-soft"])
            e = got[place]
            rises = float(numpy.diff(e).max())
            out.append(r.at_most(
                f"drop test, {names[key]}, on a {where}: restitution at 4 m/s over that at 0.1 m/s",
                float(e[-1] / e[0]), 0.95, "falls with speed", "none: E 193 GPa",
                f"at 0.1 to 4 m/s: {', '.join(f'{v:.3f}' for v in e)}; largest rise from one speed "
                f"to the next {max(rises, 0.0):.1e}"))
            out[-1].passed = out[-1].passed and rises < 2e-3
            out.append(r.at_most(
                f"drop test, {names[key]}, on a {where}: softened against steel, largest difference",
                float(numpy.abs(soft[place] - e).max()), 0.02, "the same curve", short(level)))
    return out


def cell_rows(all_, level):
    what = short(level)
    out = []
    errors = [abs(float(t) / n - 1) for name in all_.of
              for p, n in zip(all_.of[name], all_.grains[name]) for t in p.total]
    out.append(r.at_most("grains counted in the six rings against those there are, largest error",
                         max(errors), 0.01, "counts add up to 1 %", what))
    out.append(r.at_least(
        "planar over exact head space: velocity of the outermost ring (both of spheres)",
        all_.pairs("NDFR2Ds", "NDFR3ds", lambda p, q: p.velocity[-1] / q.velocity[-1]), 3.0,
        "slips at the outer wall", what))
    for variant in ("ndFR3dS", "nDFR3dS"):
        if variant not in all_.of:
            continue
        main = variant == "ndFR3dS"
        for key in ("velocity", "temperature"):
            f = lambda p, q, key=key: float(getattr(p, key)[INNER].mean() / getattr(q, key)[INNER].mean())
            values = all_.pairs(variant, BASE, f)
            text = f"spring-dashpot ({variant}) over plastic ({BASE}): {key} of the three inner rings"
            out.append(r.at_most(text, values, 1.0, "lower", what) if main else
                       r.printed(text, values, "lower", what))
    if level == "quick":
        return out
    for key in ("velocity", "temperature"):
        out.append(change_row(all_, "NDfR3dS", BASE, key, f"friction law f against F: largest change of "
                              f"the {key} profile over its peak", "nothing beyond 10 %", what))
    out += rolling_rows(all_, what)
    for rpm in OTHER_RPM:
        for key in ("velocity", "temperature", "fraction"):
            out.append(change_row(all_, f"{rpm}rpm", BASE, key, f"{rpm} against 240 rpm: largest change of "
                                  f"the normalised {key} profile over its peak", "within 10 %", what))
    out += roughness_rows(all_, what)
    for f in OTHER_FRACTION:
        for key in ("velocity", "temperature"):
            out.append(r.printed(f"solid fraction {f:g} over 0.75: mean {key} of the three inner rings",
                                 all_.pairs(f"nu{f:g}", BASE, lambda p, q, key=key: float(
                                     getattr(p, key)[INNER].mean() / getattr(q, key)[INNER].mean())),
                                 "shifts", what))
    return out


def rolling_rows(all_, what):
    """Velocity moves (by a tenth at least) only together with the temperature."""
    out = []
    for key in ("velocity", "temperature"):
        ratio = lambda p, q, key=key: float(getattr(p, key)[INNER].mean() / getattr(q, key)[INNER].mean())
        out.append(r.at_most(
            f"rolling friction 0.5 (R') over 0.01 (R): mean {key} of the three inner rings",
            all_.pairs("NDFR'3dS", BASE, ratio), 0.9,
            "velocity moves only at the cost of the temperature: both fall", what))
        out.append(r.printed(f"rolling friction none (r) over 0.01 (R): mean {key} of the three inner rings",
                             all_.pairs("NDFr3dS", BASE, ratio), "-", what))
    return out


def roughness_rows(all_, what):
    out = []
    names = ("R0", BASE, "R1")
    for key, of in (("temperature", lambda p: float(p.temperature[INNER].mean())),
                    ("peak velocity", lambda p: float(p.velocity.max()))):
        values = [r.mean_and_error([of(p) for p in all_.of[n]]) for n in names]
        steps = [values[k + 1][0] / values[k][0] for k in (0, 1)]
        out.append(r.at_least(
            f"roughness R = 0, 0.6, 1: least ratio of {key} from one to the next", min(steps), 1.0,
            "rises with roughness", what,
            "; ".join(f"{m:.4g} +- {e or 0:.1g}" for m, e in values)))
    return out


def rows(results, level):
    all_ = Profiles(results, level)
    out = drop_rows(results, level)
    if all_.failed:
        out.append(r.failed("runs of the cell", "all done", "none fails", short(level),
                            "; ".join(all_.failed)))
    return out + cell_rows(all_, level)


# Figures.

GROUPS = (
    ("Normal law and dissipation", (BASE, "NdFR3dS", "nDFR3dS", "ndFR3dS")),
    ("Friction law", (BASE, "NDfR3dS")),
    ("Rolling friction", (BASE, "NDFr3dS", "NDFR'3dS")),
    ("Geometry", (BASE, "NDFR3ds", "NDFR3DS", "NDFR2Ds")),
    ("Shape of the balls", (BASE, "NDFR3ds")),
    ("Rotation", ("220rpm", BASE, "270rpm")),
    ("Roughness of the wheel", ("R0", BASE, "R1")),
    ("Solid fraction", ("nu0.65", "nu0.708", BASE)),
)


def profile_figure(all_, names):
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.4))
    for name in names:
        for axis, key in zip(axes, ("fraction", "velocity", "temperature")):
            values = numpy.array([getattr(p, key) for p in all_.of[name]])
            error = values.std(axis=0, ddof=1) / math.sqrt(len(values)) if len(values) > 1 else None
            axis.errorbar(all_.of[name][0].radius, values.mean(axis=0), error, marker="o", ms=3,
                          capsize=2, label=name)
    for axis, label in zip(axes, ("solid fraction (areal)", "tangential velocity / wheel's",
                                  "temperature / wheel's speed squared")):
        axis.set_xlabel("radius (0 wheel, 1 rim)")
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    return figure


def drop_figure(results):
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True)
    for axis, place, title in zip(axes, (1, 2), ("on a plate", "between two balls")):
        for key, label in (("N", "plastic"), ("n", "damper")):
            for soft, style in (("", "o-"), ("-soft", "x--")):
                got = restitution(results[f"drop-{key}{soft}"])
                axis.plot(got[0], got[place], style, ms=4,
                          label=label + (", softened" if soft else ", steel"))
        axis.set_title(title)
        axis.set_xlabel("impact speed [m/s]")
    axes[0].set_ylabel("restitution")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    return figure


def figures(results, level):
    all_ = Profiles(results, level)
    out = [("Drop tests", drop_figure(results), "As fig. 3 of the paper: restitution against speed. "
            "Softened: the stiffness of the runs below, yield force and damper scaled with it.")]
    for title, names in GROUPS:
        names = [n for n in names if all_.of.get(n)]
        if len(names) > 1:
            out.append((title, profile_figure(all_, names),
                        "Six rings, means over time and trials; bars: standard error over trials."))
    return out
