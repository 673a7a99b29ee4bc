"""DEM as truth: every point of the design calibrated from its own runs by the emulators of all others."""

import math

import numpy
import posterior as bayes
from emulator import Process
from evidence import Evidence

SAMPLES = 600


def without(process, k):
    """The process without its run k, lengths and variances kept."""
    return Process(numpy.delete(process.x, k, 0), numpy.delete(process.y, k), process.lengths, process.variance,
                   process.noise, process.columns)


def dem_as_truth(inference, most=None):
    """[{label, distance}] of the first `most` points that gave every fitted block, each run at their own values: the
    point lies in the 90 % region of what its runs say where distance is at most 1. Its runs stand for measured values
    of the stated standard deviations; they have no error of the form, which the posterior allows for: more than 90 %
    are expected inside."""
    runs, blocks, processes = inference.runs, inference.evidence.blocks, inference.evidence.processes
    given = numpy.array([[block.of_runs(one["outputs"]) for block in blocks] for one in runs.points])
    known = numpy.isfinite(given)
    found = []
    whole = [i for i in numpy.flatnonzero(known.all(axis=1)) if not runs.points[i].get("known", {}).get("ran_at")]
    for i in whole[:most]:
        others = Evidence(blocks, [without(one, int(known[:i, k].sum())) for k, one in enumerate(processes)])
        got = bayes.sample(bayes.Target(others, given[i]), seed=int(i), count=SAMPLES)
        truth = numpy.mean([runs.unit(block.kind)[i] for block in blocks], axis=0)
        distance = bayes.region_distance(got, truth)
        found.append({"label": runs.points[i]["label"], "distance": distance if math.isfinite(distance) else None})
    return found
