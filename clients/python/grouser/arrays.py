"""What is asked and what is answered: named NumPy arrays, which the library reads and writes in place.

Every array is C-contiguous, aligned and of the dtype that stands at its name; None is not asked, or
not answered, and costs nothing. The constructors take arrays as they are; `of` broadcasts numbers
and arrays to one shape, which copies where it has to. Names and units are those of the C++ headers.
"""

import dataclasses
import difflib
import fnmatch
import functools
import math
from collections.abc import Iterable, Iterator
from typing import Any, Optional, TypeVar, Union

import numpy as np
import numpy.typing as npt

from ._core import Error
from .names import OUTPUTS

Floats = npt.NDArray[np.float64]
Bits = npt.NDArray[np.uint32]
Indices = npt.NDArray[np.uint8]
Numbers = Union[npt.ArrayLike, float]
Shape = Union[int, tuple[int, ...]]
Fields = Union[None, str, Iterable[str]]
T = TypeVar("T")


def _numbers(name: str, value: Any, dtype: Any) -> npt.NDArray[Any]:
    """An array of numbers that `dtype` can hold, where there may be others yet."""
    array = np.asarray(value)
    if np.issubdtype(dtype, np.floating):
        if array.dtype.kind not in "fiu":
            raise Error(f"{name}: dtype {array.dtype}, expected real numbers")
        return array
    least, most = np.iinfo(dtype).min, np.iinfo(dtype).max
    if array.dtype.kind not in "iu" or (array.size and not least <= array.min() <= array.max() <= most):
        raise Error(f"{name}: expected whole numbers from {least} to {most}")
    return array


