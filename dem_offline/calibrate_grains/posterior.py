"""Posterior of the grains' parameters by tempered stages (sequential Monte Carlo; Del Moral, Doucet, Jasra 2006).

Unknown: u, the parameters in the unit cube of their ranges, uniform before; and for each group g of rows (plates,
pressed wheel, each output of wheels) share_g, the error of the form: what grains are off by whatever their
parameters, as a share of the value or of load, load x radius, radius. Before:
    share_g^2 ~ scaled inverse chi-squared(2, typical_g^2): the typical error counts as two rows,
as in surrogate/calibrate/soil_fit.h. Likelihood of the measured values y of the blocks:
    y ~ N(m(u), S R S + D),  S = diag sqrt(sd_emulator(u)^2 + noise^2),  D = diag(sd^2 + (share_g scale)^2)
R: correlation of the emulators' errors within a run; noise: of the beds that all points share."""

import math

import numpy

COUNT = 1200       # samples
LEAST_EFFECTIVE = 0.5  # of them, which sets the next temperature
MOVES, LAST_MOVES = 6, 20  # Metropolis steps after each stage
PRIOR_ROWS = 2     # what the typical error counts as


class Posterior:
    """u: (m, p); share: (m, groups); log_density: of each sample, up to a constant; stages; accepted: share of the
    last moves; distinct: share of different samples."""

    def __init__(self, u, share, log_density, log_likelihood, stages, accepted):
        self.u, self.share, self.log_density = u, share, log_density
        self.log_likelihood, self.stages, self.accepted = log_likelihood, stages, accepted
        self.distinct = len(numpy.unique(u.round(12), axis=0)) / len(u)


class Target:
    """The density that is sampled, of an Evidence with its measured values or others (for tests)."""

    def __init__(self, evidence, value=None):
        self.evidence = evidence
        self.value = evidence.value if value is None else value
        self.noise = evidence.noise
        self.clusters = evidence.clusters()
        self.p = evidence.processes[0].x.shape[1]
        self.groups = len(evidence.groups)

    def draw(self, count, random):
        """Samples of the prior: [u, log share]."""
        u = random.random((count, self.p))
        log_share = numpy.log(self.evidence.typical) + 0.5 * numpy.log(
            PRIOR_ROWS / random.chisquare(PRIOR_ROWS, (count, self.groups)))
        return numpy.hstack([u, log_share])

    def log_prior(self, z):
        u, log_share = z[:, :self.p], z[:, self.p:]
        inside = ((u >= 0) & (u <= 1)).all(axis=1)
        ratio2 = numpy.exp(2 * (numpy.log(self.evidence.typical) - log_share))
        # Of ln share: the density of share^2 times 2 share^2.
        log_p = (-PRIOR_ROWS * log_share - 0.5 * PRIOR_ROWS * ratio2).sum(axis=1)
        return numpy.where(inside, log_p, -numpy.inf)

    def log_likelihood(self, z):
        e = self.evidence
        mean, sd = e.at(numpy.clip(z[:, :self.p], 0, 1))
        share = numpy.exp(z[:, self.p:])[:, e.group]
        own = numpy.sqrt(sd**2 + self.noise)
        diagonal = e.sd**2 + (share * e.scale)**2
        residual = self.value - mean
        total = numpy.zeros(len(z))
        for k in self.clusters:
            covariance = own[:, k, None] * own[:, None, k] * e.correlation[numpy.ix_(k, k)]
            covariance[:, range(len(k)), range(len(k))] += diagonal[:, k]
            factor = numpy.linalg.cholesky(covariance)
            white = numpy.linalg.solve(factor, residual[:, k, None])[..., 0]
            total -= 0.5 * (white**2).sum(axis=1)
            total -= numpy.log(numpy.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
        return total


def next_temperature(log_likelihood, now):
    """So much higher that the weights leave LEAST_EFFECTIVE of the samples."""
    def effective(step):
        w = numpy.exp(step * (log_likelihood - log_likelihood.max()))
        return w.sum()**2 / (w**2).sum() / len(w)
    if effective(1 - now) >= LEAST_EFFECTIVE:
        return 1.0
    low, high = 0.0, 1 - now
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle) >= LEAST_EFFECTIVE else (low, middle)
    return now + max(low, 1e-9)


def resampled(weights, random):
    """Indices, systematic."""
    edges = numpy.cumsum(weights / weights.sum())
    return numpy.minimum(numpy.searchsorted(edges, (random.random() + numpy.arange(len(weights))) / len(weights)),
                         len(weights) - 1)


def moved(target, z, prior, likelihood, temperature, steps, random):
    """Random-walk Metropolis of all samples at once, steps from their own spread; every third step a short one."""
    spread = numpy.cov(z.T) + 1e-10 * numpy.eye(z.shape[1])
    factor = numpy.linalg.cholesky(spread)
    taken = 0.0
    for k in range(steps):
        scale = (2.4 if k % 3 else 0.6) / math.sqrt(z.shape[1])
        proposal = z + scale * random.standard_normal(z.shape) @ factor.T
        new_prior = target.log_prior(proposal)
        inside = numpy.isfinite(new_prior)
        new = numpy.full(len(z), -numpy.inf)
        if inside.any():
            new[inside] = target.log_likelihood(proposal[inside])
        with numpy.errstate(invalid="ignore"):
            gain = numpy.where(inside, new_prior + temperature * new - prior - temperature * likelihood, -numpy.inf)
        accept = numpy.log(random.random(len(z))) < gain
        z = numpy.where(accept[:, None], proposal, z)
        prior, likelihood = numpy.where(accept, new_prior, prior), numpy.where(accept, new, likelihood)
        taken += accept.mean() / steps
    return z, prior, likelihood, taken


def sample(target, seed=1, count=COUNT):
    """The Posterior; the same for the same seed."""
    random = numpy.random.default_rng(seed)
    z = target.draw(count, random)
    prior, likelihood = target.log_prior(z), target.log_likelihood(z)
    temperature, stages = 0.0, 0
    while temperature < 1:
        new = next_temperature(likelihood, temperature)
        weights = numpy.exp((new - temperature) * (likelihood - likelihood.max()))
        chosen = resampled(weights, random)
        z, prior, likelihood = z[chosen], prior[chosen], likelihood[chosen]
        temperature = new
        z, prior, likelihood, accepted = moved(target, z, prior, likelihood, temperature,
                                               LAST_MOVES if new == 1 else MOVES, random)
        stages += 1
    return Posterior(z[:, :target.p], numpy.exp(z[:, target.p:]), prior + likelihood, likelihood, stages, accepted)


def region_distance(posterior, u):
    """Squared distance of u from the samples' mean in their own spread, over its 90 % quantile among them: u lies in
    the 90 % region where it is at most 1."""
    mean = posterior.u.mean(axis=0)
    inverse = numpy.linalg.inv(numpy.cov(posterior.u.T).reshape(len(mean), -1) + 1e-12 * numpy.eye(len(mean)))
    own = numpy.einsum("ij,jk,ik->i", posterior.u - mean, inverse, posterior.u - mean)
    return float((u - mean) @ inverse @ (u - mean)) / float(numpy.quantile(own, 0.9))
