"""Wheel testbed on clusters, DEM with multibody dynamics (reference 1)."""

import math

import numpy
from matplotlib import pyplot

from rows import at_least, at_most, between, failed, printed

TITLE = "Wheel testbed on sand of clusters"
ABOUT = ("A wheel with 16 teeth (outer diameter 200 mm, 3.31 kg) is set on a bed of four-sphere clusters, driven at "
         "10 mm/s and 0.1 rad/s with its height free, stopped and lifted. The paper took about 120 hours for 12 s "
         "with 614,432 spheres on one card.")

RADIUS, SPEED, SPIN_DEG, WAIT_S, DRIVE_S = 0.10, 0.010, 5.729578, 0.5, 10.0
DENSITY, GRAVITY = 2406.0, 9.81
DEPTH, SOLID_FRACTION = 0.05, 0.57
MEMBERS, CLUSTER_VOLUME = 4, 2.54  # volume of a cluster over that of a member
FULL_MEMBERS, FULL_SECONDS, FULL_SMALLEST, PAPER_HOURS = 614432, 12.0, 0.00125, 120.0
PLACE = 0.3274  # corners of the tetrahedron, in radii of the members: the union has CLUSTER_VOLUME
CLUSTER = [{"at": [PLACE * a, PLACE * b, PLACE * c], "radius": 1}
           for a, b, c in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]
FRICTIONS, BONDS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7), (0, 5, 10, 15)


class Level:
    """diameter: of spheres and of members of clusters; faster: speed over the published one;
    map_diameter: of the spheres of the map, which is driven at map_faster."""

    def __init__(self, diameter, young, faster, beds, map_diameter, map_faster, frictions, bonds, corners):
        self.diameter, self.young, self.faster, self.beds = diameter, young, faster, beds
        self.map_diameter, self.map_faster = map_diameter, map_faster
        self.frictions, self.bonds, self.corners = frictions, bonds, corners


LEVELS = {"quick": Level(0.012, 5e6, 10, (1,), 0.016, 20, (0.2, 0.7), (0, 15), (1,)),
          "coarse": Level(0.010, 1e7, 1, (1, 2, 3), 0.014, 8, FRICTIONS, BONDS, (1, 2, 3)),
          "full": Level(0.005, 2e7, 1, (1, 2, 3), 0.005, 1, FRICTIONS, BONDS, (1, 2, 3))}
LENGTH, WIDTH = 0.35, 0.20


def sphere(diameter):
    return math.pi / 6 * diameter**3


def bed(diameter, young, seed):
    solid = LENGTH * WIDTH * DEPTH * SOLID_FRACTION
    return {"seed": seed, "materials[0].youngs_modulus_pa": young,
            "grains[0].diameter_m": diameter, "grains[0].count": round(solid / sphere(diameter))}


def clusters(diameter, young, seed):
    equal = diameter * CLUSTER_VOLUME ** (1 / 3)
    return {**bed(equal, young, seed), "grains[0].clump": CLUSTER}


def whole(faster):
    """The program of the file, at another speed: set down, driven, stopped, lifted."""
    return {"bodies[0].motion[1].velocity_m_per_s": [SPEED * faster, 0, 0],
            "bodies[0].motion[1].rate_deg_per_s": SPIN_DEG * faster,
            "bodies[0].motion[1].for_s": DRIVE_S / faster}


def driven(level, seed):
    """A run of the map: it ends with the drive."""
    faster = level.map_faster
    return {**bed(level.map_diameter, level.young, seed), "bodies[0].motion": [
        {"do": "wait", "free": ["z"], "for_s": WAIT_S},
        {"do": "move", "velocity_m_per_s": [SPEED * faster, 0, 0], "axis": "y", "rate_deg_per_s": SPIN_DEG * faster,
         "free": ["z"], "for_s": DRIVE_S / faster}]}


def surface_energy(bond, diameter, law):
    """Of the pull-off force over the weight of a grain: 1.5 pi g R for jkr, 6 pi g R for jkr_added,
    R half the radius for equal grains."""
    weight = sphere(diameter) * DENSITY * GRAVITY
    return bond * weight / ((1.5 if law == "jkr" else 6.0) * math.pi * 0.25 * diameter)