def _broadcast(given: dict[str, Any], dtypes: dict[str, Any]) -> dict[str, npt.NDArray[Any]]:
    """All that is not None, in one shape and contiguous."""
    arrays = {name: _numbers(name, value, dtypes.get(name, np.float64))
              for name, value in given.items() if value is not None}
    try:
        shape = np.broadcast_shapes(*(a.shape for a in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in arrays.items())
        raise Error(f"shapes that do not go together: {shapes}") from None
    result = {}
    for name, a in arrays.items():
        whole = a if a.shape == shape else np.broadcast_to(a, shape).copy()
        result[name] = np.ascontiguousarray(whole, dtypes.get(name, np.float64))
    return result


@functools.lru_cache(maxsize=64)
def _chosen(known: tuple[str, ...], wanted: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the known names that are wanted: by name, by a name's first part, by a pattern."""
    names: set[str] = set()
    for want in wanted:
        found = [k for k in known if k.split(".")[0] == want or fnmatch.fnmatchcase(k, want)]
        if not found:
            near = difflib.get_close_matches(want, known + tuple(k.split(".")[0] for k in known), 1)
            raise Error(f"fields: '{want}'" + (f", did you mean '{near[0]}'?" if near else f", expected of {known}"))
        names.update(found)
    return tuple(k for k in known if k in names)


def _wanted(fields: Fields, default: tuple[str, ...]) -> tuple[str, ...]:
    if fields is None:
        return default
    return (fields,) if isinstance(fields, str) else tuple(fields)


def chosen(known: tuple[str, ...], fields: Fields, default: tuple[str, ...] = ("*",)) -> tuple[str, ...]:
    """Those of the known names that `fields` asks for, in their order. Raises Error for one that is not there."""
    return _chosen(known, _wanted(fields, default))


def _shape(shape: Shape) -> tuple[int, ...]:
    return (shape,) if isinstance(shape, int) else tuple(shape)


def _rows(count: int, shape: tuple[int, ...]) -> Iterator[Floats]:
    """New float64 arrays out of one piece of memory, which the system gives and takes faster than many. A cache line
    lies between them: rows of a power of two would push each other out of the cache."""
    size = math.prod(shape)
    rows = np.empty((count, size + 8))[:, :size]
    return iter(rows) if len(shape) == 1 else (row.reshape(shape) for row in rows)


def _names(cls: Any, *left_out: str) -> tuple[str, ...]:
    return tuple(f.name for f in dataclasses.fields(cls) if f.name not in left_out)


@dataclasses.dataclass(eq=False)
class States:
    """n wheel states on flat virgin ground: four float64 arrays of one shape.

    With V = hypot(v_x, v_y):

        slip = (rim_speed - v_x) / max(|rim_speed|, V),  attack angle = atan2(v_y, v_x)
    """

    v_x: Floats  #: hub velocity, forward [m/s]
    v_y: Floats  #: the same, to the left [m/s]
    rim_speed: Floats  #: radius times spin, r w [m/s]
    load: Floats  #: vertical load [N], >= 0; 0: AIRBORNE

    @classmethod
    def of(cls, v_x: Numbers, v_y: Numbers, rim_speed: Numbers, load: Numbers) -> "States":
        """Numbers and arrays, broadcast to one shape. Raises Error for shapes that do not go together."""
        return cls(**_broadcast({"v_x": v_x, "v_y": v_y, "rim_speed": rim_speed, "load": load}, {}))

    @classmethod
    def from_slip(cls, slip: Numbers, attack_angle: Numbers, speed: Numbers, load: Numbers) -> "States":
        """The inverse of the equations above at speed = max(|rim_speed|, V) > 0 [m/s], broadcast.

        Where |slip + cos(attack_angle)| <= 1 the hub is the faster: (v_x, v_y) = speed (cos, sin),
        rim_speed = speed (slip + cos); else the rim: rim_speed = +-speed, v_x = rim_speed - slip speed,
        v_y = v_x tan(attack_angle). Raises Error for a slip that no motion of that angle has.
        """
        b = _broadcast({"slip": slip, "attack_angle": attack_angle, "speed": speed, "load": load}, {})
        slips, angle, v = b["slip"], b["attack_angle"], b["speed"]
        c = np.where(np.abs(np.cos(angle)) < 1e-15, 0.0, np.cos(angle))  # pi/2 has no exact double
        least, most = -1 - np.maximum(c, 0), 1 + np.maximum(-c, 0)
        slack = 1e-9
        good = (slips >= least - slack) & (slips <= most + slack) & (v > 0) & np.isfinite(v)
        good &= np.abs(angle) <= math.pi + slack
        if not good.all():
            i = int(np.argmin(good))
            of = [float(a.flat[i]) for a in (slips, angle, v, least, most)]
            raise Error("state {}: slip {:g} at attack angle {:g} rad and speed {:g} m/s, expected {:.3g} to {:.3g}, "
                        "-pi to pi, and above 0".format(i, *of))
        rim = slips + c
        hub_faster = np.abs(rim) <= 1 + slack
        sense = np.where(rim > 0, 1.0, -1.0)
        forward = np.where(hub_faster, c, sense * np.maximum(sense * (sense - slips), 0))
        with np.errstate(divide="ignore", invalid="ignore"):
            lateral = np.where(hub_faster, np.sin(angle), forward * np.sin(angle) / c)
        return cls(forward * v, lateral * v, np.where(hub_faster, np.clip(rim, -1, 1), sense) * v, b["load"])


@dataclasses.dataclass(eq=False)
class OutputArrays:
    """One output of n states: float64 arrays of the states' shape. Units: those of the output.

    The interval [low, high] covers the mean of a fresh DEM run at the model's interval_level.
    """

    value: Optional[Floats] = None
    sd_fit: Optional[Floats] = None  #: standard deviation, surrogate against DEM
    sd_patch: Optional[Floats] = None  #: of one random placement of the bed
    low: Optional[Floats] = None
    high: Optional[Floats] = None
    d_v_x: Optional[Floats] = None  #: derivative of the value by v_x [unit s/m]; NaN without gradients
    d_v_y: Optional[Floats] = None
    d_rim_speed: Optional[Floats] = None
    d_load: Optional[Floats] = None  #: [unit/N]
    sd_form: Optional[Floats] = None  #: DEM minus measurement in the state's region; NaN: unknown
    measured_low: Optional[Floats] = None  #: covers a measurement; NaN: unknown
    measured_high: Optional[Floats] = None
    sd_soil: Optional[Floats] = None  #: which soil it is (Model.mixture); else 0


#: What Answers.empty makes where nothing else is asked.
DEFAULT_ANSWERS = ("*.value", "*.low", "*.high", "slip", "attack_angle")
_ANSWER_NAMES = tuple(f"{o}.{f}" for o in OUTPUTS for f in _names(OutputArrays)) + ("slip", "attack_angle")


@functools.lru_cache(maxsize=64)
def _answer_parts(wanted: tuple[str, ...]) -> tuple[dict[str, list[str]], list[str]]:
    """What is wanted of each output, and of the echoes."""
    parts: dict[str, list[str]] = {}
    for name in _chosen(_ANSWER_NAMES, wanted):
        output, _, part = name.rpartition(".")
        parts.setdefault(output, []).append(part)
    return parts, parts.pop("", [])


@dataclasses.dataclass(eq=False)
class Answers:
    """The answers to n states: arrays of the states' shape. None may overlap another, or the states."""

    flags: Bits  #: uint32, required; bits of Flag
    f_x: OutputArrays = dataclasses.field(default_factory=OutputArrays)  #: drawbar pull [N]
    f_y: OutputArrays = dataclasses.field(default_factory=OutputArrays)  #: lateral force [N]
    f_z: OutputArrays = dataclasses.field(default_factory=OutputArrays)  #: vertical force [N]
    torque: OutputArrays = dataclasses.field(default_factory=OutputArrays)  #: drive torque [N m]
    m_z: OutputArrays = dataclasses.field(default_factory=OutputArrays)  #: about the vertical [N m]
    sinkage: OutputArrays = dataclasses.field(default_factory=OutputArrays)  #: to the lowest rim point [m]
    slip: Optional[Floats] = None  #: echo [-]
    attack_angle: Optional[Floats] = None  #: echo [rad]

    @classmethod
    def empty(cls, shape: Shape, fields: Fields = None) -> "Answers":
        """New arrays, not yet written. fields: 'f_x' (all of it), 'sinkage.high', '*.value' (of all
        outputs), 'slip', 'attack_angle'; by default '*.value', '*.low', '*.high', 'slip' and
        'attack_angle'. They share one piece of memory: copy what is kept for long. Raises Error for a
        name that there is none of."""
        wanted = _wanted(fields, DEFAULT_ANSWERS)
        parts, echoes = _answer_parts(wanted)
        rows = _rows(sum(map(len, parts.values())) + len(echoes), _shape(shape))
        made: dict[str, Any] = {output: OutputArrays(**dict(zip(names, rows))) for output, names in parts.items()}
        made.update(zip(echoes, rows))
        return cls(np.empty(shape, np.uint32), **made)


@dataclasses.dataclass(eq=False)
class Motions:
    """n steady motions of a vehicle: arrays of one shape S; float64 but for draw and soil.

    Given the twist of the origin (v_x and yaw_rate; its path has the curvature yaw_rate/v_x), rim
    speeds and steering are found; or given rim_speed (and steering), the twist is.
    """

    v_x: Optional[Floats] = None  #: [m/s]
    yaw_rate: Optional[Floats] = None  #: to the left [rad/s]
    rim_speed: Optional[Floats] = None  #: r w, shape S + (drives,) [m/s]
    steering: Optional[Floats] = None  #: of the vehicle file; with rim_speed alone [rad]
    acceleration: Optional[Floats] = None  #: rate of v_x [m/s^2]
    yaw_acceleration: Optional[Floats] = None  #: [rad/s^2]
    grade: Optional[Floats] = None  #: the ground rises ahead [rad]
    bank: Optional[Floats] = None  #: the ground rises to the left [rad]
    worse_by_sd: Optional[Floats] = None  #: ground worse than the mean by so many standard deviations
    draw: Optional[npt.NDArray[np.int32]] = None  #: int32, of the ground (use_draws); -1: the mean
    soil: Optional[Indices] = None  #: uint8, index into Vehicle.soils: S, or S + (wheels,); None: the first

    @classmethod
    def of(cls, *, rim_speed: Optional[Numbers] = None, soil: Optional[Numbers] = None,
           **others: Optional[Numbers]) -> "Motions":
        """Numbers and arrays by name, broadcast to one shape; rim_speed and a soil by wheel have one
        dimension more and are not. Raises Error for shapes that do not go together."""
        dtypes = {"draw": np.int32, "soil": np.uint8}
        if unknown := set(others) - set(_names(cls)):
            raise Error(f"Motions: '{min(unknown)}', expected {', '.join(_names(cls))}")
        known = {name: np.asarray(value) for name, value in others.items() if value is not None}
        if rim_speed is not None:
            controls = np.ascontiguousarray(_numbers("rim_speed", rim_speed, np.float64), np.float64)
            known[""] = np.zeros(controls.shape[:-1])
        most = max([0] + [a.ndim for a in known.values()])
        by_wheel = soil is not None and np.ndim(soil) > most
        if soil is not None and not by_wheel:
            known["soil"] = np.asarray(soil)
        motions = cls(**{name: a for name, a in _broadcast(known, dtypes).items() if name})
        if rim_speed is not None:
            motions.rim_speed = controls
        if by_wheel:
            motions.soil = np.ascontiguousarray(_numbers("soil", soil, np.uint8), np.uint8)
        return motions


@dataclasses.dataclass(eq=False)
class WheelArrays:
    """Answers by wheel: shape S + (wheels,). Forces of the ground on the wheel, in its own axes."""

    load: Optional[Floats] = None  #: [N]
    rim_speed: Optional[Floats] = None  #: r w [m/s]
    v_x: Optional[Floats] = None  #: of the hub [m/s]
    v_y: Optional[Floats] = None
    slip: Optional[Floats] = None  #: as of States [-]
    slip_angle: Optional[Floats] = None  #: [rad]
    steer: Optional[Floats] = None  #: from the vehicle's x [rad]
    f_x: Optional[Floats] = None  #: [N]
    f_y: Optional[Floats] = None
    torque: Optional[Floats] = None  #: [N m]
    m_z: Optional[Floats] = None
    sinkage: Optional[Floats] = None  #: [m]
    shaft_power: Optional[Floats] = None  #: torque times spin [W]
    flags: Optional[Bits] = None  #: uint32, bits of Flag


def _filled(answers: T, known: tuple[str, ...], fields: Fields, shape_of: Any, dtypes: dict[str, Any]) -> T:
    """`answers` with an array for every name that is wanted."""
    for name in _chosen(known, _wanted(fields, known)):
        part, _, attribute = name.rpartition(".")
        array = np.empty(shape_of(name), dtypes.get(attribute, np.float64))
        setattr(getattr(answers, part) if part else answers, attribute, array)
    return answers


@dataclasses.dataclass(eq=False)
class Solutions:
    """The answers to n motions: arrays of the motions' shape S, float64 but for reasons and flags."""

    reasons: Bits  #: uint32, required; bits of Reason
    residual: Optional[Floats] = None  #: largest imbalance over weight; balanced: <= BALANCED_RESIDUAL
    v_x: Optional[Floats] = None  #: of the origin [m/s]
    v_y: Optional[Floats] = None
    yaw_rate: Optional[Floats] = None  #: [rad/s]
    side_slip: Optional[Floats] = None  #: of the centre of gravity [rad]
    steering: Optional[Floats] = None  #: [rad]
    pitching_moment: Optional[Floats] = None  #: sum of (r - sinkage) f_x - torque [N m]
    f_x: Optional[Floats] = None  #: ground on vehicle, at the origin [N]
    f_y: Optional[Floats] = None
    m_z: Optional[Floats] = None  #: [N m]
    shaft_power: Optional[Floats] = None  #: [W]
    electric_power: Optional[Floats] = None  #: [W]
    tip_margin: Optional[Floats] = None  #: 0: about to tip, 1: at the centre [-]
    torque_margin: Optional[Floats] = None  #: 1 - largest use of a motor or steering limit
    sinkage_margin: Optional[Floats] = None  #: 1 - largest sinkage over its limit
    rim_speed: Optional[Floats] = None  #: r w by drive: shape S + (drives,) [m/s]
    wheel: WheelArrays = dataclasses.field(default_factory=WheelArrays)

    @classmethod
    def empty(cls, shape: Shape, wheels: int, drives: int, fields: Fields = None) -> "Solutions":
        """New arrays, not yet written. fields: 'v_x', 'wheel.load', 'wheel' (all of it); by default
        all. Raises Error for a name that there is none of."""
        s = _shape(shape)

        def shape_of(name: str) -> tuple[int, ...]:
            return s + (wheels,) if name.startswith("wheel.") else s + (drives,) if name == "rim_speed" else s

        return _filled(cls(np.empty(s, np.uint32)), SOLUTION_NAMES, fields, shape_of, {"flags": np.uint32})


#: What Solutions.empty knows.
SOLUTION_NAMES = _names(Solutions, "reasons", "wheel") + tuple(f"wheel.{f}" for f in _names(WheelArrays))


@dataclasses.dataclass(eq=False)
class Powers:
    """Where the power of n motions goes [W]: arrays of the motions' shape S, float64 but for reasons.

    With T w shaft power, F and M_z in a wheel's axes:

        rolling = sum (T - r F_x) w,  slip = sum F_x (r w - v_x),  scrub = -sum (F_y v_y + M_z yaw rate)
        electric = drive + rolling + slip + scrub + grade + acceleration + imbalance

    drive: losses of the motors, electric - shaft. imbalance: what the solve left over.
    """

    reasons: Bits  #: uint32, required; bits of Reason
    residual: Optional[Floats] = None  #: as of Solutions [-]
    electric: Optional[Floats] = None
    shaft: Optional[Floats] = None
    drive: Optional[Floats] = None
    rolling: Optional[Floats] = None
    slip: Optional[Floats] = None
    scrub: Optional[Floats] = None
    grade: Optional[Floats] = None
    acceleration: Optional[Floats] = None
    imbalance: Optional[Floats] = None
    electric_low: Optional[Floats] = None  #: on ground better by `sds`; both ends NaN: no balance at one
    electric_high: Optional[Floats] = None  #: on ground worse by `sds`
    joules_per_metre: Optional[Floats] = None  #: electric, by way of the centre [J/m]; NaN at rest
    joules_per_metre_low: Optional[Floats] = None
    joules_per_metre_high: Optional[Floats] = None
    wheel_shaft: Optional[Floats] = None  #: shape S + (wheels,)

    @classmethod
    def empty(cls, shape: Shape, wheels: int, fields: Fields = None) -> "Powers":
        """New arrays, not yet written. fields: names as above; by default all. Raises Error."""
        s = _shape(shape)

        def shape_of(name: str) -> tuple[int, ...]:
            return s + (wheels,) if name == "wheel_shaft" else s

        return _filled(cls(np.empty(s, np.uint32)), POWER_NAMES, fields, shape_of, {})


#: What Powers.empty knows.
POWER_NAMES = _names(Powers, "reasons")


@dataclasses.dataclass(eq=False)
class Path:
    """n points of a path, 2 or more: arrays of shape (n,), float64 but for soil."""

    s: Floats  #: way along the path; ascends [m]
    curvature: Optional[Floats] = None  #: to the left [1/m]
    grade: Optional[Floats] = None  #: the ground rises ahead [rad]
    bank: Optional[Floats] = None  #: the ground rises to the left [rad]
    soil: Optional[Indices] = None  #: uint8, of all wheels, index into Vehicle.soils; None: the first

    @classmethod
    def of(cls, s: Numbers, curvature: Optional[Numbers] = None, grade: Optional[Numbers] = None,
           bank: Optional[Numbers] = None, soil: Optional[Numbers] = None) -> "Path":
        """Numbers and arrays, broadcast to one shape. Raises Error for shapes that do not go together."""
        given = {"s": s, "curvature": curvature, "grade": grade, "bank": bank, "soil": soil}
        return cls(**_broadcast(given, {"soil": np.uint8}))


@dataclasses.dataclass(eq=False)
class SpeedPlan:
    """A plan of n points: arrays of shape (n,), float64 but for the last three."""

    speed: Floats  #: of the plan; required [m/s]
    acceleration: Optional[Floats] = None  #: [m/s^2]
    safe: Optional[Floats] = None  #: highest at constant speed; 0: cannot be driven [m/s]
    #: By how much the binding limit is exceeded one level of the search (1/256 of the speed limit)
    #: above the safe speed: residual over weight, or the margin that is missing.
    shortfall: Optional[Floats] = None
    safe_binding: Optional[Indices] = None  #: uint8, a Binding: of the safe speed
    binding: Optional[Indices] = None  #: uint8, a Binding: of the plan
    holds: Optional[npt.NDArray[np.bool_]] = None  #: bool: can be driven here with every margin left
    not_held: int = 0  #: at how many points the plan does not hold

    @classmethod
    def empty(cls, shape: Shape, fields: Fields = None) -> "SpeedPlan":
        """New arrays, not yet written. fields: names as above; by default all. Raises Error."""
        s = _shape(shape)
        dtypes = {"safe_binding": np.uint8, "binding": np.uint8, "holds": np.bool_}
        return _filled(cls(np.empty(s)), _names(cls, "speed", "not_held"), fields, lambda _: s, dtypes)
