"""Read by catkin_python_setup() of ROS 1 alone."""
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["grouser_ros"], package_dir={"": "."}))
