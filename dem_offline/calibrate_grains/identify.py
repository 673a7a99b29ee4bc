"""What the measured tests tell of the parameters, what they do not, and what would tell most."""

import math

import numpy
from evidence import Block, says_nothing
from vary import KNOWN, between, round_to

IDENTIFIED = 0.5     # of the range's uncertainty is left at most
PART = 0.35          # of a direction that names a parameter
MOST_ROWS = 6        # of a candidate test: neighbours on a curve are not independent
CANDIDATES, WEIGHED = 256, 200  # points looked at, samples that their gain is weighed over
# Which test tells a parameter best, by judgement.
TELLS = {"friction": "a shear ring or direct shear", "rolling_friction": "the angle of repose of a heap",
         "wheel_friction": "the wheel's torque, or its pull at slips above 0.5",
         "tool_friction": "the same plate with grains glued to it",
         "solid_fraction": "poured and tapped bulk density, or a cone",
         "top_layer_m": "a cone or a plate pushed deeper", "denser_below": "a cone or a plate pushed deeper",
         "surface_energy_j_per_m2": "a shear ring under little load",
         "youngs_modulus_pa": "one-dimensional compression", "grain_diameter_m": "a sieve"}
TOGETHER = {frozenset(("friction", "rolling_friction")): "a shear ring",
            frozenset(("friction", "solid_fraction")): "a shear ring, turned from its peak to its steady torque",
            frozenset(("rolling_friction", "solid_fraction")): "poured bulk density",
            frozenset(("friction", "wheel_friction")): "a shear ring, or the wheel's torque"}


def physical(vary, u):
    """(m, p) values of unit points."""
    return numpy.array([[between(KNOWN[name], *vary.ranges[name], float(x)) for name, x in zip(vary.names, one)]
                        for one in u])


def parameters_of(vary, posterior):
    values = physical(vary, posterior.u)
    before = 1 / math.sqrt(12)
    found = []
    for k, name in enumerate(vary.names):
        low, high = numpy.quantile(values[:, k], [0.05, 0.95])
        left = float(posterior.u[:, k].std() / before)
        found.append({"name": name, "unit": KNOWN[name].unit, "meaning": KNOWN[name].meaning,
                      "range": list(vary.ranges[name]), "mean": float(values[:, k].mean()),
                      "median": float(numpy.median(values[:, k])), "sd": float(values[:, k].std()), "low90": float(low),
                      "high90": float(high), "share_left": min(left, 1.0), "identified": left <= IDENTIFIED})
    return found


def correlation_of(posterior):
    return numpy.corrcoef(posterior.u.T).reshape(posterior.u.shape[1], -1).tolist()


def directions_of(vary, posterior):
    """Directions of the unit cube that stay uncertain, the worst first, in words."""
    scaled = (posterior.u - posterior.u.mean(axis=0)) * math.sqrt(12)
    values, vectors = numpy.linalg.eigh(numpy.cov(scaled.T).reshape(len(vary.names), -1))
    found = []
    for k in reversed(range(len(values))):
        left = math.sqrt(max(float(values[k]), 0.0))
        if left > IDENTIFIED:
            weights = {name: float(w) for name, w in zip(vary.names, vectors[:, k])}
            found.append({"share_left": min(left, 1.0), "weights": weights, "text": in_words(weights)})
    return found


def in_words(weights):
    largest = sorted(weights, key=lambda name: -abs(weights[name]))
    named = [name for name in largest if abs(weights[name]) > PART] or largest[:2]  # of many, each has a small part
    if len(named) == 1:
        return f"the tests do not tell {named[0]}; {TELLS[named[0]]} would"
    first = math.copysign(1, weights[named[0]])
    joint = TOGETHER.get(frozenset(named[:2])) if len(named) == 2 else None
    same = [name for name in named[1:] if weights[name] * first > 0]
    turned = [name for name in named[1:] if weights[name] * first < 0]
    how = " and ".join(([f"with more {', '.join(same)}"] if same else [])
                       + ([f"with less {', '.join(turned)}"] if turned else []))
    tests = joint or ", or ".join(dict.fromkeys(TELLS[name] for name in named[:2]))
    return (f"the tests cannot tell {named[0]} from {', '.join(named[1:])} (more {named[0]} {how} looks the same); "
            f"{tests} would")


