"""Running servers by gRPC: NumPy arrays in and out, the bits of Model and VehicleSolver.

Client asks grouser-server (wheels and vehicles), JobsClient grouser-jobs. Needs python3-grpcio; the
rest of the package does not. Messages that are handed out as they are, as ModelInfo and Job, are
those of proto/grouser/v1alpha1, in grouser.v1alpha1. How: docs/python.md.
"""

import dataclasses
from collections.abc import Iterable
from typing import Any, NamedTuple, Optional

import numpy as np

from . import arrays, messages
from ._core import AccuracyRequest, Margins, SpeedOptions
from .arrays import Fields, Floats, Motions, Path, Powers, Solutions, SpeedPlan, States
from .channel import ABOUT, Connection, ServerError
from .jobs import JobsClient, Submitted
from .messages import make
from .names import Binding
from .queries import Query, ServedAnswers, WheelStream
from .trajectories import Trajectories, TrajectoryCosts, TrajectorySteps, costs_of, trajectories_message
from .v1alpha1 import (
    explanation_pb2,
    operator_service_pb2,
    operator_service_pb2_grpc,
    terrain_service_pb2,
    terrain_service_pb2_grpc,
    vehicle_pb2,
    vehicle_service_pb2,
    vehicle_service_pb2_grpc,
)

__all__ = [
    "Client",
    "JobsClient",
    "ServedAnswers",
    "ServedConstants",
    "ServedGrades",
    "ServedPlan",
    "ServerError",
    "Submitted",
    "Trajectories",
    "TrajectoryCosts",
    "TrajectorySteps",
    "WheelStream",
]


@dataclasses.dataclass(eq=False)
class ServedPlan(SpeedPlan):
    """A speed plan of a server."""

    hold_probability: Optional[float] = None  #: share of the draws on which all points hold; None: no draws
    point_hold_probability: Optional[Floats] = None  #: the same by point


class ServedGrades(NamedTuple):
    """As GradeRange, of one soil."""

    soil: str
    any: bool  #: False: none is driven; binding_up says why not the level
    down: float  #: the lowest [rad]
    up: float  #: the highest [rad]; both of one sign: not the level
    binding_down: Binding  #: beyond `down`
    binding_up: Binding  #: beyond `up`


class ServedConstants(NamedTuple):
    """As SkidConstants, of one soil, speed and radius of path; low and high: ends of the ground's 90 % interval."""

    soil: str
    speed: float  #: [m/s]
    radius: float  #: [m]
    separation_multiplier: float  #: (r - l)/(b yaw rate); NaN: no balance
    separation_low: float
    separation_high: float
    radius_multiplier: float  #: 2 v_x/(l + r)
    radius_low: float
    radius_high: float
    variance_speed: float  #: of odometry, of the ground alone [(m/s)^2]
    variance_yaw_rate: float  #: [(rad/s)^2]
    pull_over_weight: float  #: largest that balances, straight
    pull_low: float  #: 1.645 standard deviations worse
    reasons: int  #: bits of Reason


