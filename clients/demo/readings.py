"""What the report says about each plot, in words made from its numbers."""

import math
import statistics

from records import AXES, EXTRAPOLATED, PREDICTED, degrees, number


def campaign(runs):
    counts = {}
    for run in runs:
        counts[run.status] = counts.get(run.status, 0) + 1
    held_out = sum(run.role == "test" and run.steady for run in runs)
    text = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    return (f"{len(runs)} runs: {text}. Only STEADY runs (at least "
            f"{min(int(run.record['blocks']) for run in runs if run.steady)} blocks each) train or "
            f"test; {held_out} of them were held out and never shown to the fitter.")


def against_slip(steady, near, measured, load):
    forward = [run for run in steady if abs(run.angle_deg) < 0.5]
    text = ""
    if forward:
        best = max(forward, key=lambda run: run.mean["f_x"])
        share = max(forward, key=lambda run: run.mean["f_x"] / run.load_n)
        text = (f"The largest steady drawbar pull at 0° is {best.mean['f_x']:.2f} N (slip {best.slip:.2f}, "
                f"load {best.load_n:g} N), the largest share of the load "
                f"{100 * share.mean['f_x'] / share.load_n:.0f} % (slip {share.slip:.2f}, load "
                f"{share.load_n:g} N). ")
    return text + (f"{near} of {measured} measured points have one of these attack angles and a load "
                   f"within 15 % of {load:g} N and are drawn; all are in the table below. The interval covers a fresh DEM mean, "
                   "not the measurement: where green squares lie outside the band, the grains, not the "
                   "fit, are off. They are not calibrated yet.")


def against_angle(curves):
    text = []
    for slip, responses in curves.items():
        side = responses.array("f_y")
        text.append(f"at slip {slip:g} the lateral force goes from {side[0]:.2f} N at "
                    f"{responses.angle_deg[0]:.0f}° to {side[-1]:.2f} N at {responses.angle_deg[-1]:.0f}°")
    return ("Sliding to the left (positive angle) is opposed by a force to the right (negative): "
            + "; ".join(text) + ".")


def parity(pairs, level):
    total = inside = 0
    worst = []
    for output in PREDICTED:
        errors = []
        for run, answer in pairs:
            value, low, high = answer[output]
            total += 1
            inside += low <= run.mean[output] <= high
            errors.append(value - run.mean[output])
        scale, unit = AXES[output][2], AXES[output][1]
        worst.append(f"{output} {scale * statistics.fmean(e * e for e in errors) ** 0.5:.2g} {unit}")
    return (f"{inside} of {total} held-out DEM means lie inside their {100 * level:.0f} % interval. "
            f"Root mean square errors: {', '.join(worst)}. {len(pairs)} states are few: the share has "
            f"a standard error of about {100 * (level * (1 - level) / len(pairs)) ** 0.5:.0f} points.")


def pressure_run(steady):
    """The run shown: driving, straight on, at the load nearest the middle."""
    straight = [run for run in steady if abs(run.angle_deg) < 0.5] or steady
    loads = sorted(run.load_n for run in straight)
    middle = loads[len(loads) // 2]
    return min(straight, key=lambda run: (abs(run.load_n - middle), abs(run.slip - 0.2)))


def pressure(run):
    stress = run.record["stress"]
    bins = int(stress["width_bins"])
    normal = [number(x) for x in stress["normal_pa"]]
    means = [statistics.fmean(normal[i:i + bins]) for i in range(0, len(normal), bins)]
    peak = max(range(len(means)), key=means.__getitem__)
    angle = degrees(stress["first_angle_rad"]) + (peak + 0.5) * degrees(stress["angle_step_rad"])
    width = 1000 * number(run.record["spec"]["wheel"]["width_m"]) / bins
    grain = 1000 * number(run.record["bed"]["mean_diameter_m"])
    return (f"Slip {run.slip:.2f}, attack angle {run.angle_deg:.0f}°, load {run.load_n:g} N. The mean "
            f"normal stress peaks at {max(means) / 1000:.2g} kPa, {angle:.0f}° from straight down "
            f"(positive: ahead of the axle); soil is met at {degrees(stress['entry_angle_rad']):.0f}° and "
            f"left at {degrees(stress['exit_angle_rad']):.0f}°. A bin across the rim is {width:.0f} mm, a "
            f"grain {grain:.1f} mm: single bins are noisy.")


def refinement(before, after, held_out):
    better, narrower, inside = [], [], [0, 0]
    for output in PREDICTED:
        truth = held_out.mean[output]
        if abs(after[output][0] - truth) < abs(before[output][0] - truth):
            better.append(output)
        if after[output][2] - after[output][1] < before[output][2] - before[output][1]:
            narrower.append(output)
        for k, answer in enumerate((before, after)):
            inside[k] += answer[output][1] <= truth <= answer[output][2]
    named = [", ".join(names) if names else "none" for names in (better, narrower)]
    return (f"The held-out run stands at the same state on another bed and was shown to neither fit. The "
            f"error fell for {named[0]}; the interval narrowed for {named[1]}. The held-out mean lies "
            f"inside the interval for {inside[0]} of {len(PREDICTED)} outputs before and {inside[1]} after. "
            "One placement of the bed differs from the next, so a single held-out run is itself uncertain "
            "by more than its own standard error.")


def measured(rows):
    """Where DEM trained the surrogate, and where it did not."""
    groups = (("inside the hull of the training runs", [r for r in rows if not extrapolated(r)]),
              ("outside it, where no DEM run stands behind the surrogate", [r for r in rows if extrapolated(r)]))
    text = [f"At the {len(group)} points {where}: {agreement(group)}." for where, group in groups if group]
    return " ".join(text) + (" The grains are far larger than sand and not calibrated to it; this is the error "
                             "that calibration has to remove.")


def extrapolated(row):
    return bool(int(row["flags"]) & EXTRAPOLATED)


def agreement(rows):
    text = []
    for output in ("f_x", "f_y", "sinkage"):
        scale, unit = AXES[output][2], AXES[output][1]
        pairs = [(row["measured"][output], row["surrogate"][output]) for row in rows
                 if not math.isnan(number(row["measured"][output]["value"]))]
        if not pairs:
            continue
        off = [scale * (number(model["value"]) - number(wheel["value"])) for wheel, model in pairs]
        inside = sum(number(model["low"]) <= number(wheel["value"]) <= number(model["high"])
                     for wheel, model in pairs)
        text.append(f"{output} of the surrogate minus the measurement is {statistics.fmean(off):+.3g} {unit} on "
                    f"average, {statistics.fmean(d * d for d in off) ** 0.5:.3g} {unit} rms, with {inside} of "
                    f"{len(pairs)} measurements inside the interval for DEM")
    return "; ".join(text)
