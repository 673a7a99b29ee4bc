"""A ROS master and nodes as processes of a test, on loopback alone; each is ended by its id. Exits with 77 without
ROS 1."""

import contextlib
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

for variable in [k for k in os.environ if k.startswith("ROS_")]:
    del os.environ[variable]  # names and addresses that the shell has for ROS are not the test's
try:
    import geometry_msgs.msg  # noqa: F401
    import nav_msgs.msg  # noqa: F401
    import rosbag  # noqa: F401
    import rosgraph
    import rosmaster  # noqa: F401
    import rospy  # noqa: F401
    import sensor_msgs.msg  # noqa: F401
    from grouser_msgs.msg import VehicleAnswer  # noqa: F401
except ImportError as missing:
    print(f"skipped: no ROS 1 ({missing}); its packages are the group ros of cmake/packages.debian")
    sys.exit(77)

SOURCE = pathlib.Path(os.environ["GROUSER_SOURCE"])
CLIENT = SOURCE / "clients/ros"
NODE = CLIENT / "grouser_ros/nodes/ros1_node.py"
PATIENCE = 40  # [s] for what takes a second or two on an idle machine


def wait_for(what, condition, patience=PATIENCE):
    """Until condition() is true; raises TimeoutError that says what was waited for."""
    end = time.monotonic() + patience
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not in {patience} s")
        time.sleep(0.05)


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def environment(folder, port):
    """Of processes that talk to the master at this port, and write nowhere but below folder."""
    return os.environ | {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_HOME": str(folder),
                         "ROS_LOG_DIR": str(folder), "PYTHONUNBUFFERED": "1"}


def end(process):
    """Asks it to end, then ends it."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def running(command, env, folder, name):
    """The process; its output goes to folder/name.out."""
    with open(pathlib.Path(folder, f"{name}.out"), "wb") as out:
        process = subprocess.Popen([str(c) for c in command], env=env, stdin=subprocess.DEVNULL, stdout=out,
                                   stderr=subprocess.STDOUT)
        try:
            yield process
        finally:
            end(process)


def output(folder, name):
    return pathlib.Path(folder, f"{name}.out").read_text(errors="replace")


@contextlib.contextmanager
def master():
    """(environment, folder, process) of a master that answers."""
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        env = environment(folder, port)
        with running(["/usr/bin/rosmaster", "--core", "-p", port], env, folder, "master") as process:
            uri = env["ROS_MASTER_URI"]
            wait_for("the master", lambda: rosgraph.is_master_online(uri) or process.poll() is not None)
            if process.poll() is not None:
                raise RuntimeError(f"rosmaster ended: {output(folder, 'master')}")
            yield env, folder, process


@contextlib.contextmanager
def node(env, folder, *parameters, name="grouser"):
    """A node that is ready."""
    with running(["/usr/bin/python3", NODE, f"__name:={name}", *parameters], env, folder, name) as process:
        wait_for(f"node {name}", lambda: "grouser: ready" in output(folder, name) or process.poll() is not None)
        if process.poll() is not None:
            raise RuntimeError(f"node {name} ended with {process.returncode}: {output(folder, name)}")
        yield process
