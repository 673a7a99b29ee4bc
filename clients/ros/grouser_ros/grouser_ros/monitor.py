"""A vehicle's twist and joint states in; slips, power, margins and the covariance of its odometry out.

No ROS here: answers are objects whose attributes are set, with the names of VehicleAnswer.msg and WheelAnswer.msg.
"""

import math
import threading
import time

import numpy as np
from grouser import BALANCED_RESIDUAL, WORSE_BY_SD, Error, Motions, Reason, VehicleSolver

from .history import History

TWIST, JOINT_STATES = 0, 1  # VehicleAnswer.motion_from
IMU, LEVEL = 0, 1  # VehicleAnswer.slope_from
# Defaults of the node's parameters
MAX_AGE, LEAST_SPEED, LEAST_VARIANCE = 0.5, 1e-3, (1e-4, 1e-4, 1e-4)  # [s], [m/s], [m^2/s^2], [rad^2/s^2]
MOTION = ("v_x", "v_y", "yaw_rate", "grade", "bank")
ENERGY = tuple(f"{what}{end}" for what in ("joules_per_metre", "electric") for end in ("", "_low", "_high"))
SOLVED = ("residual", "shaft_power", "tip_margin", "torque_margin", "sinkage_margin")
NUMBERS = MOTION + SOLVED + tuple(name.replace("electric", "electric_power") for name in ENERGY) + (
    "traction_margin", "traction_margin_low", "p_go_least", "p_go_most", "predicted_v_x", "predicted_v_y",
    "predicted_yaw_rate")
#: Of a WheelAnswer: the solver's names, "model_" before those that are measured as well.
WHEEL = {name: name for name in ("load", "f_x", "f_y", "torque", "m_z", "sinkage", "shaft_power")} | {
    name: f"model_{name}" for name in ("rim_speed", "v_x", "v_y", "slip", "slip_angle")}


def slope_of(x, y, z, w):
    """(grade, bank) [rad] of the orientation of the vehicle's axes in axes whose z is up, a unit quaternion.

    With the heights of the tips of the vehicle's axes, x_z = sin(grade), y_z = cos(grade) sin(bank) and
    z_z = cos(grade) cos(bank); z_z has to be above 0. Raises Error.
    """
    square = x * x + y * y + z * z + w * w
    if not (math.isfinite(square) and abs(square - 1) < 1e-3):
        raise Error(f"imu: orientation: got ({x}, {y}, {z}, {w}), expected a quaternion of length 1")
    x_z, y_z, z_z = 2 * (x * z - w * y) / square, 2 * (y * z + w * x) / square, 1 - 2 * (x * x + y * y) / square
    if z_z <= 0:
        raise Error(f"imu: orientation: got ({x}, {y}, {z}, {w}), whose z axis points down, expected a vehicle on its "
                    "wheels, and an IMU in the vehicle's axes")
    return math.asin(max(-1.0, min(1.0, x_z))), math.atan2(y_z, z_z)


def _finite_twist(v_x, v_y, yaw_rate):
    if not all(map(math.isfinite, (v_x, v_y, yaw_rate))):
        raise Error(f"twist: got v_x {v_x}, v_y {v_y}, yaw rate {yaw_rate}, expected finite numbers")
    return float(v_x), float(v_y), float(yaw_rate)


