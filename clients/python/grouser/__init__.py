"""Grouser in your own process: what will this wheel do on this soil?

Models of a wheel on a soil (Model, ModelSelector), vehicles on their ground (Vehicle, VehicleSolver,
SpeedPlanner); states and answers are NumPy arrays, read and written where they are. Running servers
are asked by grouser.client; run_campaign, fit and calibrate_soil start Grouser's programs. SI and radians;
x forward, y left, z up (REP-103). Forces are those of the soil on the wheel, at its centre, in the
wheel's contact frame. What is refused raises Error; what is of another kind altogether, a string for
a number say, raises TypeError as everywhere. How: docs/python.md.
"""

import pathlib

from ._core import (
    BALANCED_RESIDUAL,
    WORSE_BY_SD,
    AccuracyRequest,
    Domain,
    Draws,
    Error,
    GradeRange,
    Margins,
    Model,
    ModelSelector,
    SkidConstants,
    SpeedOptions,
    SpeedPlanner,
    Vehicle,
    VehicleSolver,
    WheelPlace,
)
from .arrays import Answers, Motions, OutputArrays, Path, Powers, Solutions, SpeedPlan, States, WheelArrays
from .names import OUTPUTS, Binding, Flag, Reason
from .programs import ProgramError, calibrate_soil, fit, run_campaign

#: Folders of the models and vehicles that come with Grouser.
MODEL_DIR = pathlib.Path(__file__).parent.absolute() / "models"
VEHICLE_DIR = MODEL_DIR.parent / "vehicles"

__all__ = [
    "BALANCED_RESIDUAL",
    "MODEL_DIR",
    "OUTPUTS",
    "VEHICLE_DIR",
    "WORSE_BY_SD",
    "AccuracyRequest",
    "Answers",
    "Binding",
    "Domain",
    "Draws",
    "Error",
    "Flag",
    "GradeRange",
    "Margins",
    "Model",
    "ModelSelector",
    "Motions",
    "OutputArrays",
    "Path",
    "Powers",
    "ProgramError",
    "Reason",
    "SkidConstants",
    "Solutions",
    "SpeedOptions",
    "SpeedPlan",
    "SpeedPlanner",
    "States",
    "Vehicle",
    "VehicleSolver",
    "WheelArrays",
    "WheelPlace",
    "calibrate_soil",
    "fit",
    "run_campaign",
]
