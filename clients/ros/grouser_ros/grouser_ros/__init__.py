"""Grouser's answers for ROS: what does not depend on a version of ROS. The nodes are in ../nodes; docs/ros.md."""
