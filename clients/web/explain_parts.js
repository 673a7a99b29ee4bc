// What an Explanation (proto/grouser/v1alpha1/explanation.proto) says, in numbers and words. No page is needed here.

import { format, toDegrees, toNumber } from './format.js';

export const PARTS = [
  { key: 'sd_fit_inside', name: 'fit', words: 'what the fit misses near its runs' },
  { key: 'sd_fit_beyond', name: 'far', words: 'the fit, grown with the hull distance' },
  { key: 'sd_patch', name: 'patch', words: 'one placement of the bed' },
];

/** Shares of PARTS in the variance of the interval that covers DEM; null where there are none. */
export function varianceShares(output) {
  const sds = PARTS.map(({ key }) => toNumber(output[key]));
  const most = Math.max(...sds);  // divided by first, so that no square overflows
  if (!(most > 0)) return null;  // NaN too: hard ground, or not answered
  const squares = sds.map((sd) => (sd / most) ** 2);
  const sum = squares.reduce((a, b) => a + b);
  return squares.map((square) => square / sum);
}

/** Where the bins of a StressSummary lie, from straight down, forward positive [deg]: their middles. */
export const binMiddles = (stress, values) => values.map((_, i) =>
  toDegrees(toNumber(stress.first_angle_rad) + (i + 0.5) * toNumber(stress.angle_step_rad)));

/** [normal, shear] as [{x [deg], y [kPa]}]; empty where the two do not fit together. */
export function stressCurves(stress) {
  const both = [stress.normal_pa, stress.shear_tangential_pa];
  if (both[0].length === 0 || both[0].length !== both[1].length) return [[], []];
  const angles = binMiddles(stress, both[0]);
  return both.map((values) => values.map((value, i) => ({ x: angles[i], y: toNumber(value) / 1e3 })));
}

/** "normal to 12 kPa at 22 deg, shear −0.4 to 3.1 kPa". */
export function stressText(stress) {
  const [normal, shear] = stressCurves(stress);
  if (normal.length === 0) return 'no stress';
  const peak = normal.reduce((best, point) => (point.y > best.y ? point : best));
  if (!(peak.y > 0)) return 'no contact';
  const values = shear.map((point) => point.y);
  return `normal to ${format(peak.y, 3)} kPa at ${format(peak.x, 2)} deg, shear ${format(Math.min(...values), 3)} to ` +
    `${format(Math.max(...values), 3)} kPa`;
}

/** The runs of an Explanation, [{kind: a key of KINDS_OF_RUNS, near}], in its order. */
export const allRuns = (explanation) =>
  ['nearest', 'held_out', 'overloads'].flatMap((kind) => explanation[kind].map((near) => ({ kind, near })));

/** Whether DEM's mean lies within the model's interval at the run's own state; null where the run has no means. */
export function isCovered(near, output) {
  if ([near.mean, near.model_low, near.model_high].some((values) => values.length !== 6)) return null;
  const [mean, low, high] = [near.mean, near.model_low, near.model_high].map((values) => toNumber(values[output]));
  return mean >= low && mean <= high;
}
