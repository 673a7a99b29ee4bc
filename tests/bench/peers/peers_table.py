#!/usr/bin/python3
"""Prints the rows that run_peers.py --json wrote as Markdown tables: peers_table.py FILE.json"""
import json
import sys

UNITS = {"f_x_n": "F_x N", "f_y_n": "F_y N", "f_z_n": "F_z N", "torque_n_m": "torque N m",
         "sinkage_m": "sinkage m"}


def spread(s, scale=1.0, digits=2):
    return (f"{s['median'] / scale:.{digits}f} ({s['least'] / scale:.{digits}f} to "
            f"{s['most'] / scale:.{digits}f})")


def bed_rows(rows):
    print("| pair | peer, 1e6 particle-steps/s | ours | ratio of medians (turns) | least share of "
          "its cores | overlap, coordination, stress zz, xz differ by |")
    print("| --- | --- | --- | --- | --- | --- |")
    for r in rows:
        apart = [f"{100 * c['difference']:+.2f} %" for k, c in r["physics"].items()
                 if c["limit"] is not None or k != "stress_xz_pa"]
        print(f"| {r['pair']} | {spread(r['peer_particle_steps_per_s'], 1e6)} | "
              f"{spread(r['particle_steps_per_s'], 1e6)} | **{r['ratio_of_medians']:.1f}** "
              f"({r['ratio']['least']:.1f} to {r['ratio']['most']:.1f}) | "
              f"{100 * r['least_cpu_share']:.0f} % | {', '.join(apart)} |")


def wheel_rows(rows):
    print("| row | turns | peer, 1e6 particle-steps/s | ours | ratio | peer's wall time to the "
          "stop, s | ours | SPEED-UP to the stop |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for r in rows:
        print(f"| {r['pair']} | {len(r['stops'])} | "
              f"{spread(r['peer_particle_steps_per_s'], 1e6)} | "
              f"{spread(r['particle_steps_per_s'], 1e6)} | **{spread(r['ratio'], 1, 1)}** | "
              f"{spread(r['peer_wall_to_stop_s'], 1, 0)} | {spread(r['wall_to_stop_s'], 1, 0)} | "
              f"**{spread(r['speed_up_to_stop'], 1, 1)}** |")
    print("\n| row | output | peer | ours | difference | in standard errors |")
    print("| --- | --- | --- | --- | --- | --- |")
    for r in rows:
        for name, c in r["physics"].items():
            print(f"| {r['pair']} | {UNITS[name]} | {c['peer']:.4g} | {c['ours']:.4g} | "
                  f"{c['difference']:+.2g} | {c['z']:+.1f} |")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as f:
        rows = json.load(f)
    wheels = [r for r in rows if "speed_up_to_stop" in r]
    bed_rows([r for r in rows if "ratio_of_medians" in r and "physics" in r])
    if wheels:
        print()
        wheel_rows(wheels)


if __name__ == "__main__":
    main()
