"""NumPy arrays to the messages of the services, and back. Numbers keep their bits."""

import re
import reprlib
from collections.abc import Iterable
from typing import Any

import numpy as np

from . import arrays, names
from ._core import OUTPUT_ARRAYS, AccuracyRequest, Error, Margins
from .v1alpha1 import state_pb2, vehicle_pb2

# What ends a field's name on the wire: its unit.
_UNIT = re.compile(r"_(?:n_m|n|m_per_s2|m_per_s|rad_per_s2|rad_per_s|rad|per_m|w|m|s|j)$")

#: What servers answer: of one soil that is known, so that there is no sd_soil.
ANSWERED = tuple(f"{o}.{a}" for o in names.OUTPUTS for a in OUTPUT_ARRAYS if a != "sd_soil") + ("slip", "attack_angle")
#: Arrays that a server leaves out where they are unknown for all states; of wheels off the ground they are 0.
_MAY_LACK = ("measured_low", "measured_high")


def wire_names(message: Any) -> dict[str, str]:
    """Names without units, as in grouser.arrays, to those of the fields of a message."""
    return {_UNIT.sub("", f.name): f.name for f in message.DESCRIPTOR.fields}


def make(kind: Any, /, **fields: Any) -> Any:
    """A message of these fields. Raises Error, with the field's name, for a value that it cannot hold."""
    try:
        return kind(**fields)
    except (ValueError, OverflowError):  # protobuf's text does not say which it is
        for name, value in fields.items():
            try:
                kind(**{name: value})
            except (ValueError, OverflowError) as error:
                raise Error(f"{name}: {reprlib.repr(value)}: {error}") from None
        raise


def extend(field: Any, name: str, value: Any, shape: tuple[int, ...]) -> None:
    """Adds the entries of an array, which has to be of this shape, to a repeated field."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise Error(f"{name}: dtype {array.dtype}, expected real numbers")
    if array.shape != shape:
        raise Error(f"{name}: shape {array.shape}, expected {shape}")
    try:
        field.extend(array.ravel().tolist())
    except (TypeError, ValueError) as error:  # a draw of 0.5, a soil of -1
        raise Error(f"{name}: {error}") from None


def array_of(values: Any, name: str, shape: tuple[int, ...], dtype: Any = np.float64) -> Any:
    """A new array of a repeated field's entries. Raises Error for another number of them."""
    array = np.array(values[:], dtype)
    if array.size != np.prod(shape, dtype=int):
        raise Error(f"{name}: the server answered {array.size} entries, expected {shape}")
    return array.reshape(shape)


def wheel_states(states: arrays.States) -> tuple[Any, tuple[int, ...]]:
    """As a message, and their shape."""
    shape = np.shape(states.load)
    message = state_pb2.WheelStates()
    for name in ("v_x", "v_y", "rim_speed"):
        extend(getattr(message.velocity, f"{name}_m_per_s"), name, getattr(states, name), shape)
    extend(message.load_n, "load", states.load, shape)
    return message, shape


def accuracy_message(asked: AccuracyRequest) -> Any:
    """As a message."""
    message = state_pb2.AccuracyRequest(share_of_load=asked.share_of_load, budget_us=asked.budget_us)
    fields = wire_names(message)
    for output, largest in asked.tolerance.items():
        setattr(message, fields[output], largest)
    message.interval_target = state_pb2.IntervalTarget.Value(f"INTERVAL_TARGET_{asked.target.upper()}")
    return message


def fields_of(wanted: Iterable[str]) -> list[str]:
    """EvaluateWheelsRequest.fields for these of ANSWERED."""
    named = ["slip" if name == "attack_angle" else name for name in wanted]
    return list(dict.fromkeys(named)) or ["slip"]  # none would be all


def fill_answers(responses: Any, wanted: Iterable[str], shape: tuple[int, ...], out: arrays.Answers) -> None:
    """WheelResponses into new arrays of `out`, whose flags are there."""
    off_ground = (out.flags & names.Flag.AIRBORNE) != 0
    for name in wanted:
        output, _, part = name.rpartition(".")
        values = getattr(getattr(responses, output), part) if output else \
            getattr(responses.slip, wire_names(responses.slip)[part])
        unknown = part in _MAY_LACK and len(values) == 0
        array = np.where(off_ground, 0, np.nan) if unknown else array_of(values, name, shape)
        setattr(getattr(out, output) if output else out, part, array)


def motions_message(motions: arrays.Motions) -> tuple[Any, tuple[int, ...]]:
    """As a message, and their shape."""
    message = vehicle_pb2.Motions()
    if motions.rim_speed is None:
        if motions.v_x is None or motions.steering is not None:
            raise Error("motions: expected v_x (and yaw_rate), or rim_speed (and steering)")
        shape = np.shape(motions.v_x)
        given: Any = {"v_x": message.twist, "yaw_rate": message.twist}
    else:
        if motions.v_x is not None or motions.yaw_rate is not None:
            raise Error("motions: rim_speed with v_x or yaw_rate, expected one of both ways")
        shape = np.shape(motions.rim_speed)[:-1]
        extend(message.controls.rim_speed_m_per_s, "rim_speed", motions.rim_speed, np.shape(motions.rim_speed))
        given = {"steering": message.controls}
    given |= dict.fromkeys(("acceleration", "yaw_acceleration", "grade", "bank", "worse_by_sd", "draw"), message)
    for name, owner in given.items():
        value = getattr(motions, name)
        if value is not None:
            extend(getattr(owner, wire_names(owner)[name]), name, value, shape)
    if motions.soil is not None:
        by_wheel = np.ndim(motions.soil) == len(shape) + 1
        extend(message.soil, "soil", motions.soil, shape + np.shape(motions.soil)[-1:] if by_wheel else shape)
    return message, shape


def path_message(path: arrays.Path) -> tuple[Any, tuple[int, ...]]:
    """As a message, and its shape."""
    message, shape = vehicle_pb2.Path(), np.shape(path.s)
    if len(shape) != 1:
        raise Error(f"s: shape {shape}, expected (n,)")
    fields = wire_names(message)
    for name in ("s", "curvature", "grade", "bank", "soil"):
        value = getattr(path, name)
        if value is not None:
            extend(getattr(message, fields[name]), name, value, shape)
    return message, shape


def margins_message(margins: Margins) -> Any:
    """As a message."""
    return vehicle_pb2.Margins(tip=margins.tip, torque=margins.torque, sinkage=margins.sinkage,
                               untrained=not margins.trained_only)


def fill_named(message: Any, shape: tuple[int, ...], known: Iterable[str], longer: Iterable[str], out: Any,
               dtypes: Any = None) -> None:
    """Fields of a message into new arrays of `out` under their names without units; those named in `longer` have one
    dimension more, whose size the answer says."""
    fields, n = wire_names(message), int(np.prod(shape, dtype=int))
    for name in known:
        values = getattr(message, fields[name])
        whole = (*shape, len(values) // max(n, 1)) if name in longer else shape
        setattr(out, name, array_of(values, name, whole, (dtypes or {}).get(name, np.float64)))


#: SpeedBinding of the wire to Binding.
BINDINGS = {number: names.Binding[name.removeprefix("SPEED_BINDING_")]
            for name, number in vehicle_pb2.SpeedBinding.items() if number != 0}


def binding_of(number: int) -> names.Binding:
    """What a newer server may know and this client does not counts as INPUT."""
    return BINDINGS.get(number, names.Binding.INPUT)