def map_cases(level):
    """(law, friction, Bond number, seed); jkr_added at Bond number 0 is jkr there."""
    corners = {(f, b) for f in (min(level.frictions), max(level.frictions)) for b in (min(level.bonds), max(level.bonds))}
    for law in ("jkr", "jkr_added"):
        for friction in level.frictions:
            for bond in level.bonds:
                if law == "jkr_added" and bond == 0:
                    continue
                for seed in level.corners if (friction, bond) in corners else level.corners[:1]:
                    yield law, friction, bond, seed


def map_name(law, friction, bond, seed):
    return f"map-{law}-{friction:g}-{bond:g}-{seed}"


def runs(name):
    level = LEVELS[name]
    out = []
    for seed in level.beds:
        out.append((f"clusters-{seed}", "wheel.yaml",
                    {**clusters(level.diameter, level.young, seed), **whole(level.faster)}))
    for seed in level.beds:
        out.append((f"spheres-{seed}", "wheel.yaml",
                    {**bed(level.diameter, level.young, seed), **whole(level.faster)}))
    for law, friction, bond, seed in map_cases(level):
        sets = driven(level, seed)
        sets["interfaces[0].friction"] = friction
        if bond > 0:
            sets["laws.cohesion"] = law
            sets["interfaces[0].surface_energy_j_per_m2"] = surface_energy(bond, level.map_diameter, law)
            sets["preparation[0].surface_energy_j_per_m2"] = 0
        out.append((map_name(law, friction, bond, seed), "wheel.yaml", sets))
    for seed in level.beds:
        mesh = {**driven(level, seed), "bodies[0].parts": {"shape": "mesh", "file": "wheel.obj", "scale": 1e-4}}
        out.append((f"mesh-{seed}", "wheel.yaml", mesh))
        out.append((f"analytic-{seed}", "wheel.yaml", driven(level, seed)))
    out.append(("mixed", "mixing.yaml", {}))
    out.append(("layered", "mixing.yaml", {"preparation": [{"do": "settle", "rest": 1e-4, "most_s": 1.0}]}))
    out.append(("joints", "joints.yaml", {}))
    return out


def driving(result, faster, begin=0.0, end=DRIVE_S):
    """Indices of the part of the drive from `begin` to `end`, in the paper's time."""
    time = result.series["time_s"] - WAIT_S
    return (time >= begin / faster) & (time <= end / faster)


def sinkage(result, faster):
    return float(numpy.mean(result.series["wheel.sinkage_m"][driving(result, faster, 5)]))


def lowest(result, level):
    return 1e3 * (float(numpy.mean(result.series["wheel.z_m"][driving(result, level.faster, 5)])) - RADIUS)


# Joints against their closed forms: relative errors.

def period(time, value, level):
    up = numpy.flatnonzero((value[:-1] < level) & (value[1:] >= level))
    at = time[up] + (time[up + 1] - time[up]) * (level - value[up]) / (value[up + 1] - value[up])
    return (at[-1] - at[0]) / (len(at) - 1)


def decaying(time, amplitude, inertia, stiffness, damping):
    decay = 0.5 * damping / inertia
    w = math.sqrt(stiffness / inertia - decay**2)
    return amplitude * (1 - numpy.exp(-decay * time) * (numpy.cos(w * time) + decay / w * numpy.sin(w * time)))


def joint_errors(s):
    mass, arm, about_end = 2.0, 0.2, 0.03 + 2 * 0.2**2
    t = s["time_s"]
    swing = 4 * 1.8540746773013719 * math.sqrt(about_end / (mass * GRAVITY * arm))
    pull = mass * (GRAVITY + arm * 2 * mass * GRAVITY * arm / about_end)
    deep = mass * GRAVITY / 800
    turn = math.radians(60) * 9.75 + 0.5 * 0.5 * math.radians(60)
    steady = (t > 1) & (t < 9.9)
    held = numpy.hypot(s["motor.f_x_n"], s["motor.f_y_n"])[steady]
    return {
        "revolute: period of a pendulum released level": period(t, s["hinged.z_m"], 1.9) / (swing / 2) - 1,
        "revolute: largest pull on the hinge": numpy.max(s["hinge.f_z_n"]) / pull - 1,
        "spherical: the same period": period(t, s["hung.z_m"], 1.9) / (swing / 2) - 1,
        "universal: the same period": period(t, s["crossed.z_m"], 1.9) / (swing / 2) - 1,
        "translational, spring and damper": numpy.max(numpy.abs(
            s["slide.way_m"] + decaying(t, deep, mass, 800, 2))) / deep,
        "rotational spring and damper": numpy.max(numpy.abs(
            s["wheel.angle_rad"] - decaying(t, math.pi / 6, 0.03, 0.3, 0.006))) / (math.pi / 6),
        "driven hinge: angle": s["motor.angle_rad"][-1] / turn - 1,
        "driven hinge: centripetal force": numpy.max(numpy.abs(held / (mass * arm * math.radians(60) ** 2) - 1)),
        "actuator: way under a constant force": s["rail.way_m"][-1] / (0.5 * 0.02 / mass * t[-1] ** 2) - 1,
    }


