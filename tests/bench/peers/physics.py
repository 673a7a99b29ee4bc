"""Do two codes find the same bed? Contact sums over the same instants."""
import math

LIMIT = 0.01
LARGEST_Z = 2.0  # of a difference of means over its standard error


def instants(path):
    """(step, rows of numbers) of a `dump local` file."""
    with open(path, encoding="ascii") as f:
        for line in f:
            if line.startswith("ITEM: TIMESTEP"):
                step = int(next(f))
                next(f)
                count = int(next(f))
                for _ in range(5):
                    next(f)
                yield step, [[float(v) for v in next(f).split()] for _ in range(count)]


def wrap(d, period):
    return d - period * round(d / period)


def sums(rows, settings, grains, lammps):
    """Overlap, coordination and stresses as bench/bed.h defines them."""
    volume = settings["length_m"] * settings["width_m"] * settings["height_m"]
    overlap = zz = xz = 0.0
    contacts = 0
    for r in rows:
        a, b = (int(r[0]), int(r[1])) if lammps else (int(r[6]), int(r[7]))
        ga, gb = grains[a - 1], grains[b - 1]
        if ga[11] and gb[11]:
            continue
        delta = ga[3] + gb[3] - r[2] if lammps else r[12]
        if delta <= 0:
            continue
        contacts += 1
        overlap += delta / min(ga[3], gb[3])
        if not lammps:
            dz = r[2] - r[5]  # z is not periodic
            zz += r[11] * dz
            xz += r[9] * dz
    free = sum(1 for g in grains if not g[11])
    out = {"mean_overlap_over_radius": overlap / max(1, contacts),
           "coordination": 2 * contacts / free}
    if not lammps:
        out["stress_zz_pa"], out["stress_xz_pa"] = zz / volume, xz / volume
    return out


def standard_error(values, blocks=8):
    """Of the mean of values that follow one another, from the means of blocks."""
    if len(values) < 2 * blocks:
        return None
    means = [math.fsum(values[len(values) * b // blocks:len(values) * (b + 1) // blocks]) /
             (len(values) * (b + 1) // blocks - len(values) * b // blocks) for b in range(blocks)]
    middle = math.fsum(means) / blocks
    return math.sqrt(math.fsum((m - middle) ** 2 for m in means) / (blocks - 1) / blocks)


def compare(pair, peer, machine):
    """Means over the instants; how far apart; whether that is within the limit."""
    lammps = pair.peer == "lammps"
    found = [sums(rows, peer.settings, peer.grains, lammps)
             for step, rows in instants(peer.contacts()) if step > pair.warmup]
    if len(found) != pair.samples:
        raise RuntimeError(f"{len(found)} instants in the peer's dump, expected {pair.samples}")
    ours, _ = machine.ours(pair, pair.check_steps, pair.samples)
    out = {}
    for name in found[0]:
        values = [f[name] for f in found]
        theirs, mine = math.fsum(values) / len(values), ours["physics"][name]
        # A settled bed has no shear stress: nothing to compare it with.
        judged = not (name == "stress_xz_pa" and pair.workload == "bed") and pair.same_law
        scale = abs(theirs) if judged or name != "stress_xz_pa" else abs(found[0]["stress_zz_pa"])
        difference = (mine - theirs) / scale
        error, limit = standard_error(values), LIMIT
        if pair.chaotic:  # ours fluctuates as the peer's does
            limit = LARGEST_Z * math.sqrt(2) * error / abs(scale)
        out[name] = {"peer": theirs, "ours": mine, "difference": difference,
                     "peer_standard_error": error, "limit": limit if judged else None,
                     "agrees": abs(difference) <= limit if judged else None}
    return out
