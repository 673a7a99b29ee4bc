#!/usr/bin/python3
"""A bed of grouser-engine-bench (--export) as a data file for LIGGGHTS and LAMMPS.

    bed_to_data.py BED.csv OUT.data

Both read `atom_style granular`/`sphere`: id type diameter density x y z. Type 1: grains that move;
2 and 3: the lower and the upper plate of a sheared bed. Standard library only.
"""
import math
import sys


def read_bed(path):
    """The settings of the header and the grains, each a list of the columns' numbers."""
    settings, grains, columns = {}, [], None
    with open(path, encoding="ascii") as f:
        for line in f:
            if line.startswith("#"):
                name, value = line[1:].strip().split("=")
                settings[name] = value if name == "kind" else float(value)
            elif columns is None:
                columns = line.strip().split(",")
            else:
                grains.append([float(v) for v in line.split(",")])
    return settings, grains


def type_of(grain):
    if not grain[11]:
        return 1
    return 3 if grain[5] > 0 else 2


def write_data(settings, grains, path, top=0.0):
    # Room above and below: z is not periodic. `top`: of what else must fit.
    d = settings["mean_diameter_m"]
    low = min(0.0, min(g[2] - g[3] for g in grains)) - d
    high = max(top, max(g[2] + g[3] for g in grains)) + 10 * d
    with open(path, "w", encoding="ascii") as f:
        f.write(f"bed of grouser-engine-bench\n\n{len(grains)} atoms\n3 atom types\n\n")
        f.write(f"0 {settings['length_m']!r} xlo xhi\n0 {settings['width_m']!r} ylo yhi\n")
        f.write(f"{low!r} {high!r} zlo zhi\n\nAtoms\n\n")
        for i, g in enumerate(grains, 1):
            density = g[4] / (4 / 3 * math.pi * g[3] ** 3)
            f.write(f"{i} {type_of(g)} {2 * g[3]:.17g} {density:.17g} {g[0]!r} {g[1]!r} {g[2]!r}\n")
        f.write("\nVelocities\n\n")
        for i, g in enumerate(grains, 1):
            f.write(f"{i} " + " ".join(f"{v:.9g}" for v in g[5:11]) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    write_data(*read_bed(sys.argv[1]), sys.argv[2])
