"""The nodes' parameters: names, defaults, and what is made of them; what is read of messages. No ROS here."""

import math

import grouser

from .history import stamp_of
from .joints import JointReader, wheel_joints
from .monitor import LEAST_SPEED, LEAST_VARIANCE, MAX_AGE, VehicleMonitor
from .speed_mask import read_speed_mask

#: Name and default, whose type is the parameter's. "": not given.
DEFAULTS = {
    "vehicle": "",  # a vehicle file
    "soil": "",  # of that file; the first
    "joints": [""],  # WHEEL:JOINT where they differ
    "steering_joints": [""],  # WHEEL:JOINT, of a steered vehicle
    "twist_type": "Twist",  # or TwistStamped, Odometry
    "max_age": MAX_AGE,  # of twist and orientation [s]
    "least_speed": LEAST_SPEED,  # slower is rest [m/s]
    "least_variance": list(LEAST_VARIANCE),  # of v_x, v_y [m^2/s^2], yaw rate [rad^2/s^2]
    "margins": True,
    "base_frame": "base_link",
    "map": "",  # a folder of ./grouser map
    "way": "least",  # of its bands; see read_speed_mask
    "drive_unknown": False,  # cells that the map knows nothing of
    "datum": [0.0, 0.0],  # easting, northing of the map frame's origin [m]
    "map_frame": "map",
}
TWIST_TYPES = ("Twist", "TwistStamped", "Odometry")
UNKNOWN_VARIANCE = 1e6  # of what wheels do not tell: velocity up, roll and pitch rate


def _fits(value, default):
    if isinstance(default, list):
        return isinstance(value, (list, tuple)) and all(_fits(v, default[0]) for v in value)
    if isinstance(default, float):
        return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return isinstance(value, type(default))


def checked(get):
    """{name: value} of get(name, default). Raises grouser.Error for a value of another kind."""
    values = {}
    for name, default in DEFAULTS.items():
        value = get(name, default)
        values[name] = value.tolist() if hasattr(value, "tolist") else value  # ROS 2 has arrays
        if not _fits(values[name], default):
            quotes = "; text that reads as a number takes quotes: \"'045'\"" if isinstance(default, str) else ""
            raise grouser.Error(f"parameter {name}: got {values[name]!r}, expected one like {default!r}{quotes}")
    if values["twist_type"] not in TWIST_TYPES:
        raise grouser.Error(f"parameter twist_type: got '{values['twist_type']}', expected of {', '.join(TWIST_TYPES)}")
    if not (values["vehicle"] or values["map"]):
        raise grouser.Error("parameters: got neither vehicle nor map, expected a vehicle file, a folder of "
                            "./grouser map, or both")
    if len(values["datum"]) != 2:
        raise grouser.Error(f"parameter datum: got {values['datum']}, expected easting and northing")
    return values


def make(values):
    """(VehicleMonitor or None, SpeedMask or None). Raises grouser.Error."""
    monitor = mask = None
    if values["vehicle"]:
        vehicle = grouser.Vehicle.open(values["vehicle"])
        reader = JointReader(vehicle, *(wheel_joints(name, values[name]) for name in ("joints", "steering_joints")))
        monitor = VehicleMonitor(vehicle, reader, values["soil"], values["least_variance"], values["max_age"],
                                 values["margins"], values["least_speed"])
    if values["map"]:
        mask = read_speed_mask(values["map"], values["way"], values["datum"], values["drive_unknown"])
    return monitor, mask


def set_twist(monitor, message):
    """Of a Twist, TwistStamped or Odometry. Raises grouser.Error."""
    stamp = stamp_of(message)
    while hasattr(message, "twist"):
        message = message.twist
    monitor.set_twist(message.linear.x, message.linear.y, message.angular.z, stamp)


def set_orientation(monitor, message):
    """Of an Imu, unless it has none, which a first covariance of -1 says. Raises grouser.Error."""
    if message.orientation_covariance[0] >= 0:
        q = message.orientation
        monitor.set_orientation(q.x, q.y, q.z, q.w, stamp_of(message))


def answer(monitor, joints, frame, out, make_wheel, twist):
    """Fills the VehicleAnswer `out` and the TwistWithCovarianceStamped `twist` of a JointState. Returns whether there
    are an answer and a twist with a covariance."""
    if not monitor.answer(out, make_wheel, joints.name, joints.position, joints.velocity, stamp_of(joints)):
        return False, False
    out.header.stamp, out.header.frame_id = joints.header.stamp, frame
    twist.header = out.header
    to, covariance = twist.twist.twist, [UNKNOWN_VARIANCE * (k % 7 == 0) for k in range(36)]
    to.linear.x, to.linear.y, to.angular.z = out.predicted_v_x, out.predicted_v_y, out.predicted_yaw_rate
    places = (0, 1, 5)  # of v_x, v_y, yaw rate in x, y, z, roll, pitch, yaw
    for k, value in enumerate(out.predicted_covariance):
        covariance[6 * places[k // 3] + places[k % 3]] = value
    twist.twist.covariance = covariance
    return True, not math.isnan(sum(covariance))