class Client(Connection):
    __doc__ = f"""Queries to grouser-server: wheels (1 to 10,000 states a call), vehicles.

    {ABOUT}
    """

    def __init__(self, address: str = "127.0.0.1:50151", **options: Any) -> None:
        super().__init__(address, **options)
        self._terrain = terrain_service_pb2_grpc.TerrainServiceStub(self._channel)
        self._vehicle = vehicle_service_pb2_grpc.VehicleServiceStub(self._channel)
        self._operator = operator_service_pb2_grpc.OperatorServiceStub(self._channel)

    def evaluate(self, states: States, model: str = "", *, accuracy: Optional[AccuracyRequest] = None,
                 fields: Fields = None, deadline: Optional[float] = None) -> ServedAnswers:
        """Answers n wheel states, of any shape; the bits of Model.evaluate.

        model: 'name' (its stable), 'name@alias', 'name@sha256:HEX'; empty: the only one, if there is one.
        accuracy: the cheapest model of that wheel and soil that is good enough answers each state.
        fields: what is answered, as of Answers.empty; what is not asked is not sent.
        """
        query = Query(model, accuracy, fields)
        request, shape = query.request(states)
        return query.answers(self._call(self._terrain.EvaluateWheels, request, deadline), shape)

    def stream(self, model: str = "", *, accuracy: Optional[AccuracyRequest] = None,
               fields: Fields = None) -> WheelStream:
        """A stream of such queries: `with client.stream(model) as stream: stream.evaluate(states)`, or send() several
        and receive() them. The same answers with less time in transport."""
        return WheelStream(self, self._terrain.StreamWheels, Query(model, accuracy, fields))

    def explain(self, state: States, model: str = "", *, max_runs: int = 0,
                deadline: Optional[float] = None) -> explanation_pb2.Explanation:
        """Why a model answers one state as it does: flags with reasons, parts of the intervals, nearest runs.

        max_runs: at most so many of each list of runs, up to 20; 0: 5.
        """
        request = make(terrain_service_pb2.ExplainRequest, model=model, state=messages.wheel_states(state)[0],
                       max_runs=max_runs)
        return self._call(self._terrain.Explain, request, deadline).explanation

    def models(self, *, deadline: Optional[float] = None) -> list[terrain_service_pb2.ModelInfo]:
        """The served models by name, then digest. deadline: of each page."""
        return self._all_pages(self._terrain.ListModels, terrain_service_pb2.ListModelsRequest(), "models", deadline)

    def model(self, model: str = "", *, deadline: Optional[float] = None) -> terrain_service_pb2.GetModelResponse:
        """One model with its error table and provenance."""
        return self._call(self._terrain.GetModel, make(terrain_service_pb2.GetModelRequest, model=model), deadline)

    def solve(self, motions: Motions, vehicle: str = "", *, fields: Fields = None,
              deadline: Optional[float] = None) -> Solutions:
        """Loads, slips, forces, power and margins of 1 to 3,000 motions; the bits of VehicleSolver.solve.

        vehicle: its name; empty: the only one, if there is one. Indices of soils: vehicle(name).soils.
        """
        message, shape = messages.motions_message(motions)
        request = make(vehicle_service_pb2.SolveRequest, vehicle=vehicle, motions=message)
        s = self._call(self._vehicle.Solve, request, deadline).solutions
        wanted = arrays.chosen(arrays.SOLUTION_NAMES, fields)
        out = Solutions(messages.array_of(s.reasons, "reasons", shape, np.uint32))
        own = [name for name in wanted if "." not in name]
        of_wheels = [name.partition(".")[2] for name in wanted if "." in name]
        messages.fill_named(s, shape, own, ("rim_speed",), out)
        messages.fill_named(s.wheels, shape, of_wheels, of_wheels, out.wheel, {"flags": np.uint32})
        return out

    def probability_to_go(self, motions: Motions, margins: Optional[Margins] = None, vehicle: str = "", *,
                          deadline: Optional[float] = None) -> tuple[Floats, Floats]:
        """As VehicleSolver.probability_to_go, of at most 120 motions: (least, most)."""
        message, shape = messages.motions_message(motions)
        request = make(vehicle_service_pb2.SolveRequest, vehicle=vehicle, motions=message, with_go_probability=True,
                       margins=messages.margins_message(margins or Margins()))
        response = self._call(self._vehicle.Solve, request, deadline)
        return (messages.array_of(response.go_probability_least, "go_probability_least", shape),
                messages.array_of(response.go_probability_most, "go_probability_most", shape))

    def energy(self, motions: Motions, vehicle: str = "", *, sds: Optional[float] = None, fields: Fields = None,
               deadline: Optional[float] = None) -> Powers:
        """Power of 1 to 3,000 motions, where it goes, with an interval; the bits of VehicleSolver.energy.

        sds: standard deviations of the ground to both ends of the interval; by default 1.645 (90 %).
        """
        message, shape = messages.motions_message(motions)
        request = make(vehicle_service_pb2.EnergyRequest, vehicle=vehicle, motions=message, interval_sds=sds)
        p = self._call(self._vehicle.Energy, request, deadline).powers
        wanted = arrays.chosen(arrays.POWER_NAMES, fields)
        out = Powers(messages.array_of(p.reasons, "reasons", shape, np.uint32))
        messages.fill_named(p, shape, wanted, ("wheel_shaft",), out)
        return out

    def evaluate_trajectories(self, trajectories: Trajectories, vehicle: str = "", *, sds: Optional[float] = None,
                              worse_by_sd: float = 0.0, steps: bool = False, draws: int = 0,
                              margins: Optional[Margins] = None, deadline: Optional[float] = None) -> TrajectoryCosts:
        """What candidate trajectories of 1 to 30,000 steps in all cost; each step has the bits of VehicleSolver.energy.

        sds: as of energy(); 0: no interval, in a third of the time. worse_by_sd: ground of all steps, as of Motions.
        steps: also numbers of each step. draws: also the share of so many coherent draws of the ground on which a
        trajectory leaves every margin at all its steps; draws times steps at most 100,000.
        """
        message, shape = trajectories_message(trajectories)
        request = make(vehicle_service_pb2.EvaluateTrajectoriesRequest, vehicle=vehicle, trajectories=message,
                       interval_sds=sds, worse_by_sd=worse_by_sd, with_steps=steps, draws=draws,
                       margins=messages.margins_message(margins or Margins()))
        response = self._call(self._vehicle.EvaluateTrajectories, request, deadline)
        return costs_of(response, len(message.steps), shape, steps)

    def plan_speed(self, path: Path, options: SpeedOptions, vehicle: str = "", *, draws: int = 0,
                   deadline: Optional[float] = None) -> ServedPlan:
        """Safe speeds and a speed plan along a path of 2 to 10,000 points; the bits of SpeedPlanner.plan.

        draws: also the share of so many coherent draws of the ground on which the plan holds.
        """
        message, shape = messages.path_message(path)
        request = make(
            vehicle_service_pb2.PlanSpeedRequest, vehicle=vehicle, path=message,
            speed_limit_m_per_s=options.speed_limit, worse_by_sd=options.worse_by_sd,
            margins=messages.margins_message(options.margins), acceleration_m_per_s2=options.acceleration,
            braking_m_per_s2=options.braking, start_m_per_s=options.start, end_m_per_s=options.end, draws=draws)
        response = self._call(self._vehicle.PlanSpeed, request, deadline)
        plan = response.plan
        out = ServedPlan(messages.array_of(plan.speed_m_per_s, "speed", shape), not_held=response.not_held)
        messages.fill_named(plan, shape, ("acceleration", "safe", "shortfall", "holds"), (), out, {"holds": np.bool_})
        for name in ("safe_binding", "binding"):
            numbers = [messages.binding_of(number) for number in getattr(plan, name)]
            setattr(out, name, messages.array_of(numbers, name, shape, np.uint8))
        if draws:
            out.hold_probability = response.hold_probability
            out.point_hold_probability = messages.array_of(response.point_hold_probability, "point_hold_probability",
                                                           shape)
        return out

    def grades(self, vehicle: str = "", *, speed: float = 0.0, soils: Iterable[str] = (),
               worse_by_sd: Optional[float] = None, margins: Optional[Margins] = None,
               deadline: Optional[float] = None) -> list[ServedGrades]:
        """The grades that are driven straight at `speed` [m/s] (0: the limit of creeping), by soil; the bits of
        SpeedPlanner.grades.

        soils: by name; none: all of the vehicle. worse_by_sd: ground that must be stood, by default 1.645.
        """
        request = make(vehicle_service_pb2.GradesRequest, vehicle=vehicle, speed_m_per_s=speed, soils=list(soils),
                       worse_by_sd=worse_by_sd, margins=messages.margins_message(margins or Margins()))
        return [ServedGrades(g.soil, g.any, g.down_rad, g.up_rad, messages.binding_of(g.binding_down),
                             messages.binding_of(g.binding_up))
                for g in self._call(self._vehicle.Grades, request, deadline).grades]

    def constants(self, speeds: Iterable[float], radii: Iterable[float], vehicle: str = "", *,
                  deadline: Optional[float] = None) -> list[ServedConstants]:
        """What skid-steering controllers ask for, by soil, speed [m/s] and radius of path [m], all above 0 and at most
        1,000 in all; the bits of Vehicle.constants."""
        request = make(vehicle_service_pb2.ConstantsRequest, vehicle=vehicle, speeds_m_per_s=list(speeds),
                       radii_m=list(radii))
        return [ServedConstants(**{name: getattr(c, field) for name, field in messages.wire_names(c).items()})
                for c in self._call(self._vehicle.Constants, request, deadline).constants]

    def vehicles(self, *, deadline: Optional[float] = None) -> list[vehicle_service_pb2.VehicleInfo]:
        """The vehicles by name. deadline: of each page."""
        return self._all_pages(self._vehicle.ListVehicles, vehicle_service_pb2.ListVehiclesRequest(), "vehicles",
                               deadline)

    def vehicle(self, vehicle: str = "", *, deadline: Optional[float] = None) -> vehicle_pb2.Vehicle:
        """One vehicle, with its wheels and the names of its soils."""
        request = make(vehicle_service_pb2.GetVehicleRequest, vehicle=vehicle)
        return self._call(self._vehicle.GetVehicle, request, deadline).vehicle

    def build_info(self, *, deadline: Optional[float] = None) -> operator_service_pb2.GetBuildInfoResponse:
        """What program runs there, in which version."""
        return self._call(self._operator.GetBuildInfo, operator_service_pb2.GetBuildInfoRequest(), deadline)
