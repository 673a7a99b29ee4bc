"""What the nodes of ROS 1 and ROS 2 do alike: topics, and what is done with each message. The messages are ROS's."""

import grouser
from geometry_msgs.msg import Twist, TwistStamped, TwistWithCovarianceStamped
from grouser_msgs.msg import VehicleAnswer, WheelAnswer
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from . import parameters
from .speed_mask import fill_grid

TWISTS = {"Twist": Twist, "TwistStamped": TwistStamped, "Odometry": Odometry}
QUEUE = 10  # messages of a topic that wait while a joint state is answered


class Node:
    """Subscriptions and publishers of what the parameters ask for.

    ros: what differs: get(name, default) of a parameter, publisher(name, kind, latched), subscribe(topic, kind,
    callback), now(), info(text), error(text). Raises grouser.Error.
    """

    def __init__(self, ros):
        self.ros, self.values = ros, parameters.checked(ros.get)
        self.monitor, mask = parameters.make(self.values)
        if mask:
            for name, cells in (("speed_mask", mask.speed), ("keepout_mask", mask.keepout)):
                grid = fill_grid(OccupancyGrid(), mask, cells, self.values["map_frame"])
                grid.header.stamp = ros.now()
                ros.publisher(name, OccupancyGrid, True).publish(grid)
            ros.info(f"speed_mask: m/s = {mask.limit / 100:.9g} times the cell")
        if self.monitor:
            self.answers = ros.publisher("answer", VehicleAnswer, False)
            self.twists = ros.publisher("twist", TwistWithCovarianceStamped, False)
            for topic, kind, take in (("twist", TWISTS[self.values["twist_type"]], parameters.set_twist),
                                      ("imu", Imu, parameters.set_orientation),
                                      ("soil", String, lambda monitor, message: monitor.set_soil(message.data))):
                ros.subscribe(topic, kind, self.reporting(take))
            ros.subscribe("joint_states", JointState, self.answer)

    def reporting(self, take):
        """A callback that logs what `take` refuses."""

        def callback(message):
            try:
                take(self.monitor, message)
            except grouser.Error as error:
                self.ros.error(str(error))

        return callback

    def answer(self, joints):
        out, twist = VehicleAnswer(), TwistWithCovarianceStamped()
        answered, moves = parameters.answer(self.monitor, joints, self.values["base_frame"], out, WheelAnswer, twist)
        if out.problem:
            self.ros.error(out.problem)
        if moves:
            self.twists.publish(twist)
        if answered:
            self.answers.publish(out)