def ranks(values):
    order = numpy.argsort(values, kind="stable")
    out = numpy.empty(len(values))
    out[order] = numpy.arange(len(values))
    for v in numpy.unique(values):
        same = numpy.asarray(values) == v
        out[same] = out[same].mean()
    return out


def rank_correlation(a, b):
    return float(numpy.corrcoef(ranks(a), ranks(b))[0, 1])


def rank_correlation_within(cells, which):
    """Mean over the rows (0: columns) of the map of the rank correlation along them."""
    lines = {}
    for cell, depth in cells.items():
        lines.setdefault(cell[1 - which], []).append((cell[which], depth))
    return sum(rank_correlation(*zip(*line)) for line in lines.values()) / len(lines)


def map_of(results, level, law):
    """{(friction, bond): mean sinkage over beds}."""
    cells = {}
    for friction in level.frictions:
        for bond in level.bonds:
            names = [map_name("jkr" if bond == 0 else law, friction, bond, seed) for seed in level.corners]
            got = [sinkage(results[n], level.map_faster) for n in names if n in results and results[n].done]
            if got:
                cells[friction, bond] = sum(got) / len(got)
    return cells


def changed_in_short(name):
    level = LEVELS[name]
    return (f"spheres and members {1e3 * level.diameter:g} mm (5 and 2.5), E {level.young:.1g} Pa, bed {LENGTH:g} x "
            f"{WIDTH:g} m (0.7 x 0.26), speed x{level.faster:g}")


def changed(name):
    level = LEVELS[name]
    return [
        f"Spheres and members of clusters of {1e3 * level.diameter:g} mm (published 5 and 2.5 mm mixed), in the map "
        f"and for the mesh spheres of {1e3 * level.map_diameter:g} mm.",
        f"Young's modulus {level.young:.3g} Pa (printed: 400000 GPa, a misprint; a free, softened parameter).",
        f"Bed {LENGTH:g} x {WIDTH:g} x {DEPTH:g} m, periodic along the way (published 0.7 x 0.26 x 0.05 m with walls).",
        f"Speed {level.faster:g} times the published one; in the map {level.map_faster:g} times.",
        "Damping by a restitution of 0.3 (published: a constant dashpot without a number). Tangential force by a "
        "vector history (the paper adds up a scalar, which only grows).",
        "Adhesion by the Bond number, pull-off force over weight of a grain: the coefficients 0, 5, 10 and 15 have no "
        "printed unit and are read as such. The surface energy follows for each law. Beds of the map are settled without "
        "adhesion, so that all stand equally dense: cohesive grains fall into looser beds, in which the wheel sinks more.",
        "A cluster is a tetrahedron whose solid volume is that of 2.54 members.",
    ]


