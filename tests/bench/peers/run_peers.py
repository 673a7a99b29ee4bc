#!/usr/bin/python3
"""Times the engine beside LIGGGHTS (and LAMMPS) on the same beds, in the same run.

    run_peers.py --bench build/.../grouser-engine-bench --pair targets [--repeat 5] [--json OUT]

Peer and ours take turns (A B A B ...), pinned to the same cores. What is compared is the time of
the run loop alone: "Loop time" of the peer, the stepping time of ours. For each pair it prints
medians, spread (least to most) and the ratio of each turn, and checks that both codes agree on the
physics and, of the pairs of `--pair targets`, that the ratio is what the engine promises: exit
status 3 if not. Of the ten outputs of a wheel, judged at two standard errors, one may differ by
chance.
`--install` installs the peers from Debian first (apt-get). Standard library only.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from pairs import ALIASES, PAIRS, TARGETS, named  # noqa: E402
from peer import Failure, Machine, Peer  # noqa: E402
from physics import compare  # noqa: E402
from wheel_pair import run_wheel  # noqa: E402
from wheel_pair import show as show_wheel  # noqa: E402


MOST_WHEEL_TURNS = 3  # minutes each


def check_programs(names, install):
    missing = [n for n in names if shutil.which(n) is None]
    if missing and install:
        subprocess.run(["apt-get", "install", "-y", "liggghts", "lammps"], check=True)
        missing = [n for n in names if shutil.which(n) is None]
    if missing:
        raise Failure(f"not installed: {', '.join(missing)}; run again with --install, or "
                      "apt-get install liggghts lammps")


def spread(values):
    return {"median": statistics.median(values), "least": min(values), "most": max(values)}


def run_pair(name, pair, machine, repeat):
    """One row: the turns, the ratio of each, the physics."""
    peer = Peer(name, pair, machine)
    peer.choose_skin()
    theirs, ours, shares = [], [], []
    result = None
    for turn in range(repeat):
        rate, busy_peer = peer.time()
        theirs.append(rate)
        result, busy = machine.ours(pair)
        ours.append(result["particle_steps_per_s"])
        shares.append((busy_peer, busy))
        print(f"  {name} turn {turn + 1}: peer {rate:.4g}, ours {ours[-1]:.4g}", file=sys.stderr)
    ratios = [a / b for a, b in zip(ours, theirs)]
    row = {"pair": name, "workload": pair.workload, "particles": result["particles"],
           "order": pair.order, "rolling": pair.rolling, "cores": pair.cores,
           "worlds": pair.worlds, "isa": result["isa"], "peer": pair.peer, "ranks": pair.ranks,
           "steps": pair.steps, "peer_skin_m": peer.skin,
           "peer_particle_steps_per_s": spread(theirs),
           "particle_steps_per_s": spread(ours), "ratio": spread(ratios),
           "ratio_of_medians": statistics.median(ours) / statistics.median(theirs),
           "least_cpu_share": min(min(s) for s in shares),
           # Ranks that wait for one another burn time: no such number for several.
           "ratio_by_cpu_time": None if pair.ranks > 1 else statistics.median(
               b / sb / (a / sa) for a, b, (sa, sb) in zip(theirs, ours, shares)),
           "engine": result}
    row["physics"] = compare(pair, peer, machine)
    return row


def show(row):
    p, o, r = row["peer_particle_steps_per_s"], row["particle_steps_per_s"], row["ratio"]
    print(f"{row['pair']}: {row['peer']} {p['median']:.4g} ({p['least']:.4g} to {p['most']:.4g}), "
          f"ours {o['median']:.4g} ({o['least']:.4g} to {o['most']:.4g}) particle-steps/s: "
          f"ratio {row['ratio_of_medians']:.2f} (turns {r['least']:.2f} to {r['most']:.2f}); "
          f"peer's skin {row['peer_skin_m'] * 1e3:.3g} mm")
    for name, c in row["physics"].items():
        limit = "" if c["limit"] is None else f", limit {100 * c['limit']:.2g} %"
        verdict = "" if c["agrees"] is None else (" ok" if c["agrees"] else " DIFFERS")
        error = c["peer_standard_error"]
        give = "" if error is None else f" +- {error:.2g}"
        print(f"    {name}: peer {c['peer']:.6g}{give}, ours {c['ours']:.6g}, "
              f"{100 * c['difference']:+.2f} %{limit}{verdict}")
    if row["least_cpu_share"] < 0.97:
        by_cpu = row["ratio_by_cpu_time"]
        print(f"    NOT QUIET: a run had {100 * row['least_cpu_share']:.0f} % of its cores, others "
              "the rest; " + ("several ranks: this ratio means nothing" if by_cpu is None else
                              f"ratio by CPU time {by_cpu:.2f}"))


def judge_speed(row):
    """Adds the target and whether the median of the turns reaches it; prints both."""
    target = TARGETS.get(row["pair"])
    ratio = row.get("speed_up_to_stop", row["ratio"])["median"]
    row["target"], row["reaches_target"] = target, None if target is None else ratio >= target
    if target is not None:
        print(f"    target {target:g}: {ratio:.2f} {'ok' if ratio >= target else 'MISSED'}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bench", required=True, help="the program grouser-engine-bench")
    parser.add_argument("--pair", default="all", help=f"targets, all, or of: {', '.join(PAIRS)} (commas)")
    parser.add_argument("--repeat", type=int, default=5, help="turns of each")
    parser.add_argument("--work", default="peers_work", help="folder for beds and scratch")
    parser.add_argument("--cores", default="0,1", help="cores to pin to, the first for one core")
    parser.add_argument("--share", type=float, default=1.0, help="of the steps, for a quick look")
    parser.add_argument("--json", metavar="FILE", help="rows as a JSON array")
    parser.add_argument("--install", action="store_true", help="apt-get install the peers")
    arguments = parser.parse_args()
    try:
        try:
            names = named(arguments.pair.split(","))
        except KeyError as word:
            raise Failure(f"{word}: no such pair, expected of "
                          f"{', '.join([*ALIASES, *PAIRS])}") from None
        chosen = [PAIRS[n].scaled(arguments.share) for n in names]
        check_programs(sorted({p.program for p in chosen} | {"taskset"}), arguments.install)
        machine = Machine(arguments.bench, arguments.work, arguments.cores.split(","))
        rows = []
        for name, pair in zip(names, chosen):
            if pair.workload == "wheel":
                # Both scenes of a wheel are timed beside the same runs of the peer.
                new = run_wheel(name, pair, machine, min(arguments.repeat, MOST_WHEEL_TURNS))
                for row in new:
                    show_wheel(row)
            else:
                new = [run_pair(name, pair, machine, arguments.repeat)]
                show(new[0])
            for row in new:
                judge_speed(row)
            rows += new
            sys.stdout.flush()
            if arguments.json:
                with open(arguments.json, "w", encoding="utf-8") as f:
                    json.dump(rows, f, indent=1)
    except (Failure, OSError, subprocess.SubprocessError) as error:
        print(f"run_peers.py: {error}", file=sys.stderr)
        return 1
    agree = all(c["agrees"] is not False for r in rows for c in r["physics"].values())
    fast = all(r["reaches_target"] is not False for r in rows)
    return 0 if agree and fast else 3


if __name__ == "__main__":
    sys.exit(main())
