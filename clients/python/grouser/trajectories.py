"""Candidate trajectories of a vehicle and what they cost, to and from messages. By grouser.client."""

import dataclasses
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from ._core import Error
from .arrays import Bits, Floats, Numbers
from .messages import array_of, extend, fill_named, wire_names
from .v1alpha1 import trajectory_pb2

Integers = npt.NDArray[np.int32]


@dataclasses.dataclass(eq=False)
class Trajectories:
    """K trajectories; each step is a steady motion that lasts for some time.

    Of M steps each: arrays of shape (K, M), one at least; (M,): entry j is of step j of every trajectory; or a
    number, of all steps. Of different numbers of steps: `steps` (K,), arrays of shape (n,), n = sum(steps), the
    steps of the first trajectory first; (max(steps),) or a number as before. None: 0.
    """

    v_x: Optional[Numbers] = None  #: of the origin [m/s]; required
    yaw_rate: Optional[Numbers] = None  #: to the left [rad/s]
    curvature: Optional[Numbers] = None  #: instead: yaw_rate = v_x curvature [1/m]
    duration: Optional[Numbers] = None  #: of each step, above 0 [s]
    length: Optional[Numbers] = None  #: instead, above 0: duration = length/|v_x| [m]
    acceleration: Optional[Numbers] = None  #: rate of v_x [m/s^2]
    yaw_acceleration: Optional[Numbers] = None  #: [rad/s^2]
    grade: Optional[Numbers] = None  #: the ground rises ahead [rad]
    bank: Optional[Numbers] = None  #: the ground rises to the left [rad]
    soil: Optional[Numbers] = None  #: of all wheels, index into vehicle(name).soils; None: the first
    steps: Optional[npt.ArrayLike] = None  #: of each trajectory, 1 or more; None: arrays of (K, M)


@dataclasses.dataclass(eq=False)
class TrajectorySteps:
    """Numbers of each step: arrays of the steps' shape, (K, M) or (n,). Margins as of Solutions."""

    reasons: Bits  #: uint32, bits of Reason
    residual: Optional[Floats] = None  #: balanced: <= BALANCED_RESIDUAL; of others the rest is not to be used
    electric: Optional[Floats] = None  #: [W]
    electric_low: Optional[Floats] = None  #: both ends NaN: no balance at one
    electric_high: Optional[Floats] = None
    tip_margin: Optional[Floats] = None
    torque_margin: Optional[Floats] = None
    sinkage_margin: Optional[Floats] = None


@dataclasses.dataclass(eq=False)
class TrajectoryCosts:
    """What K trajectories cost: arrays of shape (K,). Reasons and margins are those at the mean ground."""

    reasons: Bits  #: uint32, bits of Reason of all steps together
    duration: Optional[Floats] = None  #: of all steps [s]
    energy: Optional[Floats] = None  #: electric, of the steps that have a power and its interval [J]
    energy_low: Optional[Floats] = None  #: ends, of a ground that errs alike all along
    energy_high: Optional[Floats] = None
    distance: Optional[Floats] = None  #: way of the centre of gravity in these steps [m]
    energy_duration: Optional[Floats] = None  #: of these steps [s]
    steps_left_out: Optional[Bits] = None  #: of these sums: no balance; uint32
    duration_left_out: Optional[Floats] = None  #: [s]
    first_step: Optional[Integers] = None  #: that has a reason, int32; -1: none
    first_reasons: Optional[Bits] = None  #: its bits of Reason, uint32
    least_margin: Optional[Floats] = None  #: over the steps that balance; NaN: none does
    least_margin_of: Optional[Bits] = None  #: uint32: Reason.TIP, TORQUE or SINKAGE; 0: no step balances
    least_margin_step: Optional[Integers] = None  #: where it is, int32; -1: the same
    go_probability_least: Optional[Floats] = None  #: share of the draws on which all steps go; None: no draws
    go_probability_most: Optional[Floats] = None  #: the same; what the models' runs do not cover counts as going
    steps: Optional[TrajectorySteps] = None  #: where asked for
    latency: float = 0.0  #: in the server [s]


_DTYPES = {"steps_left_out": np.uint32, "first_step": np.int32, "first_reasons": np.uint32,
           "least_margin_of": np.uint32, "least_margin_step": np.int32}


def trajectories_message(trajectories: Trajectories) -> tuple[Any, tuple[int, ...]]:
    """As a message, and the steps' shape."""
    message = trajectory_pb2.Trajectories()
    given = {f.name: np.asarray(getattr(trajectories, f.name)) for f in dataclasses.fields(Trajectories)
             if f.name != "steps" and getattr(trajectories, f.name) is not None}
    if trajectories.steps is None:
        shapes = sorted({a.shape for a in given.values() if a.ndim > 1})
        if len(shapes) != 1 or len(shapes[0]) != 2:
            raise Error(f"trajectories: arrays of shapes {', '.join(map(str, shapes)) or 'of one dimension alone'}, "
                        "expected one shape (K, M), or steps")
        shape: tuple[int, ...] = shapes[0]
        counts = np.full(shape[0], shape[1])
    else:
        counts = np.asarray(trajectories.steps)
        if counts.ndim != 1 or counts.size == 0 or counts.dtype.kind not in "iu":
            raise Error(f"steps: {counts.dtype} of shape {counts.shape}, expected whole numbers (K,)")
        shape = (int(counts.sum()),)
    extend(message.steps, "steps", counts, counts.shape)
    fields, of_longest = wire_names(message), (int(counts.max(initial=0)),)
    for name, array in given.items():
        whole = array.shape if array.shape in ((), of_longest) else shape
        extend(getattr(message, fields[name]), name, array, whole)
    return message, shape


def costs_of(response: Any, count: int, shape: tuple[int, ...], with_steps: bool) -> TrajectoryCosts:
    """Of an EvaluateTrajectoriesResponse to so many trajectories."""
    def filled(kind: Any, message: Any, of: tuple[int, ...]) -> Any:
        out = kind(np.empty(0, np.uint32))
        known = [name for name in wire_names(message) if name != "reasons"]
        fill_named(message, of, ["reasons"], (), out, {"reasons": np.uint32})
        fill_named(message, of, known, (), out, _DTYPES)
        return out

    costs: TrajectoryCosts = filled(TrajectoryCosts, response.costs, (count,))
    costs.latency = response.latency.ToNanoseconds() / 1e9
    if len(response.go_probability_least) > 0:
        for name in ("go_probability_least", "go_probability_most"):
            setattr(costs, name, array_of(getattr(response, name), name, (count,)))
    if with_steps:
        costs.steps = filled(TrajectorySteps, response.steps, shape)
    return costs
