"""Names of outputs, and of the bits and numbers in answers; the numbers are the library's."""

import enum

from . import _core

#: What is answered, in this order everywhere: drawbar pull, lateral and vertical force [N], drive
#: torque, moment about the vertical [N m], sinkage [m].
OUTPUTS = _core.OUTPUTS


class Flag(enum.IntFlag):
    """Bits of a wheel state's flags. 0: nothing to say."""

    INVALID = _core.FLAGS["INVALID"]  #: non-finite input or load < 0; the outputs are NaN
    CLAMPED = _core.FLAGS["CLAMPED"]  #: something was clamped to the model's limits
    EXTRAPOLATED = _core.FLAGS["EXTRAPOLATED"]  #: outside what the training runs covered
    STATIC = _core.FLAGS["STATIC"]  #: hub and rim stand still
    NO_EQUILIBRIUM = _core.FLAGS["NO_EQUILIBRIUM"]  #: the soil does not carry the load
    RATE = _core.FLAGS["RATE"]  #: faster than the quasi-static range
    SLOPE = _core.FLAGS["SLOPE"]  #: of a vehicle's wheel on a slope, for which no model was run
    VIRGIN_ASSUMED = _core.FLAGS["VIRGIN_ASSUMED"]
    FORM_UNKNOWN = _core.FLAGS["FORM_UNKNOWN"]  #: some error against a measurement is unknown here
    TOLERANCE_UNMET = _core.FLAGS["TOLERANCE_UNMET"]
    AIRBORNE = _core.FLAGS["AIRBORNE"]  #: load 0: every output is exactly 0
    UNTUNED = _core.FLAGS["UNTUNED"]  #: the model was not fitted to this wheel on this soil


class Reason(enum.IntFlag):
    """Why a motion has no solution, or none to rely on. Bits; 0: solved, within every limit."""

    BALANCE = _core.REASONS["BALANCE"]  #: no rim speeds and steering balance forces and moments
    TORQUE = _core.REASONS["TORQUE"]  #: a motor's limit, or the steering's, is exceeded
    SINKAGE = _core.REASONS["SINKAGE"]  #: a wheel sinks deeper than the limit
    TIP = _core.REASONS["TIP"]  #: gravity and inertia meet the ground outside the wheels
    UNTRAINED_SPEED = _core.REASONS["UNTRAINED_SPEED"]  #: no limit of the ground
    MODEL_DOMAIN = _core.REASONS["MODEL_DOMAIN"]  #: outside the models' runs: no limit of the ground
    INPUT = _core.REASONS["INPUT"]  #: not finite, a wheel has no model of its soil, no such draw


class Binding(enum.IntEnum):
    """What keeps a point of a path from being driven faster."""

    SPEED_LIMIT = _core.BINDINGS["SPEED_LIMIT"]
    TRACTION = _core.BINDINGS["TRACTION"]
    LATERAL_GRIP = _core.BINDINGS["LATERAL_GRIP"]
    TORQUE = _core.BINDINGS["TORQUE"]
    ROLLOVER = _core.BINDINGS["ROLLOVER"]
    SINKAGE = _core.BINDINGS["SINKAGE"]
    UNTRAINED_SPEED = _core.BINDINGS["UNTRAINED_SPEED"]  #: of the models' runs, not of the ground
    MODEL_DOMAIN = _core.BINDINGS["MODEL_DOMAIN"]  #: the same
    ACCELERATION = _core.BINDINGS["ACCELERATION"]
    BRAKING = _core.BINDINGS["BRAKING"]
    INPUT = _core.BINDINGS["INPUT"]  #: a wheel has no model of the soil
