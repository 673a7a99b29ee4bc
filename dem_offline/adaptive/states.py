"""States for new runs: where a model is least sure, apart from each other and from the runs that it has."""

import math

OUTPUTS = ("f_x", "f_y", "torque", "sinkage")
APART = 0.15  # of the ranges: nearer than this a state is worth less, in proportion
SAME = 0.01   # the same: nearer than this it has run


def scales(load, radius):
    """{output: what its error is measured against}: load, load times radius, radius."""
    return {"f_x": load, "f_y": load, "torque": load * radius, "sinkage": radius}


def unsure(answer, radius):
    """Largest sd of the fit of one answer (`grouser-fit eval --json`) over its scale; a new bed's own scatter is not
    in it, since runs do not lessen that. nan: no answer there."""
    of = scales(answer["load_n"], radius)
    values = [float(answer["outputs"][name]["sd_fit"]) / of[name] for name in OUTPUTS]
    return math.nan if any(math.isnan(one) for one in values) else max(values)


class Ranges:
    """Lowest and highest of slip [-], attack angle [deg] and load [N]."""

    def __init__(self, slip, angle, load):
        self.all = (slip, angle, load)

    def unit(self, state):
        return [(value - low) / (high - low) if high > low else 0.0
                for value, (low, high) in zip(state, self.all)]

    def distance(self, one, other):
        return math.dist(self.unit(one), self.unit(other))


def choose(candidates, there, ranges, count):
    """The next states. candidates: [(state, how unsure)]; there: states that have run. Greedy: the largest of
    unsure * min(1, distance to the nearest that runs / APART), one after the other; none within SAME of one."""
    chosen, rest = [], [one for one in candidates if not math.isnan(one[1])]

    def worth(one):
        nearest = min((ranges.distance(one[0], other) for other in [*there, *chosen]), default=math.inf)
        return one[1] * min(1.0, nearest / APART) if nearest > SAME else 0.0
    while rest and len(chosen) < count:
        best = max(rest, key=worth)
        if worth(best) <= 0:
            break
        rest.remove(best)
        chosen.append(best[0])
    return chosen


def quantile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, math.ceil(share * len(ordered)) - 1)]
