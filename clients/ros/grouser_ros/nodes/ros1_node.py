#!/usr/bin/python3
"""Node for ROS 1: a vehicle's twist and joint states in; slips, power, margins, odometry's covariance, masks out.

Parameters (private): ../grouser_ros/parameters.py. Topics and meaning: docs/ros.md. Exit codes: 0 ended by a signal or
the master's order, 1 no master, or it went away, 2 a parameter or file is refused."""

import http.client
import pathlib
import sys
import threading
import types
import xmlrpc.client

import rosgraph
import rospy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))  # in place; an installation has it in its path
import grouser  # noqa: E402
from grouser_ros.node import QUEUE, Node  # noqa: E402

ASK_MASTER = 2.0  # seconds between questions whether it is there


class _Timed(xmlrpc.client.Transport):
    """A master that does not answer is none."""

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = 3
        return connection


def master_is_there(uri):
    try:
        return xmlrpc.client.ServerProxy(uri, _Timed()).getPid("/grouser")[0] == 1
    except (OSError, http.client.HTTPException, xmlrpc.client.Error):
        return False


ROS = types.SimpleNamespace(  # as of node.py
    get=lambda name, default: rospy.get_param(f"~{name}", default),
    publisher=lambda name, kind, latched: rospy.Publisher(f"~{name}", kind, queue_size=QUEUE, latch=latched),
    subscribe=lambda topic, kind, callback: rospy.Subscriber(topic, kind, callback, queue_size=QUEUE),
    now=rospy.Time.now,
    info=lambda text: rospy.loginfo(f"grouser: {text}"),
    error=lambda text: rospy.logerr_throttle_identical(1, f"grouser: {text}"))


def main():
    uri = rosgraph.get_master_uri()
    if not master_is_there(uri):
        print(f"grouser: no ROS master at {uri} (ROS_MASTER_URI): expected roscore or rosmaster there", file=sys.stderr)
        return 1
    rospy.init_node("grouser")
    try:
        Node(ROS)
    except grouser.Error as error:
        rospy.logfatal(f"grouser: {error}")
        return 2
    rospy.loginfo("grouser: ready")
    missed, over = 0, threading.Event()
    rospy.on_shutdown(over.set)
    while not over.wait(ASK_MASTER):
        missed = 0 if master_is_there(uri) else missed + 1
        if missed == 2:
            rospy.logfatal(f"grouser: the ROS master at {uri} went away")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
