"""Reads the JSON forms of grouser.v1alpha1 messages: runs and responses."""

import math

OUTPUTS = ("f_x", "f_y", "f_z", "torque", "m_z", "sinkage")
# f_z is the load by construction: it says nothing about a model.
PREDICTED = ("f_x", "f_y", "torque", "m_z", "sinkage")
NEAR_SLIP = 0.07  # runs this near to a slip are drawn with its curve
EXTRAPOLATED = 4  # STATE_FLAG_EXTRAPOLATED (demo_report_test compares)
# Output: label, unit on paper, factor from SI to it.
AXES = {
    "f_x": ("drawbar pull $f_x$", "N", 1.0),
    "f_y": ("lateral force $f_y$", "N", 1.0),
    "f_z": ("vertical force $f_z$", "N", 1.0),
    "torque": ("drive torque", "N m", 1.0),
    "m_z": ("moment $m_z$", "N m", 1.0),
    "sinkage": ("sinkage", "mm", 1000.0),
}


def number(value):
    """JSON of proto3 writes NaN, Infinity and 64-bit integers as strings."""
    return math.nan if value is None else float(value)


def degrees(radians):
    return math.degrees(number(radians))


class Run:
    """One DEM run: kinematics and the means with their standard errors."""

    def __init__(self, record, role=""):
        self.record = record
        self.role = role.replace("RUN_ROLE_", "").lower()
        self.run_id = record["run_id"]
        self.status = record["status"].replace("RUN_STATUS_", "")
        self.slip = number(record["slip"])
        self.angle_deg = degrees(record["attack_angle_rad"])
        spec = record["spec"]
        self.load_n = number(spec["state"]["load_n"])
        self.seed = int(spec["seed"])
        outputs = {entry["name"]: entry for entry in record["outputs"]}
        self.mean = {name: number(entry["mean"]) for name, entry in outputs.items()}
        self.standard_error = {name: number(entry["standard_error"])
                               for name, entry in outputs.items()}

    @property
    def steady(self):
        return self.status == "STEADY"

    def broken_rules(self):
        return [rule for rule in self.record["rules"] if not rule["kept"]]


class Responses:
    """WheelResponses: arrays by output, and the echo of the kinematics."""

    def __init__(self, message):
        self.message = message
        self.slip = [number(x) for x in message["slip"]["slip"]]
        self.angle_deg = [degrees(x) for x in message["slip"]["attack_angle_rad"]]
        self.level = number(message["interval_level"])
        self.flags = [int(x) for x in message["flags"]]

    def array(self, output, field="value"):
        return [number(x) for x in self.message[output][field]]
