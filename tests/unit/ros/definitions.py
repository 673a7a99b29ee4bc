"""What stands in the message definitions of clients/ros, read as text; how a test is skipped."""

import os
import pathlib
import re

PACKAGES = pathlib.Path(os.environ["GROUSER_SOURCE"], "clients/ros")
MESSAGES = PACKAGES / "grouser_msgs/msg"
NAMES = ("VehicleAnswer", "WheelAnswer")
CONSTANT = re.compile(r"^\w+ (\w+)=(\d+)", re.M)
FIELD = re.compile(r"^[\w/]+(?:\[\d*\])? +([a-z][a-z0-9_]*)\s*(?:#.*)?$", re.M)


def constants_of(name):
    return {constant: int(value) for constant, value in CONSTANT.findall((MESSAGES / f"{name}.msg").read_text())}


def fields_of(name):
    return FIELD.findall((MESSAGES / f"{name}.msg").read_text())


def skip(test, why):
    """Skips it, and prints why on a line of its own, by which ./grouser test finds it."""
    print(f"\nskipped: {test.id()}: {why}", flush=True)
    test.skipTest(why)
