"""The nodes' parameters: names, defaults, and what is made of them. No ROS here."""

import grouser

from .joints import JointReader, wheel_joints
from .monitor import VehicleMonitor
from .speed_mask import read_speed_mask

#: Name and default, whose type is the parameter's. "": not given.
DEFAULTS = {
    "vehicle": "",  # a vehicle file
    "soil": "",  # of that file; the first
    "joints": [""],  # WHEEL:JOINT where they differ
    "steering_joints": [""],  # WHEEL:JOINT, of a steered vehicle
    "twist_type": "Twist",  # or TwistStamped, Odometry
    "max_age": 0.5,  # of the twist [s]
    "least_variance": [0.0, 0.0, 0.0],  # of v_x, v_y [m^2/s^2], yaw rate [rad^2/s^2]
    "margins": True,
    "base_frame": "base_link",
    "map": "",  # a folder of ./grouser map
    "way": "least",  # of its bands; see read_speed_mask
    "datum": [0.0, 0.0],  # easting, northing of the map frame's origin [m]
    "map_frame": "map",
}
TWIST_TYPES = ("Twist", "TwistStamped", "Odometry")


def _fits(value, default):
    if isinstance(default, list):
        return isinstance(value, (list, tuple)) and all(_fits(v, default[0]) for v in value)
    if isinstance(default, float):
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    return isinstance(value, type(default))


def checked(get):
    """{name: value} of get(name, default). Raises grouser.Error for a value of another kind."""
    values = {}
    for name, default in DEFAULTS.items():
        value = get(name, default)
        values[name] = value.tolist() if hasattr(value, "tolist") else value  # ROS 2 has arrays
        if not _fits(values[name], default):
            raise grouser.Error(f"parameter {name}: got {values[name]!r}, expected one like {default!r}")
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
                                 values["margins"])
    if values["map"]:
        mask = read_speed_mask(values["map"], values["way"], values["datum"])
    return monitor, mask


def twist_of(message):
    """(v_x, v_y, yaw rate) of a Twist, TwistStamped or Odometry."""
    while hasattr(message, "twist"):
        message = message.twist
    return message.linear.x, message.linear.y, message.angular.z


def fill_twist(out, answer):
    """Writes the predicted twist of a VehicleAnswer into a TwistWithCovarianceStamped; False where there is none."""
    twist, covariance = out.twist.twist, [0.0] * 36
    twist.linear.x, twist.linear.y = answer.predicted_v_x, answer.predicted_v_y
    twist.angular.z = answer.predicted_yaw_rate
    places = (0, 1, 5)  # of v_x, v_y, yaw rate in x, y, z, roll, pitch, yaw
    for i, row in enumerate(places):
        for j, column in enumerate(places):
            covariance[6 * row + column] = answer.predicted_covariance[3 * i + j]
    out.twist.covariance = covariance
    numbers = [twist.linear.x, twist.linear.y, twist.angular.z, *covariance]
    return all(n == n for n in numbers)
