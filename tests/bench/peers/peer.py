"""Runs of one code or the other."""
import json
import math
import os
import re
import resource
import subprocess
import time

from bed_to_data import read_bed, write_data
from pairs import ROLLING

HERE = os.path.dirname(os.path.abspath(__file__))
LONGEST_S = 20 * 60  # of one run of a peer
SKINS = (0.05, 0.1, 0.2, 0.4)  # tried for the peer [mean radii]


class Failure(Exception):
    pass


def run(command, folder, cores):
    """Output, and the share of its cores that the run had (less than 1: others ran too)."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.monotonic()
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False,
                              timeout=LONGEST_S)
    except subprocess.TimeoutExpired as error:
        raise Failure(f"{' '.join(command)}: over {LONGEST_S} s") from error
    wall = time.monotonic() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise Failure(f"{' '.join(command)}: exit status {done.returncode}\n"
                      f"{done.stdout[-2000:]}{done.stderr[-2000:]}")
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done.stdout, used / (wall * cores)


def seed_of(pair):
    return "" if pair.seed == 1 else f"-s{pair.seed}"


class Machine:
    """Where the engine's program, the beds and the cores are."""

    def __init__(self, bench, work, cores):
        self.bench, self.cores = os.path.abspath(bench), cores
        self.work = os.path.abspath(work)
        os.makedirs(self.work, exist_ok=True)
        if not os.access(self.bench, os.X_OK):
            raise Failure(f"{bench}: no such program; build the target grouser-engine-bench")

    def pin(self, count):
        if len(self.cores) < count:
            raise Failure(f"--cores {','.join(self.cores)}: expected at least {count}")
        return ["taskset", "-c", ",".join(self.cores[:count])]

    def bed_options(self, pair):
        bed = os.path.join(self.work, f"{pair.workload}{pair.particles}{seed_of(pair)}.csv")
        return ["--workload", pair.workload, "--particles", str(pair.particles), "--order",
                pair.order, "--seed", str(pair.seed), "--bed", bed]

    @staticmethod
    def law_options(pair):
        return ["--tangential", pair.tangential, "--rolling", pair.rolling]

    def export(self, pair):
        """The bed in the pair's order, made if need be: settings and grains."""
        path = os.path.join(self.work, f"{pair.workload}{pair.particles}{seed_of(pair)}-"
                            f"{pair.order}.csv")
        if not os.path.exists(path):
            run([self.bench] + self.bed_options(pair) + ["--export", path], self.work, 1)
        return read_bed(path)

    def ours(self, pair, steps=None, samples=1):
        text, _ = run(self.pin(pair.cores) + [self.bench] + self.bed_options(pair) +
                      self.law_options(pair) +
                      ["--cores", str(pair.cores), "--worlds", str(pair.worlds), "--steps",
                       str(steps or pair.steps), "--warmup", str(pair.warmup), "--repeat", "1",
                       "--physics-samples", str(samples), "--json"], self.work, pair.cores)
        result = json.loads(text)
        return result, result["cpu_s"][0] / (result["wall_s"][0] * pair.cores)


class Peer:
    """A peer's runs of one pair, in a folder of their own."""

    def __init__(self, name, pair, machine):
        self.pair, self.machine, self.skin = pair, machine, None
        self.settings, self.grains = machine.export(pair)
        self.folder = os.path.join(machine.work, name)
        os.makedirs(self.folder, exist_ok=True)
        write_data(self.settings, self.grains, os.path.join(self.folder, "bed.data"))

    def _variables(self, skin, warmup, steps, every):
        s = self.settings
        values = {"data": "bed.data", "dt": repr(s["dt_s"]), "skin": repr(skin), "warmup": warmup,
                  "steps": steps, "every": every, "young": repr(s["youngs_modulus_pa"]),
                  "poisson": s["poisson_ratio"], "restitution": s["restitution"],
                  "friction": s["friction"], "rolling": s["rolling_friction"],
                  "damping": s["rolling_damping"], "gravity": s["gravity_m_per_s2"],
                  "model": ROLLING[self.pair.rolling],
                  "speed": max(g[5] for g in self.grains if g[11]) if self.pair.workload == "shear"
                  else 0}
        if self.pair.peer == "lammps":
            values["kroll"], values["groll"] = self._rolling_spring()
        return [w for name, value in values.items() for w in ("-var", name, *str(value).split())]

    def _rolling_spring(self):
        """EPSD's spring and dashpot at an overlap of 0.4 % of equal mean grains."""
        s = self.settings
        r = s["mean_diameter_m"] / 2
        mass = s["density_kg_per_m3"] * 4 / 3 * math.pi * r ** 3
        e_star = s["youngs_modulus_pa"] / (1 - s["poisson_ratio"] ** 2) / 2
        k = 4 / 3 * e_star * math.sqrt(r / 2 * 0.004 * r)
        spring = 2.25 * k * s["rolling_friction"] ** 2
        inertia = 0.5 * 1.4 * mass * r * r
        return repr(spring), repr(2 * s["rolling_damping"] * math.sqrt(inertia * spring) / (r / 2))

    def _run(self, skin, warmup, steps, every):
        ranks = self.pair.ranks
        command = self.machine.pin(ranks)
        if ranks > 1:
            command += ["mpirun", "--allow-run-as-root", "--bind-to", "none", "--oversubscribe",
                        "-np", str(ranks)]
        script = os.path.join(HERE, f"in.{self.pair.workload}.{self.pair.peer}")
        command += [self.pair.program, "-in", script, "-log", "none"]
        text, busy = run(command + self._variables(skin, warmup, steps, every), self.folder, ranks)
        loops = re.findall(r"Loop time of (\S+) on", text)
        if len(loops) != 2:
            raise Failure(f"{self.pair.program}: expected two loop times, got\n{text[-2000:]}")
        return float(loops[1]), busy

    def choose_skin(self):
        """The fastest of a few, so that the peer is at its best."""
        radius = self.settings["mean_diameter_m"] / 2
        steps = max(50, self.pair.steps // 2)
        times = {}
        for x in SKINS:
            loop, busy = self._run(x * radius, 20, steps, 0)
            times[x * radius] = loop * busy
        self.skin = min(times, key=times.get)

    def time(self):
        """Particle-steps per second."""
        loop, busy = self._run(self.skin, self.pair.warmup, self.pair.steps, 0)
        return len(self.grains) * self.pair.steps / loop, busy

    def contacts(self):
        """The contacts of every instant, in a run that is not timed."""
        every = self.pair.check_steps // self.pair.samples
        self._run(self.skin, self.pair.warmup, self.pair.check_steps, every)
        return os.path.join(self.folder, "contacts.txt")