def rows(results, name):
    level, note = LEVELS[name], changed_in_short(name)
    broken = [r for r in results.values() if not r.done]
    out = [failed(f"run {r.plan.name}", "done", "done", note, r.reason) for r in broken]
    good = {n: r for n, r in results.items() if r.done}
    quick = name == "quick"
    why = "quick: too few and too large grains, too fast" if quick else ""
    pairs = [(good[f"clusters-{k}"], good[f"spheres-{k}"]) for k in level.beds
             if f"clusters-{k}" in good and f"spheres-{k}" in good]
    if pairs:
        out.append(between("sinkage on clusters over that on spheres",
                           [sinkage(c, level.faster) / sinkage(s, level.faster) for c, s in pairs], 0.60, 0.95,
                           "below 1", note, why, not quick))
        out += wheel_rows(pairs, level, note, why, not quick)
    if "layered" in good and "mixed" in good:
        sizes = "100 and 800 clusters of 16 and 8 mm members (published 13,608 and 140,000 of 5 and 2.5 mm), E 1e6 Pa"
        out.append(at_most("mixing index before", float(good["layered"].series["mixing"][0]), 0.2, 0, sizes,
                           "1 - intensity of segregation in 8 bins of 60 x 100 x 40 mm"))
        out.append(at_least("mixing index after turning the box", float(good["mixed"].series["mixing"][0]), 0.8, 1,
                            sizes, "8 turns at 150 deg/s, in a box of 120 x 100 x 240 mm"))
    for law in ("jkr", "jkr_added"):
        cells = map_of(good, level, law)
        if len(cells) > 3:
            depth = list(cells.values())
            sizes = f"spheres {1e3 * level.map_diameter:g} mm, speed x{level.map_faster:g}"
            small = "; in 2 x 2 cells the weaker of two effects gives -0.447 at most" if quick else ""
            for which, axis in ((0, "friction"), (1, "adhesion")):
                out.append(at_most(f"{law}: rank correlation of sinkage with {axis}",
                                   rank_correlation([k[which] for k in cells], depth), -0.5, "falls", sizes,
                                   f"{len(cells)} of the map's 24 cells{small}", not quick))
                out.append(printed(f"{law}: rank correlation with {axis} where the other is held, mean over the map",
                                   rank_correlation_within(cells, which), -1, sizes))
    if "joints" in good:
        series = good["joints"].series
        for what, error in joint_errors(series).items():
            out.append(at_most(f"{what}: relative error", abs(float(error)), 1e-3, 0, "12 s, as published"))
        gap = max(float(numpy.max(v)) for key, v in series.items() if key.endswith(".gap_m"))
        out.append(at_most("constraint drift over 12 s [m]", gap, 1e-8, 0, "12 s, as published"))
    both = [(good[f"mesh-{k}"], good[f"analytic-{k}"]) for k in level.beds
            if f"mesh-{k}" in good and f"analytic-{k}" in good]
    if both:
        ratio = [abs(sinkage(m, level.map_faster) / sinkage(a, level.map_faster) - 1) * 100 for m, a in both]
        out.append(at_most("wheel as a mesh of 5,408 triangles: sinkage against the analytic one [%]",
                           abs(numpy.mean([sinkage(m, level.map_faster) for m, _ in both])
                               / numpy.mean([sinkage(a, level.map_faster) for _, a in both]) - 1) * 100, 2, 0,
                           note, "beds: " + ", ".join(f"{v:.2g} %" for v in ratio) + "; " + why, not quick))
    return out


def wheel_rows(pairs, level, note, why, held):
    rms, drift, lifted = [], [], []
    for cluster, _ in pairs:
        when = driving(cluster, level.faster, 7)
        depth = cluster.series["wheel.sinkage_m"][when]
        time = cluster.series["time_s"][when]
        mean = float(numpy.mean(depth))
        line = numpy.polyfit(time, depth, 1)
        rms.append(100 * float(numpy.std(depth)) / mean)
        drift.append(100 * abs(line[0]) * (time[-1] - time[0]) / mean)
        lifted.append(float(cluster.series["wheel.f_z_n"][-1]))
    out = [at_most("vertical displacement from 7 to 10 s: rms about its mean [%]", rms, 6, "steady", note, why, held),
           at_most("vertical displacement from 7 to 10 s: drift [%]", drift, 6, "steady", note, why, held),
           at_most("force on the lifted wheel [N]", [abs(v) for v in lifted], 1e-6, 0, note, "stop and lift"),
           printed("sinkage on clusters [mm]", [1e3 * sinkage(c, level.faster) for c, _ in pairs], "not published", note),
           printed("sinkage on spheres [mm]", [1e3 * sinkage(s, level.faster) for _, s in pairs], "not published", note),
           printed("wheel's lowest point over the floor, clusters [mm]", [lowest(c, level) for c, _ in pairs],
                   "not published", note, "sinkage counts from the highest grain of the bed"),
           printed("wheel's lowest point over the floor, spheres [mm]", [lowest(s, level) for _, s in pairs],
                   "not published", note),
           printed("solid fraction of clusters", [c.record["bed"]["solid_fraction"] for c, _ in pairs], "denser", note),
           printed("solid fraction of spheres", [s.record["bed"]["solid_fraction"] for _, s in pairs], "looser", note)]
    n = [c.numerics for c, _ in pairs]
    rate = [float(x["particle_steps"]) / float(x["wall_s"]) for x in n]  # the preparation is in the time
    steps = FULL_SECONDS / (float(n[0]["dt_s"]) * FULL_SMALLEST / (0.5 * level.diameter))
    out.append(printed("steps per second here", [float(x["steps"]) / float(x["wall_s"]) for x in n], "not published", note))
    out.append(printed("hours for 12 s of the full case on one core, from this speed",
                       [FULL_MEMBERS * steps / r / 3600 for r in rate], PAPER_HOURS, note,
                       "time step by the smallest sphere at this stiffness; the paper's is on one card"))
    return out


