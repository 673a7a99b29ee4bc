"""Gaussian processes that stand for the DEM runs: one for each number that is compared.

    y(x) = sum_k beta_k f_k(x) + Z(x) + noise,   f = 1, x_1 ... x_p,   x in the unit cube of the ranges
    cov Z(x), Z(x') = s^2 M(r),  r^2 = sum ((x_i - x'_i)/l_i)^2,  M(r) = (1 + sqrt(5) r + 5 r^2/3) exp(-sqrt(5) r)

(Matern 5/2, universal kriging). The noise of single runs and their beds is a nugget that is the same at all points:
its share of s^2 is chosen by the likelihood among NUGGETS, lengths and s by OpenTURNS at each. Prediction and
leave-one-out are the usual closed forms (Dubrule 1983), here in numpy, for thousands of points at once."""

import numpy

NUGGETS = (0.01, 0.05, 0.25, 1.0)  # variance of the noise over s^2
LENGTHS = (0.15, 10.0)             # of the unit cube
LEAST_TOLD = 1e-9  # variance of a process over that of a run from all others: below, they do not tell it


def matern(a, b, lengths):
    """(n, m) correlations."""
    r2 = sum((((a[:, None, k] - b[None, :, k]) / lengths[k])**2 for k in range(len(lengths))),
             numpy.zeros((len(a), len(b))))
    r = numpy.sqrt(5 * r2)
    return (1 + r + r * r / 3) * numpy.exp(-r)


def trend(x):
    return numpy.column_stack([numpy.ones(len(x)), x])


class Process:
    """One fitted process. x: (n, p); y: (n); lengths, variance s^2, noise: its variance. columns: of x, those that it
    depends on, each with its length."""

    def __init__(self, x, y, lengths, variance, noise, columns=None):
        self.x, self.y = x, y
        self.lengths, self.variance, self.noise = lengths, variance, noise
        self.columns = list(range(x.shape[1])) if columns is None else columns
        n, self.own = len(y), x[:, self.columns]
        covariance = variance * matern(self.own, self.own, lengths) + noise * numpy.eye(n)
        self.inverse = numpy.linalg.inv(covariance)
        f = trend(self.own)
        self.f_inverse = self.inverse @ f
        self.gram_inverse = numpy.linalg.inv(f.T @ self.f_inverse)
        self.beta = self.gram_inverse @ (self.f_inverse.T @ y)
        self.weights = self.inverse @ (y - f @ self.beta)

    def at(self, x):
        """(mean, sd) of the noise-free surface at (m, p); the sd of kriging, of trend and surface."""
        x = x[:, self.columns]
        k = self.variance * matern(x, self.own, self.lengths)
        f = trend(x)
        mean = f @ self.beta + k @ self.weights
        left = f - k @ self.f_inverse
        variance = (self.variance - numpy.einsum("ij,jk,ik->i", k, self.inverse, k)
                    + numpy.einsum("ij,jk,ik->i", left, self.gram_inverse, left))
        return mean, numpy.sqrt(numpy.maximum(variance, 0.0))

    def covariance(self, a, b):
        """Of the surface between two sets of points, given the runs."""
        a, b = (one[:, self.columns] for one in (a, b))
        ka, kb = (self.variance * matern(one, self.own, self.lengths) for one in (a, b))
        left_a, left_b = trend(a) - ka @ self.f_inverse, trend(b) - kb @ self.f_inverse
        return (self.variance * matern(a, b, self.lengths) - ka @ self.inverse @ kb.T
                + left_a @ self.gram_inverse @ left_b.T)

    def left_out(self):
        """(mean, sd) for each run from all others, noise of the run that is left out included. nan, inf: of a run that
        the others have no trend for, as it alone has another value of a parameter."""
        q = self.inverse - self.f_inverse @ self.gram_inverse @ self.f_inverse.T
        own = numpy.diag(q)
        own = numpy.where(own > LEAST_TOLD / (self.variance + self.noise), own, numpy.nan)
        return self.y - (q @ self.y) / own, numpy.nan_to_num(1 / numpy.sqrt(own), nan=numpy.inf)

    def log_likelihood(self):
        residual = self.y - trend(self.own) @ self.beta
        sign, log_determinant = numpy.linalg.slogdet(self.inverse)
        return 0.5 * log_determinant - 0.5 * float(residual @ self.weights) if sign > 0 else -numpy.inf


def straight(x, y, columns):
    """A process where no likelihood has a maximum: what a plane leaves over is half surface, half noise."""
    f = trend(x[:, columns])
    left = y - f @ numpy.linalg.lstsq(f, y, rcond=None)[0]
    least = 1e-6 * float(numpy.abs(y).max() or 1.0)
    variance = max(float(left @ left) / max(1, len(y) - f.shape[1]), least**2) / 2
    return Process(x, y, numpy.ones(len(columns)), variance, variance, columns)


def fit(x, y, columns=None):
    """The process of greatest likelihood. x: (n, p) in the unit cube, y: (n); columns: those of x that y depends on,
    all where nothing is said; at least three runs more than these."""
    import openturns
    openturns.Log.Show(openturns.Log.NONE)
    columns = list(range(x.shape[1])) if columns is None else columns
    own = openturns.Sample(x[:, columns].tolist())
    centre, spread = float(numpy.mean(y)), float(numpy.std(y))
    if not columns or spread < 1e-9 * abs(centre):
        return straight(x, y, columns)
    p = len(columns)
    best = None
    for share in NUGGETS:
        model = openturns.MaternModel([0.7] * p, [1.0], 2.5)
        model.setNuggetFactor(share)
        algorithm = openturns.KrigingAlgorithm(own, openturns.Sample([[one] for one in (y - centre) / spread]), model,
                                               openturns.LinearBasisFactory(p).build())
        algorithm.setOptimizationBounds(openturns.Interval([LENGTHS[0]] * p, [LENGTHS[1]] * p))
        try:
            algorithm.run()
        except (RuntimeError, TypeError):
            continue  # no optimum for this share
        found = algorithm.getResult().getCovarianceModel()
        variance = float(found.getAmplitude()[0])**2 * spread**2
        if not variance > 1e-12 * spread**2:
            continue  # a plane alone
        one = Process(x, y, numpy.array(found.getScale()), variance, share * variance, columns)
        if best is None or one.log_likelihood() > best.log_likelihood():
            best = one
    return best or straight(x, y, columns)
