#!/usr/bin/python3
"""Path, speed and energy of the rover of mujoco_rover.

  build/release/bin/mujoco_rover > out/rover.csv
  clients/mujoco/plot_rover.py out/rover.csv --out out/rover.png
"""

import argparse
import pathlib
import sys

import matplotlib

matplotlib.use("agg")
import numpy  # noqa: E402
from matplotlib import pyplot  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "common"))
from picture_options import Refused, check_picture, end_with, save  # noqa: E402

COLUMNS = ("time_s", "x_m", "y_m", "z_m", "yaw_deg", "speed_m_per_s", "motors_j", "kinetic_j", "potential_j",
           "soil_j", "rest_j")


def read(path):
    """The columns of the file by name; Refused where it is another."""
    with open(path, encoding="utf-8") as file:
        head = file.readline().strip().split(",")
        if tuple(head) != COLUMNS:
            raise Refused(f"{path}:1: got {','.join(head)}, expected {','.join(COLUMNS)}")
        try:
            rows = numpy.loadtxt(file, delimiter=",", ndmin=2)
        except ValueError as error:
            raise Refused(f"{path}: {error}") from None
    if rows.shape[0] < 2:
        raise Refused(f"{path}: {rows.shape[0]} rows, expected 2 or more")
    return dict(zip(COLUMNS, rows.T))


def draw(run, path):
    """Three panels into the picture `path`."""
    figure, (where, speed, energy) = pyplot.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
    time = run["time_s"]
    dots = where.scatter(run["x_m"], run["y_m"], c=1e3 * (run["z_m"] - run["z_m"][0]), s=6)
    figure.colorbar(dots, ax=where, label="height above the start [mm]")
    where.plot(run["x_m"][:1], run["y_m"][:1], "k^")
    where.set(xlabel="x [m]", ylabel="y [m]", title="Path", aspect="equal")
    speed.plot(time, run["speed_m_per_s"])
    speed.set(xlabel="time [s]", ylabel="speed [m/s]", title="Speed")
    heading = speed.twinx()
    heading.plot(time, numpy.degrees(numpy.unwrap(numpy.radians(run["yaw_deg"]))), color="C1", linewidth=1)
    heading.set_ylabel("heading [deg]", color="C1")
    potential = run["potential_j"] - run["potential_j"][0]
    for values, name in ((run["motors_j"], "work of the motors"), (run["soil_j"], "to the soil"),
                         (potential, "potential energy"), (1e2 * run["kinetic_j"], "kinetic energy, 100 times"),
                         (1e2 * run["rest_j"], "rest, 100 times")):
        energy.plot(time, values, label=name)
    energy.set(xlabel="time [s]", ylabel="energy [J]", title="Energy")
    energy.legend(fontsize=8)
    for axes in (where, speed, energy):
        axes.grid(alpha=0.3)
    save(figure, path, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", type=pathlib.Path, help="what mujoco_rover printed")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="the picture")
    options = parser.parse_args()
    check_picture(parser, options.out)
    draw(read(options.csv), options.out)


if __name__ == "__main__":
    end_with(main)
