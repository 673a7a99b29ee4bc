"""DEM as truth: every point of the design calibrated from its own runs by the emulators of all others."""

import math

import numpy
import posterior as bayes
from emulator import Process
from evidence import Evidence
from known import ran_at

SAMPLES = 600


def without(process, k):
    """The process without its run k, lengths and variances kept."""
    return Process(numpy.delete(process.x, k, 0), numpy.delete(process.y, k), process.lengths, process.variance,
                   process.noise, process.columns)


def own_blocks(point, given, evidence):
    """Indices of the blocks that a point gave and was run at its own values for; none where a parameter acts on none of
    them."""
    own = [k for k, block in enumerate(evidence.blocks) if math.isfinite(given[k]) and not ran_at(point, block.kind)]
    acting = {column for one in evidence.processes for column in one.columns}
    return own if acting <= {column for k in own for column in evidence.processes[k].columns} else []


def band(n, share=0.9):
    """(low, high): counts that are expected of n regions of that share, each tail at most 2.5 % (exact, binomial)."""
    chances = [math.comb(n, k) * share**k * (1 - share)**(n - k) for k in range(n + 1)]
    low = next(k for k in range(n + 1) if sum(chances[:k + 1]) > 0.025)
    return low, next(k for k in range(n, -1, -1) if sum(chances[k:]) > 0.025)


def dem_as_truth(inference, most=None):
    """[{label, blocks, distance}] of the first `most` points that can be told, each from the fitted blocks that it was
    run at its own values for: the point lies in the 90 % region of what its runs say where distance is at most 1. Its
    runs stand for measured values of the stated standard deviations; they have no error of the form, which the
    posterior allows for: more than 90 % are expected inside."""
    runs, blocks, processes = inference.runs, inference.evidence.blocks, inference.evidence.processes
    given = numpy.array([[block.of_runs(one["outputs"]) for block in blocks] for one in runs.points])
    known = numpy.isfinite(given)
    own = {i: own_blocks(runs.points[i], given[i], inference.evidence) for i in range(len(given))}
    found = []
    for i in [i for i in own if own[i]][:most]:
        others = Evidence([blocks[k] for k in own[i]],
                          [without(processes[k], int(known[:i, k].sum())) for k in own[i]])
        got = bayes.sample(bayes.Target(others, given[i, own[i]]), seed=int(i), count=SAMPLES)
        truth = numpy.mean([runs.unit(blocks[k].kind)[i] for k in own[i]], axis=0)
        distance = bayes.region_distance(got, truth)
        found.append({"label": runs.points[i]["label"], "blocks": len(own[i]),
                      "distance": distance if math.isfinite(distance) else None})
    return found
