#!/usr/bin/python3
"""Prints the answers of a running node as CSV, a line each; ends after --count of them, or where none comes in
--patience seconds (exit code 1). A node of a planner that slows down where traction ends would begin so."""

import argparse
import queue
import sys

import rospy
from grouser_msgs.msg import VehicleAnswer

NAMES = ("v_x", "yaw_rate", "electric_power", "electric_power_low", "electric_power_high", "traction_margin",
         "traction_margin_low", "p_go_least")


def line_of(answer):
    slips = [wheel.slip for wheel in answer.wheels]
    numbers = [getattr(answer, name) for name in NAMES] + slips
    return ",".join([f"{answer.header.stamp.to_sec():.3f}", *(f"{n:.5g}" for n in numbers)])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--topic", default="/grouser/answer")
    parser.add_argument("--count", type=int, default=0, help="0: until it is ended")
    parser.add_argument("--patience", type=float, default=30)
    options = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("print_answers", anonymous=True)
    answers, printed = queue.Queue(), 0
    rospy.Subscriber(options.topic, VehicleAnswer, answers.put)
    while not rospy.is_shutdown() and not 0 < options.count <= printed:
        try:
            answer = answers.get(timeout=options.patience)
        except queue.Empty:
            print(f"print_answers: no answer on {options.topic} in {options.patience:g} s", file=sys.stderr)
            return 1
        if not answer.wheels:
            print(f"print_answers: {answer.problem or f'no motion, reasons {answer.reasons}'}", file=sys.stderr)
            continue
        if printed == 0:
            print(",".join(["time_s", *NAMES, *(f"slip_{wheel.name}" for wheel in answer.wheels)]), flush=True)
        print(line_of(answer), flush=True)
        printed += 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
