#!/usr/bin/python3
"""MPPI for a skid-steered rover, from beside a line onto it: the wheels of all rollouts are one call of the model."""

import argparse

import matplotlib.pyplot as plt
import numpy as np

import grouser

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("out", metavar="OUT.png")
OUT = parser.parse_args().out
ROLLOUTS, STEPS, CYCLES, DT = 256, 15, 60, 0.2
MODEL = grouser.Model.open(grouser.MODEL_DIR / "cmu-smooth-62.5.model")
CRUISE, R = MODEL.domain.speed_m_per_s, MODEL.radius_m
LOAD = (MODEL.domain.load_min_n * MODEL.domain.load_max_n) ** 0.5
X, Y = R * np.array([[3.2], [3.2], [-3.2], [-3.2]]), R * np.array([[2.9], [-2.9], [2.9], [-2.9]])  # of the hubs
MASS, INERTIA = 4 * LOAD / 9.81, 4 * LOAD / 9.81 * R**2 * (3.2**2 + 2.9**2) / 3
FIELDS = ("f_x.value", "f_x.d_v_x", "f_y.value", "f_y.d_v_y", "m_z.value", "torque.value")


def step(body, rim_speed):
    """Moves bodies (rows: x, y, yaw, u, v, r) by DT under the rim speeds of left and right; returns their power [W]."""
    _, _, yaw, u, v, r = body
    states = grouser.States.of(u - r * Y, v + r * X, np.where(Y > 0, *rim_speed), LOAD)
    a = MODEL.evaluate(states, fields=FIELDS)
    least = 0.2 * LOAD / np.maximum(np.abs(states.rim_speed), CRUISE / 10)  # forces at the step's end, by gradients
    along, across = np.fmax(-a.f_x.d_v_x, least), np.fmax(-a.f_y.d_v_y, least)
    u += (a.f_x.value.sum(0) + MASS * r * v) / (MASS / DT + along.sum(0))
    v += (a.f_y.value.sum(0) - MASS * r * u) / (MASS / DT + across.sum(0))
    moment = (X * a.f_y.value - Y * a.f_x.value + a.m_z.value).sum(0)
    r += moment / (INERTIA / DT + (along * Y**2 + across * X**2).sum(0))
    body[:3] += DT * np.array([u * np.cos(yaw) - v * np.sin(yaw), u * np.sin(yaw) + v * np.cos(yaw), r])
    return np.maximum(a.torque.value * states.rim_speed / R, 0).sum(0)


rng, plan, track = np.random.default_rng(1), np.full((STEPS, 2, 1), CRUISE), []
rover = np.array([[0], [-0.15], [0], [0.6 * CRUISE], [0], [0]])
for _ in range(CYCLES):
    noise = np.cumsum(rng.normal(0, 0.1 * CRUISE, (STEPS, 2, ROLLOUTS)), 0)
    tried = np.clip(plan + noise, 0.2 * CRUISE, 2 * CRUISE)
    bodies, cost = np.repeat(rover, ROLLOUTS, 1), 0
    for rim_speed in tried:
        power = step(bodies, rim_speed)
        cost += (bodies[1] / 0.05) ** 2 + 10 * bodies[2] ** 2 + (bodies[3] / (0.3 * CRUISE) - 2.3) ** 2 + 0.2 * power
    weight = np.exp(-(cost - cost.min()) / (0.1 * cost.std()))
    plan = (tried * weight).sum(-1, keepdims=True) / weight.sum()
    step(rover, plan[0])
    track.append([rover[0, 0], rover[1, 0], *plan[0, :, 0]])
    plan = np.concatenate([plan[1:], plan[-1:]])
x, y, *rim_speed = np.array(track).T
figure, axes = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
axes[0].plot(x, y)
axes[0].set(xlabel="x [m]", ylabel="y [m]", title="the rover's path; the line is y = 0")
axes[1].plot(DT * np.arange(1, len(x) + 1), np.transpose(rim_speed), label=["left", "right"])
axes[1].legend()
axes[1].set(xlabel="time [s]", ylabel="rim speed [m/s]")
figure.savefig(OUT, dpi=90)
raise SystemExit(f"{y[-1]:.3f} m beside the line" if abs(y[-1]) >= 0.05 else 0)
