// Colours of a raster's cells. No page is needed here.

// Viridis by Smith and van der Walt (CC0), five of its colours, with straight lines between.
const RAMP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
const ZERO = [150, 40, 40];  // speed, P(GO): not driven
// Okabe and Ito, told apart by most people; then greys.
const MOST_CLASSES = 256;  // that are there; more are shown as numbers
const CLASSES = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [240, 228, 66], [90, 90, 90],
  [130, 130, 130], [170, 170, 170]];

export const cssOf = ([r, g, b]) => `rgb(${r},${g},${b})`;

export function rampColour(share) {
  const at = Math.min(1, Math.max(0, share)) * (RAMP.length - 1);
  const i = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[i].map((low, k) => Math.round(low + (at - i) * (RAMP[i + 1][k] - low)));
}

/**
 * {low, high: of the cells but zeros where hasZero, hasZero: some are exactly 0 and none below, classes: those given, or null
 * where there are too many values for them, values: which there are, where they are classes, colourOf(value): [r, g, b]}.
 * classes: a Map of names by number, or null.
 */
export function scaleOf(cells, classes) {
  let [low, high, zeros, least] = [Infinity, -Infinity, 0, Infinity];
  const values = new Set();
  for (const value of cells) {
    if (Number.isNaN(value)) continue;
    if (classes !== null && values.size <= MOST_CLASSES) values.add(value);
    least = Math.min(least, value);
    if (value === 0) {
      ++zeros;
      continue;
    }
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  const hasZero = zeros > 0 && least === 0;
  if (!hasZero && zeros > 0) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const span = high > low ? high - low : 1;
  const ofNumber = (value) => (hasZero && value === 0 ? ZERO : rampColour((value - low) / span));
  if (classes === null || values.size > MOST_CLASSES) return { low, high, hasZero, classes: null, values: [], colourOf: ofNumber };
  const there = [...values].sort((a, b) => a - b);
  const colours = new Map(there.map((value, i) => [value, CLASSES[i % CLASSES.length]]));
  return { low, high, hasZero, classes, values: there, colourOf: (value) => colours.get(value) };
}

/** RGBA of cells; no data is transparent. */
export function pixelsOf(cells, scale) {
  const pixels = new Uint8ClampedArray(4 * cells.length);
  cells.forEach((value, i) => {
    if (Number.isNaN(value)) return;
    [pixels[4 * i], pixels[4 * i + 1], pixels[4 * i + 2]] = scale.colourOf(value);
    pixels[4 * i + 3] = 255;
  });
  return pixels;
}
