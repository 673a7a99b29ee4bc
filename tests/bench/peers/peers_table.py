#!/usr/bin/python3
"""Prints the rows that run_peers.py --json wrote as a Markdown table: peers_table.py FILE.json"""
import json
import sys


def million(spread):
    return (f"{spread['median'] / 1e6:.2f} ({spread['least'] / 1e6:.2f} to "
            f"{spread['most'] / 1e6:.2f})")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as f:
        rows = json.load(f)
    print("| pair | peer, 1e6 particle-steps/s | ours | ratio of medians (turns) | least share of "
          "its cores | overlap, coordination, stress zz differ by |")
    print("| --- | --- | --- | --- | --- | --- |")
    for r in rows:
        if "ratio_of_medians" not in r or "physics" not in r:
            continue
        worst = [f"{100 * r['physics'][k]['difference']:+.2f} %" for k in
                 ("mean_overlap_over_radius", "coordination", "stress_zz_pa") if k in r["physics"]]
        print(f"| {r['pair']} | {million(r['peer_particle_steps_per_s'])} | "
              f"{million(r['particle_steps_per_s'])} | **{r['ratio_of_medians']:.1f}** "
              f"({r['ratio']['least']:.1f} to {r['ratio']['most']:.1f}) | "
              f"{100 * r['least_cpu_share']:.0f} % | {', '.join(worst)} |")


if __name__ == "__main__":
    main()
