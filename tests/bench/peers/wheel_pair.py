"""The wheel rows: one run of the peer, of ours with everything simulated, and of ours with only
what the scene needs, turn by turn; time until the stopping rule is met, and rate."""
import json
import math
import os
import re
import statistics
import sys
from dataclasses import replace

from bed_to_data import write_data
from peer import HERE, SKINS, Failure, Peer, run
from wheel_stl import write_wheel

OUTPUTS = ("f_x_n", "f_y_n", "f_z_n", "torque_n_m", "sinkage_m")
LARGEST_Z = 2.0  # differences over their standard error: 95 % of equal means are within
HUB_X = 0.075    # [m] in the peer's box: a mesh must not cross its ends
TRIAL_STEPS = 1000


class WheelPeer(Peer):
    def __init__(self, name, pair, machine, setup):
        super().__init__(name, pair, machine)
        self.setup = setup
        settings, grains = self.settings, self.grains
        length, self.depth = settings["length_m"], settings["height_m"]
        for g in grains:  # the engine sets its wheel down in the middle of a bed whose top is z = 0
            g[0] = (g[0] - length / 2 + HUB_X) % length
            g[2] -= self.depth
        write_data(settings, grains, os.path.join(self.folder, "bed.data"),
                   2 * setup["radius_m"] + setup["clearance_m"])
        write_wheel(setup["radius_m"], setup["width_m"], os.path.join(self.folder, "wheel.stl"),
                    setup["sides"])

    def _wheel_variables(self):
        s, dt = self.setup, self.settings["dt_s"]
        values = {"x": HUB_X, "y": self.settings["width_m"] / 2,
                  "z": s["radius_m"] + s["clearance_m"], "depth": self.depth,
                  "speed": (1 - s["slip"]) * s["speed_m_per_s"],
                  "spin": s["speed_m_per_s"] / s["radius_m"], "load": s["load_n"],
                  "damper": s["damper_n_s_per_m"], "sample": round(s["sample_s"] / dt),
                  "look": round(s["look_s"] / dt)}
        return [w for name, v in values.items() for w in ("-var", name, repr(v))]

    def _run(self, skin, warmup, steps, every):
        # The names `x`, `speed`... of the wheel come after the bed's: the first value counts.
        bed = self._variables(skin, warmup, steps, every)
        at = bed.index("speed")
        del bed[at - 1:at + 2]
        command = self.machine.pin(1) + ["liggghts", "-in", os.path.join(HERE, "in.wheel.liggghts"),
                                         "-log", "none"]
        text, busy = run(command + bed + self._wheel_variables(), self.folder, 1)
        loop = re.search(r"Loop time of (\S+) on", text)
        if not loop:
            raise Failure(f"liggghts: no loop time in\n{text[-2000:]}")
        self.clock = [(int(a), float(b)) for a, b in
                      re.findall(r"^ +(\d+) +(\S+) +\S+ *$", text, re.MULTILINE)]
        return float(loop[1]), busy

    def choose_skin(self):
        radius = self.settings["mean_diameter_m"] / 2
        times = {}
        for x in SKINS:
            loop, busy = self._run(x * radius, 0, TRIAL_STEPS, 0)
            times[x * radius] = loop * busy
        self.skin = min(times, key=times.get)

    def _series(self):
        """forces.txt as the engine's --judge reads it."""
        s, dt = self.setup, self.settings["dt_s"]
        height, last, path = s["clearance_m"], 0, os.path.join(self.folder, "series.csv")
        with open(os.path.join(self.folder, "forces.txt"), encoding="ascii") as f, \
                open(path, "w", encoding="ascii") as out:
            out.write("time_s,f_x_n,f_y_n,f_z_n,torque_n_m,sinkage_m,travel_m\n")
            for line in f:
                if line.startswith("#"):
                    continue
                step, fx, fy, fz, ty, vz = (float(v) for v in line.split())
                rise = vz * (step - last) * dt
                height, last, time = height + rise, step, step * dt
                out.write(f"{time!r},{fx!r},{fy!r},{fz!r},{-ty!r},{-(height - rise / 2)!r},"
                          f"{s['speed_m_per_s'] * time!r}\n")
        return path

    def turn(self):
        """Rate, wall time to the stop, verdict; share of the core it had."""
        steps = math.ceil(self.setup["longest_s"] / self.settings["dt_s"])
        loop, busy = self._run(self.skin, 0, steps, 0)
        verdict = self.judge(self._series())
        stop_step = verdict["time_s"] / self.settings["dt_s"]
        # Of the look at which the rule was met.
        wall = loop
        if verdict["stopped"]:
            wall = min(self.clock, key=lambda c: abs(c[0] - stop_step))[1]
        return {"rate": len(self.grains) * steps / loop, "wall_s": wall, "verdict": verdict,
                "busy": busy}

    def judge(self, series, window=()):
        text, _ = run([self.machine.bench, "--judge", series, *window], self.folder, 1)
        return json.loads(text)

    def over(self, verdict):
        """The peer's means over the window of another verdict."""
        return self.judge(os.path.join(self.folder, "series.csv"),
                          ["--from", repr(verdict["from_s"]), "--to", repr(verdict["time_s"])])


def ours(machine, pair, scene):
    text, _ = run(machine.pin(1) + [machine.bench] + machine.bed_options(pair) +
                  machine.law_options(pair) +
                  ["--scene", scene, "--wheel-sides", str(pair.sides), "--repeat", "1", "--json"],
                  machine.work, 1)
    r = json.loads(text)
    return {"rate": r["particle_steps_per_s"], "wall_s": r["wall_s"][0], "verdict": r["wheel"],
            "busy": r["cpu_s"][0] / r["wall_s"][0], "setup": r["setup"], "engine": r}


