"""Measured wheel tests: a CSV with named columns, their units, and the regions of its rows."""

import csv
import math

OUTPUTS = ("f_x", "f_y", "torque", "sinkage")
STATES = ("slip", "attack_angle", "load", "rim_speed", "carriage_speed")
DIMENSION = {"slip": "", "attack_angle": "angle", "load": "force", "rim_speed": "speed", "carriage_speed": "speed",
             "f_x": "force", "f_y": "force", "torque": "moment", "sinkage": "length", "repeats": ""}
UNITS = {"": {"": 1.0, "%": 0.01}, "angle": {"rad": 1.0, "deg": math.pi / 180}, "force": {"n": 1.0, "kn": 1e3},
         "speed": {"m_per_s": 1.0, "mm_per_s": 1e-3, "cm_per_s": 1e-2}, "moment": {"n_m": 1.0},
         "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2}}
LOCKED_RIM = 1e-3  # of the hub's speed
LEAST_REPEATS = 2  # of a standard deviation


class TableError(Exception):
    """What, where, expected."""


class Row:
    """One state with what was measured there: SI, radians. Missing values are not in `value`."""

    def __init__(self, line, value, sd, repeats):
        self.line, self.value, self.sd, self.repeats = line, value, sd, repeats
        self.slip, self.angle, self.load = value["slip"], value["attack_angle"], value["load"]

    @property
    def rim_over_hub(self):
        """Rim speed over the hub's speed V; inf where the hub stands. Of a rim that turns backwards, whose
        slip fits two speeds, the one up to V."""
        with_v = self.slip + math.cos(self.angle)  # V >= |r w|: slip = (r w - V cos b)/V
        if abs(with_v) <= 1:
            return with_v
        sign = math.copysign(1.0, with_v)  # |r w| > V: slip = (r w - V cos b)/|r w|
        over = sign - self.slip
        return sign * abs(math.cos(self.angle) / over) if abs(over) > 1e-12 else math.inf

    @property
    def regions(self):
        """Names of the regions that the row is in. Braking is told by the rim against the hub's whole
        speed, so that it means the same at every slip angle."""
        locked = abs(self.rim_over_hub) < LOCKED_RIM
        gentle = self.rim_over_hub >= 0.8 - 1e-3
        names = []
        if gentle:
            names.append("braking <= 0.2, driving")
            if abs(self.angle) < math.radians(0.5):
                names.append("straight of these")
        names.append("locked" if locked else "not locked")
        return names

    def error(self, output):
        """Standard error of a measured mean; nan: unknown."""
        sd = self.sd.get(output, math.nan)
        return sd / math.sqrt(self.repeats) if self.repeats >= LEAST_REPEATS else math.nan


REGIONS = ("braking <= 0.2, driving", "straight of these", "not locked", "locked")


def unit_of(dimension, unit, what):
    units = UNITS[dimension]
    key = unit.lower().replace("/", "_per_").replace(" ", "_")
    if key not in units:
        known = ", ".join(one or "no unit" for one in units)
        raise TableError(f"{what}: unit '{unit}', expected one of {known}")
    return units[key]


def split_quantity(name):
    """('f_x', is it a standard deviation), or None."""
    sd = name.endswith("_sd")
    base = name[:-3] if sd else name
    return (base, sd) if base in DIMENSION and not (sd and base not in OUTPUTS + ("load",)) else None


def default_columns(header):
    """Columns that say what they are: f_x_n, sinkage_m, f_x_sd (in the unit of its mean)."""
    found = {}
    for column in header:
        direct = split_quantity(column)
        if direct and (direct[1] or DIMENSION[direct[0]] == ""):
            found[column] = (column, None)
            continue
        for base, dimension in DIMENSION.items():
            unit = column[len(base) + 1:]
            if dimension and column.startswith(base + "_") and unit in UNITS[dimension]:
                found[base] = (column, UNITS[dimension][unit])
    for quantity, (column, factor) in list(found.items()):
        if factor is None:
            mean = found.get(quantity[:-3]) if quantity.endswith("_sd") else (None, 1.0)
            found[quantity] = (column, mean[1] if mean else 1.0)
    return found


def mapped_columns(texts, header, path):
    """SOURCE=QUANTITY or SOURCE=QUANTITY:UNIT, as `./grouser calibrate` takes them."""
    found = {}
    for text in (part for one in texts for part in one.split(",")):
        source, equals, quantity = text.partition("=")
        if not equals:
            raise TableError(f"--columns {text}: expected SOURCE=QUANTITY or SOURCE=QUANTITY:UNIT")
        quantity, _, unit = quantity.partition(":")
        known = split_quantity(quantity)
        if known is None:
            raise TableError(f"--columns {text}: unknown quantity '{quantity}', expected one of "
                             + ", ".join(DIMENSION) + ", or _sd after one that is measured")
        if source not in header:
            raise TableError(f"{path}: no column '{source}', expected one of {', '.join(header)}")
        dimension = DIMENSION[known[0]]
        if dimension and not unit:
            raise TableError(f"--columns {text}: no unit, expected {quantity}:UNIT")
        found[quantity] = (source, unit_of(dimension, unit, f"--columns {text}"))
    return found


def number(text, place):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise TableError(f"{place}: '{text}', expected a finite number")
    return value


def slip_of(value):
    """(r w - v_x)/max(|r w|, V), where the two speeds are known: a table's own slip may be meant
    against the carriage's whole speed."""
    rim, hub = value["rim_speed"], value["carriage_speed"]
    return (rim - hub * math.cos(value["attack_angle"])) / max(abs(rim), hub)


def read(path, columns=()):
    """Rows of a CSV with '#' comments and a header line. Throws TableError."""
    try:
        with open(path, encoding="utf-8") as file:
            lines = [(n, line) for n, line in enumerate(file, 1) if line.strip() and not line.startswith("#")]
    except OSError as error:
        raise TableError(f"{path}: {error.strerror}, expected a CSV") from None
    if len(lines) < 2:
        raise TableError(f"{path}: {len(lines)} lines, expected a header and rows")
    header = next(csv.reader([lines[0][1].strip()]))
    twice = {one for one in header if header.count(one) > 1}
    if twice:
        raise TableError(f"{path}:{lines[0][0]}: column '{twice.pop()}' twice, expected it once")
    use = default_columns(header)
    use.update(mapped_columns(columns, header, path))
    speeds = "rim_speed" in use and "carriage_speed" in use
    for needed in ("attack_angle", "load") if speeds else ("slip", "attack_angle", "load"):
        if needed not in use:
            raise TableError(f"{path}: no column for {needed}, expected one named {needed}_UNIT, or --columns "
                             f"SOURCE={needed}:UNIT" + ("" if needed != "slip" else
                                                        "; or rim_speed and carriage_speed"))
    if not any(one in use for one in OUTPUTS):
        raise TableError(f"{path}: nothing measured, expected a column for one of {', '.join(OUTPUTS)}")
    rows = []
    for line, text in lines[1:]:
        fields = next(csv.reader([text.strip()]))
        if len(fields) != len(header):
            raise TableError(f"{path}:{line}: {len(fields)} fields, expected {len(header)}")
        cells = dict(zip(header, fields))
        value, sd, repeats = {}, {}, 1
        for quantity, (column, factor) in use.items():
            if cells[column].strip() == "":
                continue
            base, is_sd = split_quantity(quantity)
            got = number(cells[column], f"{path}:{line}: {column}") * factor
            if base == "repeats":
                repeats = got
            elif is_sd:
                sd[base] = got
            else:
                value[base] = got
        if speeds:
            value["slip"] = slip_of(value)
        missing = [one for one in ("slip", "attack_angle", "load") if one not in value]
        if missing:
            raise TableError(f"{path}:{line}: no {missing[0]}, expected a number")
        if not value["load"] > 0:
            raise TableError(f"{path}:{line}: load {value['load']:g} N, expected more than 0")
        if not -2 <= value["slip"] <= 2:
            raise TableError(f"{path}:{line}: slip {value['slip']:g}, expected -2 to 2")
        rows.append(Row(line, value, sd, repeats))
    return rows


def choose(rows, text):
    """Rows by number, from 1: '1,3-5'; empty: all."""
    if not text:
        return rows
    chosen = []
    for part in text.split(","):
        first, dash, last = part.partition("-")
        try:
            low, high = int(first), int(last if dash else first)
        except ValueError:
            raise TableError(f"--rows {text}: '{part}', expected numbers as 1,3-5") from None
        if not 1 <= low <= high <= len(rows):
            raise TableError(f"--rows {text}: '{part}', expected rows 1 to {len(rows)}")
        chosen += rows[low - 1:high]
    return chosen