class VehicleMonitor:
    """Keeps the latest twists and slopes and the soil, and answers joint states. For any number of threads. Stamps are
    seconds, None: without (history.py).

    least_variance: of v_x, v_y, yaw rate, added to the predicted covariance: encoders and what else is not the ground.
    max_age: of twist and orientation [s]; an older one does not count. margins: false leaves out P(GO) and traction
    margins. least_speed: slower is rest [m/s], of the origin, of a hub, or of hub and rim. Raises grouser.Error.
    """

    def __init__(self, vehicle, reader, soil="", least_variance=LEAST_VARIANCE, max_age=MAX_AGE, margins=True,
                 least_speed=LEAST_SPEED):
        if len(least_variance) != 3 or not all(math.isfinite(v) and v > 0 for v in least_variance):
            raise Error(f"least_variance: got {list(least_variance)}, expected 3 numbers above 0")
        for name, value in (("max_age", max_age), ("least_speed", least_speed)):
            if not (math.isfinite(value) and value > 0):
                raise Error(f"{name}: got {value}, expected a number above 0")
        self.vehicle, self.reader, self.solver = vehicle, reader, VehicleSolver(vehicle)
        self.least_variance, self.margins, self.least_speed = np.diag(least_variance), margins, least_speed
        self._twists, self._slopes, self._lock = History(max_age), History(max_age), threading.Lock()
        self.set_soil(soil or vehicle.soils[0])

    def set_soil(self, name):
        """Raises Error for one that the vehicle does not have; the soil before stays."""
        index = self.vehicle.soil(name)
        with self._lock:
            self.soil, self._soil = name, index

    def set_twist(self, v_x, v_y, yaw_rate, stamp=None):
        """Raises Error for numbers that are not finite; so are refused the joint states that this twist belongs to."""
        self._keep(self._twists, stamp, _finite_twist, v_x, v_y, yaw_rate)

    def set_orientation(self, x, y, z, w, stamp=None):
        """Of the vehicle's axes. Raises Error as set_twist, for what slope_of refuses."""
        self._keep(self._slopes, stamp, slope_of, x, y, z, w)

    def _keep(self, history, stamp, read, *values):
        arrived, problem = time.monotonic(), None  # before the lock is waited for
        try:
            item = read(*values)
        except Error as error:
            item = problem = error
        with self._lock:
            history.add(item, stamp, arrived)
        if problem:
            raise problem

    def answer(self, out, make_wheel, names, position, velocity, stamp=None):
        """Writes the answer to a joint state into `out`, a VehicleAnswer; make_wheel() makes a WheelAnswer. Returns
        whether any of the joints is the vehicle's. Where a message is refused, `out.problem` says why, the reason is
        INPUT and every number NaN."""
        arrived = time.monotonic()
        with self._lock:
            twist, slope = self._twists.at(stamp, arrived), self._slopes.at(stamp, arrived)
            out.soil, soil = self.soil, self._soil
        out.vehicle, out.problem, out.wheels = self.vehicle.name, "", []
        out.motion_from, out.slope_from = JOINT_STATES if twist is None else TWIST, LEVEL if slope is None else IMU
        for name in NUMBERS:
            setattr(out, name, math.nan)
        out.predicted_covariance = [math.nan] * 9
        try:
            joints = self.reader.read(names, position, velocity)
            if joints is None:
                return False
            for item in (twist, slope):
                if isinstance(item, Error):
                    raise Error(str(item))
        except Error as error:
            out.problem = str(error)
            out.reasons = out.predicted_reasons = int(Reason.INPUT)
            return True
        out.grade, out.bank = slope or (0.0, 0.0)
        ground = {"grade": out.grade, "bank": out.bank, "soil": soil}
        predicted = self._predict(out, *joints, ground)
        if twist or predicted:
            self._answer(out, make_wheel, *joints, twist or predicted, ground)
        else:
            out.reasons = out.predicted_reasons
        return True

    def _predict(self, out, rims, psi, ground):
        """The twist t of these rim speeds on ground z = 0, 1.645 and -1.645 standard deviations worse; covariance

            (dt/dz)(dt/dz)^T + diag(least_variance),  dt/dz = (t(z) - t(z'))/(z - z')

        with z and z' the outermost of these that have a solution. NaN, with the reason BALANCE, where only 0 has one.
        Returns t(0), None where it has none.
        """
        steering = {"steering": psi} if self.vehicle.steered else {}
        z = np.array([0.0, WORSE_BY_SD, -WORSE_BY_SD])
        s = self.solver.solve(Motions.of(rim_speed=[self.reader.drive_speeds(rims, psi)] * 3, worse_by_sd=z, **steering,
                                         **ground), fields=("v_x", "v_y", "yaw_rate", "residual"))
        twists, solved = np.stack([s.v_x, s.v_y, s.yaw_rate], -1), s.residual <= BALANCED_RESIDUAL
        out.predicted_reasons = int(s.reasons[0])
        if not solved[0]:
            return None
        out.predicted_v_x, out.predicted_v_y, out.predicted_yaw_rate = predicted = tuple(map(float, twists[0]))
        worst, best = 1 if solved[1] else 0, 2 if solved[2] else 0
        if worst == best:
            out.predicted_reasons |= int(Reason.BALANCE)
            return predicted
        slope = (twists[worst] - twists[best]) / (z[worst] - z[best])
        out.predicted_covariance = (np.outer(slope, slope) + self.least_variance).ravel().tolist()
        return predicted

    def _answer(self, out, make_wheel, rims, psi, twist, ground):
        v_x, v_y, yaw_rate = twist
        hubs = [math.hypot(v_x - yaw_rate * w.y_m, v_y + yaw_rate * w.x_m) for w in self.reader.wheels]
        if max(hubs) < self.least_speed:
            twist = v_x, v_y, yaw_rate = 0.0, 0.0, 0.0
        out.v_x, out.v_y, out.yaw_rate = twist
        motion = {"v_x": [v_x], "yaw_rate": yaw_rate, **ground}
        s = self.solver.solve(Motions.of(**motion), fields=(*SOLVED, "wheel"))
        e = self.solver.energy(Motions.of(**motion), fields=ENERGY)
        out.reasons = int(s.reasons[0])
        for name in SOLVED:
            setattr(out, name, float(getattr(s, name)[0]))
        for name in ENERGY:
            if name.startswith("electric") or math.hypot(v_x, v_y) >= self.least_speed:
                setattr(out, name.replace("electric", "electric_power"), float(getattr(e, name)[0]))
        if self.margins and not s.reasons[0] & Reason.INPUT:
            out.p_go_least, out.p_go_most = (float(p[0]) for p in self.solver.probability_to_go(Motions.of(**motion)))
            out.traction_margin, out.traction_margin_low = self._traction_margins(motion)
        out.wheels = self._wheels(make_wheel, twist, rims, psi, s.wheel)

    def _wheels(self, make_wheel, twist, rims, psi, solved):
        """Measured slips, and the model's answers."""
        v_x, v_y, yaw_rate = twist
        c, s = self.reader.directions(psi)
        wheels = []
        for i, place in enumerate(self.reader.wheels):
            wheel, length = make_wheel(), math.hypot(c[i], s[i])
            x, y = v_x - yaw_rate * place.y_m, v_y + yaw_rate * place.x_m
            wheel.name, wheel.rim_speed = self.vehicle.wheel_names[i], float(rims[i])
            wheel.v_x, wheel.v_y = float((c[i] * x + s[i] * y) / length), float((c[i] * y - s[i] * x) / length)
            hub = math.hypot(wheel.v_x, wheel.v_y)
            largest = max(abs(wheel.rim_speed), hub)
            wheel.slip = (wheel.rim_speed - wheel.v_x) / largest if largest >= self.least_speed else math.nan
            wheel.slip_angle = math.atan2(wheel.v_y, wheel.v_x) if hub >= self.least_speed else math.nan
            for name, field in WHEEL.items():
                setattr(wheel, field, float(getattr(solved, name)[0, i]))
            wheel.flags = int(solved.flags[0, i])
            wheels.append(wheel)
        return wheels

    def _traction_margins(self, motion):
        """The largest acceleration over g, in the sense of the motion, that balances with all wheels' help, on mean and
        on worse ground: pull_over_weight of ./grouser vehicle constants (the same bisection), at this motion."""
        worse = np.array([0.0, WORSE_BY_SD])
        sense = -1.0 if motion["v_x"][0] < 0 else 1.0

        def balances(over_g):
            s = self.solver.solve(Motions.of(
                **motion, worse_by_sd=worse, acceleration=sense * over_g * self.vehicle.gravity_m_per_s2),
                fields=("residual", "tip_margin"))
            return (s.residual <= BALANCED_RESIDUAL) & (s.tip_margin > 0)

        low, high = np.zeros(2), np.full(2, 2.0)
        steady = balances(low)
        for _ in range(20):
            middle = (low + high) / 2
            good = balances(middle)
            low, high = np.where(good, middle, low), np.where(good, high, middle)
        return tuple(float(v) for v in np.where(steady, low, math.nan))
