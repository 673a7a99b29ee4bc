"""What the tests of clients/ros share: vehicles, their monitors, messages without ROS."""

import math
import os
import pathlib
import types

import numpy as np
from grouser_ros.joints import JointReader
from grouser_ros.monitor import VehicleMonitor

import grouser
from grouser import Motions, Vehicle, VehicleSolver

SOURCE = pathlib.Path(os.environ["GROUSER_SOURCE"])
ROVER = SOURCE / "clients/mujoco/rover.vehicle.yaml"
SAND = SOURCE / "surrogate/pairs/cmu-smooth-62.5-8mm/hybrid.model"
SPEEDS = {"husky": 0.5, "warthog": 1.0, "rover": 0.04, "cart": 1.0, "atv": 1.0}  # of the shipped vehicles [m/s]


def shipped(name):
    return Vehicle.open(grouser.VEHICLE_DIR / f"{name}.vehicle.yaml")


class Turn:
    """A solved steady turn of a vehicle, and the joint state that belongs to it."""

    def __init__(self, vehicle, v_x, yaw_rate, soil=0, **others):
        self.motion = Motions.of(v_x=[v_x], yaw_rate=yaw_rate, soil=soil, **others)
        self.solved = VehicleSolver(vehicle).solve(self.motion)
        wheel, places = self.solved.wheel, vehicle.wheel_places
        self.twist = (v_x, float(self.solved.v_y[0]), yaw_rate)
        self.names = [f"{name}_spin" for name in vehicle.wheel_names]
        self.velocity = [rim / p.radius_m for rim, p in zip(wheel.rim_speed[0], places)]
        self.position = [math.nan] * len(places)
        self.steers = {}
        for name, place, angle in zip(vehicle.wheel_names, places, wheel.steer[0]):
            if place.steered:
                self.steers[name] = f"{name}_steer"
                self.names.append(f"{name}_steer")
                self.position.append(float(angle))
                self.velocity.append(0.0)

    def reader(self, vehicle):
        return JointReader(vehicle, {name: f"{name}_spin" for name in vehicle.wheel_names}, self.steers)

    def monitor(self, vehicle, **named):
        return VehicleMonitor(vehicle, self.reader(vehicle), **named)

    def ask(self, monitor, with_twist=True, **changed):
        """The answer to this turn's messages."""
        if with_twist:
            monitor.set_twist(*self.twist)
        out = types.SimpleNamespace()
        given = {"names": self.names, "position": self.position, "velocity": self.velocity} | changed
        answered = monitor.answer(out, types.SimpleNamespace, **given)
        return out if answered else None


def quaternion(grade, bank):
    """(x, y, z, w) of the axes whose x rises by grade and whose y by asin(cos(grade) sin(bank)): roll after pitch."""
    (sp, cp), (sr, cr) = ((math.sin(a / 2), math.cos(a / 2)) for a in (-grade, bank))
    return sr * cp, cr * sp, -sr * sp, cr * cp


def relative(a, b):
    """The largest difference over the largest number."""
    a, b = np.asarray(a), np.asarray(b)
    return np.abs(a - b).max() / max(np.abs(b).max(), 1e-300)