def surface_figure(good):
    """Height of the bed at the end, from above."""
    names = [n for n in ("clusters-1", "spheres-1") if n in good]
    figure, axes = pyplot.subplots(1, len(names), figsize=(5.2 * len(names), 3.2), squeeze=False, layout="constrained")
    for ax, n in zip(axes[0], names):
        s = good[n].table("surface")
        nx, ny = len(numpy.unique(s["x_m"])), len(numpy.unique(s["y_m"]))
        image = ax.imshow(1e3 * s["height_m"].reshape(nx, ny).T, origin="lower", vmin=0, vmax=100,
                          extent=(0, LENGTH, 0, WIDTH), cmap="cividis")
        ax.set_title(n)
        ax.set_xlabel("x [m]")
        ax.set_ylabel("y [m]")
    figure.colorbar(image, ax=axes, label="height [mm]")
    return figure


def joints_figure(s):
    """What springs do, over their closed forms."""
    t = s["time_s"]
    figure, axes = pyplot.subplots(1, 3, figsize=(10.4, 3.0))
    deep = 2.0 * GRAVITY / 800
    for ax, key, value, form, label in (
            (axes[0], "slide.way_m", 1e3 * s["slide.way_m"], -1e3 * decaying(t, deep, 2.0, 800, 2), "way [mm]"),
            (axes[1], "wheel.angle_rad", s["wheel.angle_rad"], decaying(t, math.pi / 6, 0.03, 0.3, 0.006), "angle [rad]"),
            (axes[2], "hinged.z_m", s["hinged.z_m"], None, "height of the pendulum [m]")):
        ax.plot(t, value, lw=1.0, color="#1d6fa5", label=key)
        if form is not None:
            ax.plot(t, form, ":", lw=1.0, color="#c1121f", label="closed form")
        ax.set_xlim(0, 6)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(label)
        ax.legend(fontsize=7)
    figure.tight_layout()
    return figure


def figures(results, name):
    level = LEVELS[name]
    good = {n: r for n, r in results.items() if r.done}
    out = []
    wheels = {n: r for n, r in good.items() if n.startswith(("clusters", "spheres"))}
    if wheels:
        figure, axes = pyplot.subplots(1, 3, figsize=(10.4, 3.2))
        for n, r in wheels.items():
            time = r.series["time_s"]
            color = "#c1121f" if n.startswith("clusters") else "#1d6fa5"
            axes[0].plot(time, 1e3 * r.series["wheel.sinkage_m"], lw=0.8, color=color, label=n)
            axes[1].plot(time, 1e3 * r.series["wheel.v_z_m_per_s"], lw=0.5, color=color)
            rate = numpy.diff(r.series["wheel.v_z_m_per_s"]) / numpy.diff(time)
            axes[2].plot(time[1:-1], rate[:-1], lw=0.5, color=color)  # the last: the lift stops at once
        for ax, text in zip(axes, ("sinkage [mm]", "vertical speed [mm/s]", "vertical acceleration [m/s2]")):
            ax.set_xlabel("time [s]")
            ax.set_ylabel(text)
        axes[0].legend(fontsize=7)
        figure.tight_layout()
        out.append(("Wheel on clusters and spheres", figure, "Set down, driven, stopped, lifted."))
    if "clusters-1" in good or "spheres-1" in good:
        out.append(("The bed after the wheel was lifted", surface_figure(good), "The wheel went in the direction of x."))
    maps = {law: map_of(good, level, law) for law in ("jkr", "jkr_added")}
    if any(maps.values()):
        figure, axes = pyplot.subplots(1, 2, figsize=(10.4, 3.2))
        for ax, (law, cells) in zip(axes, maps.items()):
            for bond in level.bonds:
                points = [(f, 1e3 * v) for (f, b), v in cells.items() if b == bond]
                if points:
                    ax.plot(*zip(*points), "o-", ms=3, label=f"Bond number {bond:g}")
            ax.set_title(law)
            ax.set_xlabel("friction")
            ax.set_ylabel("sinkage [mm]")
            ax.legend(fontsize=7)
        figure.tight_layout()
        out.append(("Sinkage over friction and adhesion", figure, ""))
    if "joints" in good:
        out.append(("Joints and springs", joints_figure(good["joints"].series), ""))
    return out
