#!/usr/bin/python3
"""The least energy to a place uphill, round a patch of ice: a server weighs 256 sampled trajectories a call (MPPI)."""

import argparse

import matplotlib.pyplot as plt
import numpy as np

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("out", metavar="OUT.png")
parser.add_argument("server", metavar="HOST:PORT", nargs="?", default="127.0.0.1:50151", help="of ./grouser serve")
ARGUMENTS = parser.parse_args()

from grouser.client import Client, Trajectories  # noqa: E402 (needs python3-grpcio)

SAMPLES, STEPS, ROUNDS, DT, SPEED = 256, 36, 6, 0.5, 0.6
GOAL, ICE, ICE_RADIUS, SLOPE = np.array([10.0, 0.0]), np.array([5.0, -0.5]), 1.5, 0.06  # [m]; the ground rises along x


def weigh(client, soils, yaw_rate):
    """Costs of K sampled trajectories, by one call, and their places: yaw rates (K, M)."""
    heading = np.cumsum(yaw_rate, 1) * DT - yaw_rate * DT / 2
    x, y = np.cumsum(SPEED * DT * np.cos(heading), 1), np.cumsum(SPEED * DT * np.sin(heading), 1)
    on_ice = np.hypot(x - ICE[0], y - ICE[1]) < ICE_RADIUS
    costs = client.evaluate_trajectories(Trajectories(
        v_x=SPEED, yaw_rate=yaw_rate, duration=DT, grade=SLOPE * np.cos(heading), bank=-SLOPE * np.sin(heading),
        soil=np.where(on_ice, soils.index("ice"), soils.index("asphalt"))), "husky")
    missed = np.hypot(x - GOAL[0], y - GOAL[1]).min(1)
    slips = np.fmax(0, 0.3 - costs.least_margin) + (costs.steps_left_out > 0)
    return costs, costs.energy_high + 2000 * missed + 5000 * slips + 300 * on_ice.sum(1), x, y, missed


rng, plan, best = np.random.default_rng(1), np.zeros(STEPS), None
figure, axes = plt.subplots(figsize=(9, 4.5), constrained_layout=True)
with Client(ARGUMENTS.server, deadline=60) as server:
    names = list(server.vehicle("husky").soils)
    for spread in np.geomspace(0.3, 0.03, ROUNDS):
        noise = rng.normal(0, spread, (SAMPLES, STEPS // 6)).repeat(6, 1)
        noise[0] = 0
        costs, value, x, y, missed = weigh(server, names, plan + noise)
        axes.plot(x.T, y.T, color="grey", alpha=0.04)
        k = value.argmin()
        if best is None or value[k] < best[0]:
            best = (value[k], x[k], y[k], costs.energy_low[k], costs.energy[k], costs.energy_high[k], missed[k])
        weight = np.exp(-(value - value.min()) / (0.05 * value.std()))
        plan = plan + (weight[:, None] * noise).sum(0) / weight.sum()
_, x, y, low, energy, high, missed = best
print(f"{energy:.0f} J (90 %: {low:.0f} to {high:.0f}), {missed:.2f} m beside the goal")
axes.add_patch(plt.Circle(ICE, ICE_RADIUS, color="skyblue", zorder=3))
axes.plot(x, y, color="C1", lw=2, zorder=4)
axes.plot(*GOAL, "k*", ms=12, zorder=5)
axes.set(xlabel="x, uphill [m]", ylabel="y [m]", xlim=(-1, 12), ylim=(-3.5, 3.5), aspect="equal",
         title=f"{energy:.0f} J, 90 % {low:.0f} to {high:.0f} J; blue: ice")
figure.savefig(ARGUMENTS.out, dpi=90)
raise SystemExit(int(missed > 0.5))
