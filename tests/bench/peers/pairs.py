"""What is compared with what."""
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Pair:
    workload: str = "bed"
    particles: int = 20000
    order: str = "sorted"
    seed: int = 1               # of the bed
    rolling: str = "epsd"       # the engine's name of the law; see ROLLING
    tangential: str = "mindlin"  # ours; LIGGGHTS's spring is our "mindlin_displacement"
    cores: int = 1              # of ours
    worlds: int = 1
    peer: str = "liggghts"      # or "lammps"
    ranks: int = 1              # MPI ranks of the peer
    steps: int = 1000           # timed
    warmup: int = 200
    check_steps: int = 0        # of the untimed runs that compare the physics; 0: as timed
    samples: int = 4            # instants at which it is compared
    scenes: tuple = ()          # of a wheel: everything simulated, only what is needed
    sides: int = 0              # of the wheel, a prism: the same mesh in both codes
    same_law: bool = True       # else stresses are printed, not judged
    chaotic: bool = False       # means of runs that have parted: judged by their standard errors

    @property
    def program(self):
        return {"liggghts": "liggghts", "lammps": "lmp"}[self.peer]

    def scaled(self, share):
        # The instants of the physics must fall on steps of both codes.
        every = max(1, round((self.check_steps or self.steps) * share / self.samples))
        return replace(self, steps=max(1, round(self.steps * share)),
                       check_steps=every * self.samples,
                       warmup=max(1, round(self.warmup / every)) * every)


# LIGGGHTS's names. Debian's build has no compiled combination with `epsd` and runs it through a
# slower, general path (it says so: "up to 20 %"); `cdt` is compiled in. Both are compared.
ROLLING = {"epsd": "epsd", "constant_torque": "cdt", "none": "off"}

PAIRS = {
    "bed20k-sorted": Pair(),
    "bed20k-shuffled": Pair(order="shuffled"),
    "bed100k-sorted": Pair(particles=100000, steps=400, warmup=100),
    "bed100k-shuffled": Pair(particles=100000, steps=400, warmup=100, order="shuffled"),
    "bed20k-sorted-cdt": Pair(rolling="constant_torque"),
    "bed20k-shuffled-cdt": Pair(rolling="constant_torque", order="shuffled"),
    "bed100k-sorted-cdt": Pair(particles=100000, steps=400, warmup=100, rolling="constant_torque"),
    "bed100k-shuffled-cdt": Pair(particles=100000, steps=400, warmup=100, order="shuffled",
                                 rolling="constant_torque"),
    # From one start the two part after some 2,500 steps, as chaos makes any two runs do: before
    # that they are compared instant by instant, and in "shear-long" by means over a strain of 3.
    "shear": Pair(workload="shear", steps=3000, warmup=200, check_steps=1800, samples=18,
                  tangential="mindlin_displacement"),
    "shear-long": Pair(workload="shear", steps=1000, warmup=2000, check_steps=60000, samples=240,
                       tangential="mindlin_displacement", chaotic=True),
    # Not the same law where grains roll and spin: LIGGGHTS divides by the whole relative spin and
    # then takes the part along the normal off; the stresses of a sheared bed differ by 8 to 15 %.
    "shear-cdt": Pair(workload="shear", steps=3000, warmup=200, check_steps=1800, samples=18,
                      tangential="mindlin_displacement", rolling="constant_torque",
                      same_law=False),
    "two-threads": Pair(cores=2, ranks=2),
    "two-worlds": Pair(cores=2, worlds=2, ranks=2),
    "two-threads-cdt": Pair(cores=2, ranks=2, rolling="constant_torque"),
    "two-worlds-cdt": Pair(cores=2, worlds=2, ranks=2, rolling="constant_torque"),
    # LIGGGHTS drops a contact's history, and counts a grain twice, where facets meet: with 480 of
    # them the wheel's torque is 17 % low from the first contacts on, with 48 about 4 %.
    "wheel": Pair(workload="wheel", scenes=("full", "needed"), sides=48,
                  tangential="mindlin_displacement"),
    "bed20k-lammps": Pair(peer="lammps", same_law=False),
}

# What the engine promises: median of the turns' ratios of rates, of a wheel of the times until the
# run stops itself. `--pair targets` runs these pairs; the ratio of the wheel's second scene counts
# what is left out, too.
TARGETS = {"bed20k-sorted": 3.5, "bed20k-sorted-cdt": 3.5, "bed20k-shuffled-cdt": 3.5,
           "bed100k-sorted-cdt": 3.5, "bed100k-shuffled-cdt": 3.5, "shear": 3.0,
           "two-threads-cdt": 3.5, "two-worlds-cdt": 3.5, "wheel": 3.5, "wheel-scene": 10.0}

# Both scenes of a wheel are timed beside the same runs of the peer.
ALIASES = {"wheel-scene": ("wheel",), "targets": tuple(TARGETS), "all": tuple(PAIRS)}


def named(words):
    """The pairs of `--pair`, each once, in order; KeyError of a word that names none."""
    names = []
    while words:
        word, *words = words
        if word in ALIASES:
            words = [*ALIASES[word], *words]
        elif word not in names:
            PAIRS[word]
            names.append(word)
    return names