def compare(pairs_of_verdicts):
    """Mean differences of the turns (ours less the peer's, over the same windows) against their
    standard errors."""
    out = {}
    for name in OUTPUTS:
        n = len(pairs_of_verdicts)
        a = math.fsum(theirs[name] for theirs, _ in pairs_of_verdicts) / n
        b = math.fsum(mine[name] for _, mine in pairs_of_verdicts) / n
        error = math.sqrt(math.fsum(theirs["se_" + name] ** 2 + mine["se_" + name] ** 2
                                    for theirs, mine in pairs_of_verdicts)) / n
        if n > 2:
            # Errors from blocks of one run miss what varies from bed to bed: the larger counts.
            apart = [mine[name] - theirs[name] for theirs, mine in pairs_of_verdicts]
            error = max(error, statistics.stdev(apart) / math.sqrt(n))
        z = (b - a) / error if error > 0 else math.inf
        out[name] = {"peer": a, "ours": b, "difference": b - a, "standard_error": error, "z": z,
                     "agrees": abs(z) <= LARGEST_Z}
    return out


def spread(values):
    return {"median": statistics.median(values), "least": min(values), "most": max(values)}


def run_wheel(name, pair, machine, repeat):
    """One row a scene, all from the same turns; every turn is a bed of its own."""
    turns, skin = [], None
    for k in range(repeat):
        this = replace(pair, seed=pair.seed + k)
        machine.export(this)
        turn = {scene: ours(machine, this, scene) for scene in pair.scenes}
        peer = WheelPeer(name, this, machine, turn[pair.scenes[0]]["setup"])
        if skin is None:
            peer.choose_skin()
            skin = peer.skin
        peer.skin = skin
        turn["peer"] = peer.turn()
        for scene in pair.scenes:
            turn[scene]["theirs"] = peer.over(turn[scene]["verdict"])
        turns.append(turn)
        print(f"  {name} turn {k + 1}: peer {turn['peer']['wall_s']:.1f} s, ours " +
              ", ".join(f"{turn[s]['wall_s']:.1f} s ({s})" for s in pair.scenes), file=sys.stderr)
    return [row_of(name, pair, scene, turns, skin) for scene in pair.scenes]


def row_of(name, pair, scene, turns, skin):
    mine, theirs = [t[scene] for t in turns], [t["peer"] for t in turns]
    both = list(zip(mine, theirs))
    return {
        "pair": name if scene == "full" else f"{name}-scene", "workload": "wheel",
        "scene": scene, "rolling": pair.rolling, "peer": "liggghts", "peer_skin_m": skin,
        "peer_particle_steps_per_s": spread([t["rate"] for t in theirs]),
        "particle_steps_per_s": spread([t["rate"] for t in mine]),
        "ratio": spread([a["rate"] / b["rate"] for a, b in both]),
        "ratio_by_cpu_time": statistics.median(
            a["rate"] / a["busy"] / (b["rate"] / b["busy"]) for a, b in both),
        "peer_wall_to_stop_s": spread([t["wall_s"] for t in theirs]),
        "wall_to_stop_s": spread([t["wall_s"] for t in mine]),
        "speed_up_to_stop": spread([b["wall_s"] / a["wall_s"] for a, b in both]),
        "speed_up_to_stop_by_cpu_time": statistics.median(
            b["wall_s"] * b["busy"] / (a["wall_s"] * a["busy"]) for a, b in both),
        "least_cpu_share": min(t["busy"] for t in mine + theirs),
        "physics": compare([(t["theirs"], t["verdict"]) for t in mine]),
        "peer_stops": [t["verdict"] for t in theirs], "stops": [t["verdict"] for t in mine],
        "engine": mine[-1]["engine"]}


def show(row):
    def of(s):
        return f"{s['median']:.4g} ({s['least']:.4g} to {s['most']:.4g})"

    def stops(verdicts):
        return ", ".join(f"{v['time_s']:.1f}" if v["stopped"] else
                         f"not by {v['time_s']:.2f} ({v['drifting'] or 'errors'})"
                         for v in verdicts)
    print(f"{row['pair']}: particle-steps/s: liggghts {of(row['peer_particle_steps_per_s'])}, ours "
          f"{of(row['particle_steps_per_s'])}: ratio {of(row['ratio'])}\n"
          f"    wall time to the stop [s]: liggghts {of(row['peer_wall_to_stop_s'])}, ours "
          f"{of(row['wall_to_stop_s'])}: SPEED-UP {of(row['speed_up_to_stop'])}\n"
          f"    stopped at [s of the scene]: liggghts {stops(row['peer_stops'])}; ours "
          f"{stops(row['stops'])}")
    for name, c in row["physics"].items():
        print(f"    {name}: peer {c['peer']:.5g}, ours {c['ours']:.5g}, difference "
              f"{c['difference']:+.2g} = {c['z']:+.1f} standard errors "
              f"{'ok' if c['agrees'] else 'DIFFERS'}")
    if row["least_cpu_share"] < 0.97:
        print(f"    NOT QUIET: a run had {100 * row['least_cpu_share']:.0f} % of its core; by CPU "
              f"time: ratio {row['ratio_by_cpu_time']:.2f}, SPEED-UP "
              f"{row['speed_up_to_stop_by_cpu_time']:.2f}")
