"""A vehicle's twist and joint states in; slips, power, margins and the covariance of its odometry out.

No ROS here: answers are objects whose attributes are set, with the names of VehicleAnswer.msg and WheelAnswer.msg.
"""

import math
import threading
import time

import numpy as np
from grouser import BALANCED_RESIDUAL, WORSE_BY_SD, Error, Motions, Reason, VehicleSolver

TWIST, JOINT_STATES = 0, 1  # VehicleAnswer.motion_from
MOTION = ("v_x", "v_y", "yaw_rate", "grade", "bank")
MARGINS = ("tip_margin", "torque_margin", "sinkage_margin")
ENERGY = ("joules_per_metre", "joules_per_metre_low", "joules_per_metre_high")
SOLVED = ("residual", "shaft_power", *MARGINS)
NUMBERS = MOTION + SOLVED + ENERGY + (
    "electric_power", "electric_power_low", "electric_power_high", "traction_margin", "traction_margin_low",
    "p_go_least", "p_go_most", "predicted_v_x", "predicted_v_y", "predicted_yaw_rate")
#: Of a WheelAnswer: the solver's names, "model_" before those that are measured as well.
WHEEL = {name: name for name in ("load", "f_x", "f_y", "torque", "m_z", "sinkage", "shaft_power")} | {
    name: f"model_{name}" for name in ("rim_speed", "v_x", "v_y", "slip", "slip_angle")}


def slope_of(x, y, z, w):
    """(grade, bank) [rad] of the orientation of the vehicle's axes in axes whose z is up, a unit quaternion.

    With the height of the tips of the vehicle's x and y axes, x_z = sin(grade), y_z = cos(grade) sin(bank).
    """
    square = x * x + y * y + z * z + w * w
    if not (math.isfinite(square) and abs(square - 1) < 1e-3):
        raise Error(f"imu: orientation: got ({x}, {y}, {z}, {w}), expected a quaternion of length 1")
    grade = math.asin(max(-1.0, min(1.0, 2 * (x * z - w * y) / square)))
    sine = 2 * (y * z + w * x) / square / max(math.cos(grade), 1e-9)
    return grade, math.asin(max(-1.0, min(1.0, sine)))


