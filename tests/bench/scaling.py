#!/usr/bin/python3
"""How the engine's rate depends on grains, contacts, threads and worlds, as Markdown tables.

    scaling.py --bench build/.../grouser-engine-bench [--work DIR] [--largest 100000] [--cores 2]

Each row is the median of `--repeat` runs; phases in nanoseconds per particle-step. Beds are made
once and kept in DIR. Standard library only.
"""
import argparse
import json
import os
import subprocess
import sys

GRAINS = (2000, 5000, 10000, 20000, 50000, 100000, 200000, 500000)
FRICTIONS = (0.01, 0.03, 0.1, 0.3, 0.5)
STEPS = 2e7  # particle-steps of a timing


def bench(arguments, particles, friction=0.1, cores=1, worlds=1):
    bed = os.path.join(arguments.work, f"bed{particles}" +
                       ("" if friction == 0.1 else f"-mu{friction}") + ".csv")
    pin = ["taskset", "-c", arguments.pin] if arguments.pin else []
    command = pin + [arguments.bench, "--particles", str(particles), "--bed", bed,
                     "--preparation-friction", str(friction), "--cores", str(cores), "--worlds",
                     str(worlds), "--steps", str(max(100, round(STEPS / particles / worlds))),
                     "--repeat", str(arguments.repeat), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"scaling.py: {' '.join(command)}\n{done.stderr}")
    return json.loads(done.stdout)


def row(first, r):
    work = r["particles"] * r["worlds"] * r["steps"]
    phases = " | ".join(f"{1e9 * s / work:.1f}" for s in r["phases"].values())
    print(f"| {first} | {r['particle_steps_per_s']:.3g} | {r['contacts_per_particle']:.2f} | "
          f"{phases} | {r['bytes_per_particle_step']:.0f} | {100 * r['share_of_copy_rate']:.0f} % |",
          flush=True)


def table(title, first):
    names = "search refresh pairs sum drift bodies".split()
    print(f"\n{title}\n\n| {first} | particle-steps/s | contacts | {' | '.join(names)} | "
          f"B per particle-step | of copy rate |\n|{' --- |' * (len(names) + 5)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bench", required=True)
    parser.add_argument("--work", default="peers_work")
    parser.add_argument("--largest", type=int, default=100000, help="grains")
    parser.add_argument("--cores", type=int, default=2, help="most")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--pin", default="", help="cores for taskset, as 0,1")
    arguments = parser.parse_args()
    os.makedirs(arguments.work, exist_ok=True)
    table("Grains (one core)", "grains")
    for n in (n for n in GRAINS if n <= arguments.largest):
        row(n, bench(arguments, n))
    table("Contacts (20,000 grains poured with this friction)", "friction")
    for mu in FRICTIONS:
        row(mu, bench(arguments, 20000, friction=mu))
    table("Threads in one world of 20,000 grains", "threads")
    for c in range(1, arguments.cores + 1):
        row(c, bench(arguments, 20000, cores=c))
    table("Worlds of 20,000 grains, one a thread", "worlds x threads")
    for c in range(1, arguments.cores + 1):
        for w in (c, 4 * c):
            row(f"{w} x {c}", bench(arguments, 20000, cores=c, worlds=w))


if __name__ == "__main__":
    main()
