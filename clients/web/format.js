// Numbers with units, and the words for outputs, flags, regions and states (docs/glossary.md).

export const OUTPUTS = [
  { key: 'f_x', name: 'Drawbar pull', symbol: 'F_x', unit: 'N' },
  { key: 'f_y', name: 'Lateral force', symbol: 'F_y', unit: 'N', mirrored: true },
  { key: 'f_z', name: 'Vertical force', symbol: 'F_z', unit: 'N' },
  { key: 'torque', name: 'Drive torque', symbol: 'T', unit: 'N m' },
  { key: 'm_z', name: 'Moment about the vertical', symbol: 'M_z', unit: 'N m', mirrored: true },
  { key: 'sinkage', name: 'Sinkage', symbol: 'z', unit: 'm' },
];
export const outputOf = (key) => OUTPUTS.find((output) => output.key === key);

// As the command line's angles: the same bits.
export const toRadians = (deg) => deg * (Math.PI / 180);
export const toDegrees = (rad) => rad * (180 / Math.PI);

/** Slips that a motion at this attack angle can have (SlipForm in state.proto). */
export function possibleSlips(angleDeg) {
  const c = Math.cos(toRadians(angleDeg));
  return [-1 - Math.max(c, 0), 1 + Math.max(-c, 0)];
}

/** protobuf's JSON has NaN and infinities as strings. */
export const toNumber = (value) => (value === undefined || value === null ? NaN : Number(value));

/** With so many significant digits; a dash for what is unknown. */
export function format(value, digits = 5) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? '–' : String(value);
  return String(Number(value.toPrecision(digits))).replace('-', '−');
}
export const withUnit = (value, unit, digits = 5) => (Number.isNaN(value) ? 'unknown' : `${format(value, digits)} ${unit}`);
export const range = (low, high, digits = 4) => `${format(low, digits)} to ${format(high, digits)}`;
export const interval = (low, high, digits = 5) =>
  (Number.isNaN(low) ? 'unknown' : `${format(low, digits)} … ${format(high, digits)}`);
export const percent = (share) => (Number.isFinite(share) ? `${Math.round(100 * share)} %` : '–');

/** "3.2 s" of protobuf's durations becomes "3 s", "4 min", "2 h 5 min". */
export function duration(text) {
  const seconds = Math.round(parseFloat(text));
  if (!Number.isFinite(seconds)) return 'unknown';
  if (seconds < 90) return `${seconds} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 90 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}
export const moment = (text) => (text ? new Date(text).toLocaleString() : '–');

/** Bits of WheelResponses.flags (proto/grouser/v1alpha1/state.proto). */
const FLAGS = [
  [1, 'INVALID', 'not a possible state: a number is missing, negative or not finite, or no motion has this slip at this attack angle'],
  [2, 'CLAMPED', 'an input was clamped to the limits of the model'],
  [4, 'EXTRAPOLATED', 'outside of the training domain; the interval is wider there'],
  [8, 'STATIC', 'neither hub nor rim moves'],
  [16, 'NO_EQUILIBRIUM', 'the soil cannot carry this load'],
  [32, 'RATE', 'faster than the speeds that the model holds for'],
  [64, 'SLOPE', 'a slope was given; the model has none'],
  [256, 'VIRGIN_ASSUMED', 'a later pass was given; the model knows virgin ground alone'],
  [512, 'FORM_UNKNOWN', 'DEM was not compared with a measurement of some output here'],
  [1024, 'TOLERANCE_UNMET', 'no model is good enough for what was asked'],
  [2048, 'AIRBORNE', 'load 0: the wheel is off the ground'],
  [4096, 'UNTUNED', 'the model was not fitted to this wheel on this soil'],
];
/** [name, words] of each flag that is set. */
export function flagWords(bits) {
  const known = FLAGS.filter(([bit]) => (bits & bit) !== 0);
  const rest = known.reduce((left, [bit]) => left & ~bit, bits);
  return known.map(([, name, words]) => [name, words])
    .concat(rest === 0 ? [] : [[`bit ${rest}`, 'unknown to this page: see the version of the server']]);
}
export const isExtrapolated = (bits) => (bits & 4) !== 0;

export const REGIONS = {
  REGION_ALL: 'all',
  REGION_BRAKING: 'braking (slip below −0.05, angle to 15 deg)',
  REGION_TOWED: 'towed (|slip| to 0.05, angle to 15 deg)',
  REGION_DRIVING: 'driving (slip above 0.05, angle to 15 deg)',
  REGION_LATERAL: 'lateral (angle above 15 deg)',
};
export const ERROR_SETS = {
  held_out: 'held out: DEM runs that no fit saw',
  leave_one_out: 'leave one out; its coverage holds by construction',
  cross_conformal: 'leave one out, intervals calibrated without the run’s fold',
  untuned: 'models of other wheels that were not fitted either, scaled to this one',
  other_pairs: 'the same, intervals from the other pairs alone',
};

/** "JOB_STATE_RUNNING" becomes "running". */
export const enumWord = (prefix, text) => (text || '').replace(prefix, '').replaceAll('_', ' ').toLowerCase();
export const KINDS_OF_RUNS = {
  nearest: 'fitted', held_out: 'held out: the fit never saw it', overloads: 'overload: ended because the wheel sank too deep',
};
/** Axes of what the training runs covered: name, unit, factor to that unit. */
export const AXES = {
  slip: ['slip', '-', 1], attack_angle_rad: ['|attack angle|', 'deg', 180 / Math.PI], load_n: ['load', 'N', 1],
  speed_m_per_s: ['speed', 'm/s', 1],
};
export const shortDigest = (digest) => digest.slice(0, 12);
