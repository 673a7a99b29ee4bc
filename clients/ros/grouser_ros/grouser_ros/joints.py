"""From the arrays of a JointState to the rim speeds and the steering of a vehicle. No ROS here."""

import difflib
import math

import numpy as np
from grouser import Error

MOST_OFF = 0.15  # of a steered wheel from where the steering as a whole has it [rad]


def wheel_joints(name, items):
    """{wheel: joint} of a parameter, a list of 'WHEEL:JOINT'. Raises Error."""
    joints = {}
    for item in items:
        wheel, _, joint = str(item).partition(":")
        if item and not (wheel and joint):
            raise Error(f"{name}: got '{item}', expected WHEEL:JOINT")
        if wheel in joints:
            raise Error(f"{name}: got wheel '{wheel}' twice, expected it once")
        if item:
            joints[wheel] = joint
    return joints


class JointReader:
    """Reads joint states of one vehicle.

    spin_joints: {wheel: joint that turns it}, where that has another name than the wheel.
    steering_joints: {wheel: joint that steers it}, of one steered wheel or more. With L, the centre and the steering
    psi of the vehicle file (docs/planning.md), wheel i points along (c, s) and has the angle delta:

        B = y/L,  A = (x - centre)/L,  (c, s) = (cos psi - B sin psi, A sin psi)
        psi = atan2(sgn(A) sin delta, |A| cos delta + sgn(A) B sin delta)

    The rim speed of a drive is the q of least squares of r_i w_i = a_i q over its wheels: a_i = 1, but hypot(c, s) of a
    steered wheel and c of the others where each has a motor of its own and the vehicle steers. Wheels of one drive that
    turn alike may share a joint.
    """

    def __init__(self, vehicle, spin_joints=None, steering_joints=None):
        self.vehicle, self.wheels = vehicle, vehicle.wheel_places
        names, spin, steers = vehicle.wheel_names, spin_joints or {}, steering_joints or {}
        for what, given in (("joints", spin), ("steering_joints", steers)):
            for wheel in given:
                if wheel not in names:
                    raise Error(f"{what}: got wheel '{wheel}', expected of {', '.join(names)}")
        self.spin = [spin.get(name, name) for name in names]
        turned_by = {}
        for joint, wheel, name in zip(self.spin, self.wheels, names):
            by = wheel.drive if wheel.drive >= 0 and not wheel.own_motor else name
            if turned_by.setdefault(joint, by) != by or joint in steers.values():
                raise Error(f"joints: got '{joint}' of wheel '{name}' and of another, expected one for each drive at "
                            "least, and others for steering")
        self.driven = [joint for joint, wheel in zip(self.spin, self.wheels) if wheel.drive >= 0]
        self.along = [(w.x_m - vehicle.steering_centre_m) / vehicle.steering_length_m for w in self.wheels]
        self.across = [w.y_m / vehicle.steering_length_m for w in self.wheels]
        can_steer = [name for name, w, a in zip(names, self.wheels, self.along) if w.steered and abs(a) > 1e-6]
        for wheel in steers:
            if wheel not in can_steer:
                raise Error(f"steering_joints: got wheel '{wheel}', expected of {', '.join(can_steer) or 'none'}")
        if vehicle.steered and not steers:
            raise Error(f"steering_joints: got none, expected one or more of the wheels {', '.join(can_steer)}")
        self.steers = {names.index(wheel): joint for wheel, joint in steers.items()}

    def read(self, names, position, velocity):
        """(r w by wheel [m/s], psi [rad]); None where no joint is the vehicle's, as in joint states of an arm. Joints
        of wheels that roll freely may be missing: NaN. Raises Error for what else is missing, or is not finite."""
        at = {name: i for i, name in enumerate(names)}
        needed = self.driven + list(self.steers.values())
        if not any(joint in at for joint in needed):
            return None
        for joint in needed:
            if joint not in at:
                near = difflib.get_close_matches(joint, names, 1)
                hint = f"; did you mean '{near[0]}'?" if near and near[0] not in needed else ""
                raise Error(f"joint_states: got no joint '{joint}' among {', '.join(names)}, expected it{hint}")

        def value(what, array, joint, free=False):
            if len(array) != len(names):
                raise Error(f"joint_states: {what}: got {len(array)} entries, expected {len(names)}, one a name")
            number = float(array[at[joint]])
            if not (math.isfinite(number) or free):
                raise Error(f"joint_states: {what} of '{joint}': got {number}, expected a finite number")
            return number if math.isfinite(number) else math.nan

        rims = [w.radius_m * value("velocity", velocity, joint, w.drive < 0) if joint in at else math.nan
                for joint, w in zip(self.spin, self.wheels)]
        angles = {i: value("position", position, joint) for i, joint in self.steers.items()}
        psi = sum(self._psi(*a) for a in angles.items()) / max(len(angles), 1)
        c, s = self.directions(psi)
        for i, delta in angles.items():
            if abs(s[i] * math.cos(delta) - c[i] * math.sin(delta)) > math.sin(MOST_OFF) * math.hypot(c[i], s[i]):
                raise Error(f"joint_states: position of '{self.steers[i]}': got {delta}, expected "
                            f"{math.atan2(s[i], c[i]):.3g} by the mean of all steering joints, to {MOST_OFF}")
        return np.array(rims), psi

    def _psi(self, i, delta):
        sense, a, b = math.copysign(1, self.along[i]), abs(self.along[i]), self.across[i]
        return math.atan2(sense * math.sin(delta), a * math.cos(delta) + sense * b * math.sin(delta))

    def directions(self, psi):
        """(c, s) of every wheel: rows; not of unit length. (1, 0) of one that is not steered."""
        c, s = np.cos(psi) - np.sin(psi) * np.array(self.across), np.sin(psi) * np.array(self.along)
        steered = np.array([w.steered for w in self.wheels])
        return np.where(steered, c, 1.0), np.where(steered, s, 0.0)

    def drive_speeds(self, rims, psi):
        """Rim speed of each drive [m/s], of those of the wheels."""
        c, s = self.directions(psi)
        unsteered = np.cos(psi) - np.sin(psi) * np.array(self.across)
        speeds = []
        for drive in range(self.vehicle.drives):
            mine = [i for i, w in enumerate(self.wheels) if w.drive == drive]
            own = self.vehicle.steered and self.wheels[mine[0]].own_motor
            a = np.array([(math.hypot(c[i], s[i]) if self.wheels[i].steered else unsteered[i]) if own else 1.0
                          for i in mine])
            speeds.append(float(a @ rims[mine] / (a @ a)))
        return speeds