def next_tests(targets, runs, evidence, posterior, radius, directions):
    """Tests of the file that are held out and were run: what each would leave of the most uncertain direction, were
    it fitted too (linear in the posterior's samples)."""
    if not directions:
        return []
    axis = numpy.array([directions[0]["weights"][name] for name in runs.vary.names])
    along = (posterior.u - posterior.u.mean(axis=0)) @ axis
    found = []
    for test in targets.tests:
        held = [row for row in targets.rows if row.test == test["name"] and row.held_out and not says_nothing(row)]
        if held and held[0].kind != "wheel":
            held = [held[k] for k in numpy.unique(numpy.linspace(0, len(held) - 1, MOST_ROWS).round().astype(int))]
        columns, noise = [], []
        for row in held:
            block = Block([row], radius)
            process = runs.process(block, needed=False)
            if process is None:
                continue
            mean, sd = process.at(posterior.u)
            group = evidence.groups.index(block.group) if block.group in evidence.groups else None
            share = block.typical if group is None else float(numpy.median(posterior.share[:, group]))
            columns.append(mean - mean.mean())
            noise.append(float(numpy.mean(sd**2)) + process.noise + block.sd**2 + (share * block.scale)**2)
        if columns:
            y = numpy.array(columns)
            both = y @ along / len(along)
            gain = both @ numpy.linalg.solve(y @ y.T / len(along) + numpy.diag(noise), both)
            left = max(0.0, 1 - gain / float(along.var()))
            found.append({"test": f"{test['name']} (held out)", "rows": len(columns),
                          "share_left": directions[0]["share_left"] * math.sqrt(left)})
    return sorted(found, key=lambda one: one["share_left"])


def runs_share(evidence, posterior):
    """Of all that the measured values are compared with: part of the variance that emulator and beds have."""
    _, sd = evidence.at(posterior.u)
    runs = (sd**2).mean(axis=0), evidence.noise
    form = numpy.median(posterior.share, axis=0)[evidence.group] * evidence.scale
    whole = runs[0] + runs[1] + form**2 + evidence.sd**2
    return {"emulator": float(numpy.mean(runs[0] / whole)), "beds": float(numpy.mean(runs[1] / whole))}


def next_points(vary, evidence, posterior, count, taken=()):
    """Points of the design whose runs would take most of the emulators' variance, weighed over the posterior, each
    block in units of all that it is compared with: greedy, one after the other, as the variance of a process does not
    depend on what comes out. taken: unit points under way. [(values, share of the variance that it takes)]."""
    import openturns
    random = numpy.random.default_rng(2)
    over = posterior.u[random.choice(len(posterior.u), min(WEIGHED, len(posterior.u)), replace=False)]
    candidates = numpy.vstack([numpy.array(openturns.SobolSequence(len(vary.names)).generate(CANDIDATES // 2)),
                               posterior.u[random.choice(len(posterior.u), CANDIDATES // 2)]])
    form = numpy.median(posterior.share, axis=0)[evidence.group] * evidence.scale
    whole = form**2 + evidence.sd**2 + evidence.noise
    points = numpy.vstack([candidates, over])
    n = len(candidates)
    states = [one.covariance(points, points) / w for one, w in zip(evidence.processes, whole)]
    noises = [one.noise / w for one, w in zip(evidence.processes, whole)]

    def take(k):
        for i, c in enumerate(states):
            column = c[:, k].copy()
            states[i] = c - numpy.outer(column, column) / (column[k] + noises[i])
    for one in taken:
        take(int(numpy.argmin(((candidates - numpy.asarray(one))**2).sum(axis=1))))
    found = []
    for _ in range(count):
        total = sum(float(numpy.diag(c)[n:].mean()) for c in states)
        gains = sum((c[n:, :n]**2).mean(axis=0) / (numpy.diag(c)[:n] + noise) for c, noise in zip(states, noises))
        k = int(numpy.argmax(gains))
        values = zip(vary.names, physical(vary, candidates[k:k + 1])[0])
        found.append(({name: round_to(value) for name, value in values}, float(gains[k] / total)))
        take(k)
    return found


def best_of(vary, target, posterior):
    """(values, how it was chosen): the posterior's mean where it is as likely as the samples usually are, else the
    sample of greatest density. Rounded to a tenth of what is not known."""
    middle = posterior.u.mean(axis=0, keepdims=True)
    share = numpy.log(posterior.share).mean(axis=0, keepdims=True)
    likely = float(target.log_likelihood(numpy.hstack([middle, share]))[0])
    usual = float(numpy.quantile(posterior.log_likelihood, 0.25))
    if likely >= usual:
        u, how = middle[0], "posterior mean"
    else:
        u, how = posterior.u[int(numpy.argmax(posterior.log_density))], "sample of greatest posterior density"
    values, sds = physical(vary, u[None])[0], physical(vary, posterior.u).std(axis=0)
    found = {}
    for name, value, sd in zip(vary.names, values, sds):
        digits = max(0, 1 - math.floor(math.log10(max(sd, 1e-12))))  # of the decimals: sd/10 or finer
        low, high = vary.ranges[name]
        found[name] = min(max(float(f"{value:.{digits}f}") if abs(value) < 1e4 else round_to(value, 3), low), high)
    return found, how
