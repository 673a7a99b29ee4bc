#!/usr/bin/python3
"""Writes a bag of a made-up drive of the husky: twist and joint states at 20 Hz. The wheels turn as its solver says of
the soil, in the last third 10 % faster, as on ground that gives way."""

import argparse
import math

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import JointState

import grouser

RATE, START = 20, 1000  # [1/s], [s]: any time above 0


def drive(seconds, soil):
    """Twists (v_x, v_y, yaw rate) and rim speeds by wheel."""
    husky = grouser.Vehicle.open(grouser.VEHICLE_DIR / "husky.vehicle.yaml")
    time = np.arange(int(seconds * RATE)) / RATE
    asked = grouser.Motions.of(v_x=0.4 + 0.2 * np.sin(time), yaw_rate=0.5 * np.sin(1.7 * time), soil=husky.soil(soil))
    solved = grouser.VehicleSolver(husky).solve(asked)
    faster = np.where(np.arange(time.size) < 2 * time.size // 3, 1.0, 1.1)
    return husky, np.stack([asked.v_x, solved.v_y, asked.yaw_rate], -1), solved.wheel.rim_speed * faster[:, None]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", metavar="OUT.bag")
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--soil", default="asphalt")
    options = parser.parse_args()
    husky, twists, rims = drive(options.seconds, options.soil)
    spins = rims / [w.radius_m for w in husky.wheel_places]
    with rosbag.Bag(options.out, "w") as bag:
        for k, ((v_x, v_y, yaw_rate), spin) in enumerate(zip(twists, spins)):
            stamp = rospy.Time(START + k // RATE, k % RATE * 10**9 // RATE)
            twist, joints = TwistStamped(), JointState()
            twist.header.stamp = joints.header.stamp = stamp
            twist.twist.linear.x, twist.twist.linear.y, twist.twist.angular.z = v_x, v_y, yaw_rate
            joints.name = [f"{name}_wheel" for name in husky.wheel_names]
            joints.velocity = spin.tolist()
            joints.position = [math.nan] * len(joints.name)  # of wheels that nobody counts
            bag.write("twist", twist, stamp)
            bag.write("joint_states", joints, stamp + rospy.Duration.from_sec(0.5 / RATE))


if __name__ == "__main__":
    main()