class VehicleMonitor:
    """Keeps the latest twist, slope and soil, and answers each joint state. For any number of threads.

    least_variance: of v_x, v_y, yaw rate, added to the predicted covariance: encoders and what else is not the ground.
    max_age: of the twist [s]; an older one does not count. margins: false leaves out P(GO) and traction margins.
    Raises grouser.Error.
    """

    def __init__(self, vehicle, reader, soil="", least_variance=(0.0, 0.0, 0.0), max_age=0.5, margins=True):
        if len(least_variance) != 3 or not all(math.isfinite(v) and v >= 0 for v in least_variance):
            raise Error(f"least_variance: got {list(least_variance)}, expected 3 numbers, 0 or above")
        self.vehicle, self.reader, self.solver = vehicle, reader, VehicleSolver(vehicle)
        self.least_variance, self.max_age, self.margins = np.diag(least_variance), max_age, margins
        self._twist, self._twist_at, self._slope = None, -math.inf, (0.0, 0.0)
        self._problems, self._lock = {}, threading.Lock()  # of the latest message that was refused, by its kind
        self.set_soil(soil or vehicle.soils[0])

    def set_soil(self, name):
        """Raises Error for one that the vehicle does not have; the soil before stays."""
        index = self.vehicle.soil(name)
        with self._lock:
            self.soil, self._soil = name, index

    def set_twist(self, v_x, v_y, yaw_rate):
        """Raises Error for numbers that are not finite, as do the answers until the next twist."""
        with self._lock:
            self._twist, self._twist_at = (float(v_x), float(v_y), float(yaw_rate)), time.monotonic()
            problem = "" if all(map(math.isfinite, self._twist)) else (
                f"twist: got v_x {v_x}, v_y {v_y}, yaw rate {yaw_rate}, expected finite numbers")
            self._keep("twist", problem)

    def set_orientation(self, x, y, z, w):
        """Of the vehicle's axes: grade and bank. Raises Error as set_twist."""
        with self._lock:
            try:
                self._slope, problem = slope_of(x, y, z, w), ""
            except Error as error:
                problem = str(error)
            self._keep("imu", problem)

    def _keep(self, kind, problem):
        self._problems[kind] = problem
        if problem:
            raise Error(problem)

    def answer(self, out, make_wheel, names, position, velocity):
        """Writes the answer to a joint state into `out`, a VehicleAnswer; make_wheel() makes a WheelAnswer. Returns
        whether any of the joints is the vehicle's. Where a message is refused, `out.problem` says why, the reason is
        INPUT and every number NaN."""
        with self._lock:
            out.vehicle, out.soil = self.vehicle.name, self.soil
            refused = self._problems.get("imu")
            if time.monotonic() - self._twist_at <= self.max_age:
                refused = self._problems.get("twist") or refused
            try:
                if refused:
                    raise Error(refused)
                joints = self.reader.read(names, position, velocity)
            except Error as error:
                self._refuse(out, str(error))
                return True
            if joints is None:
                return False
            out.problem = ""
            self._answer(out, make_wheel, *joints)
            return True

    @staticmethod
    def _refuse(out, problem):
        for name in NUMBERS:
            setattr(out, name, math.nan)
        out.problem, out.motion_from, out.wheels = problem, JOINT_STATES, []
        out.reasons = out.predicted_reasons = int(Reason.INPUT)
        out.predicted_covariance = [math.nan] * 9

    def _ground(self):
        return {"grade": self._slope[0], "bank": self._slope[1], "soil": self._soil}

    def _predict(self, out, rims, psi):
        """The twist of these rim speeds at the mean ground and 1.645 standard deviations z worse and better; covariance

            (dt/dz)(dt/dz)^T + diag(least_variance),  dt/dz = (t(1.645) - t(-1.645))/(2 1.645)
        """
        steering = {"steering": psi} if self.vehicle.steered else {}
        s = self.solver.solve(Motions.of(
            rim_speed=[self.reader.drive_speeds(rims, psi)] * 3, worse_by_sd=[0.0, WORSE_BY_SD, -WORSE_BY_SD],
            **steering, **self._ground()), fields=("v_x", "v_y", "yaw_rate", "residual"))
        twists = np.stack([s.v_x, s.v_y, s.yaw_rate], -1)
        twists[~(s.residual <= BALANCED_RESIDUAL)] = math.nan
        out.predicted_v_x, out.predicted_v_y, out.predicted_yaw_rate = map(float, twists[0])
        out.predicted_reasons = int(s.reasons[0])
        slope = (twists[1] - twists[2]) / (2 * WORSE_BY_SD)
        out.predicted_covariance = (np.outer(slope, slope) + self.least_variance).ravel().tolist()

    def _answer(self, out, make_wheel, rims, psi):
        self._predict(out, rims, psi)
        fresh = time.monotonic() - self._twist_at <= self.max_age
        twist = self._twist if fresh else (out.predicted_v_x, out.predicted_v_y, out.predicted_yaw_rate)
        out.motion_from = TWIST if fresh else JOINT_STATES
        for name, value in zip(MOTION, twist + self._slope):
            setattr(out, name, value)
        motion = {"v_x": [twist[0]], "yaw_rate": twist[2], **self._ground()}
        s = self.solver.solve(Motions.of(**motion), fields=(*SOLVED, "wheel"))
        e = self.solver.energy(Motions.of(**motion), fields=("electric", "electric_low", "electric_high", *ENERGY))
        out.reasons = int(s.reasons[0])
        for name in SOLVED:
            setattr(out, name, float(getattr(s, name)[0]))
        for name in ENERGY:
            setattr(out, name, float(getattr(e, name)[0]))
        for end in ("", "_low", "_high"):
            setattr(out, f"electric_power{end}", float(getattr(e, f"electric{end}")[0]))
        out.traction_margin = out.traction_margin_low = out.p_go_least = out.p_go_most = math.nan
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
            largest = max(abs(wheel.rim_speed), math.hypot(wheel.v_x, wheel.v_y))
            wheel.slip = (wheel.rim_speed - wheel.v_x) / largest if largest > 0 else math.nan
            wheel.slip_angle = math.atan2(wheel.v_y, wheel.v_x) if largest > 0 else math.nan
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
