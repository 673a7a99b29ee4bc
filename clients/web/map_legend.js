// What the colours of a raster mean.

import { element, svgElement } from './dom.js';
import { format } from './format.js';
import { cssOf, rampColour } from './map_colours.js';

const STEPS = 24;

function key(text, fills, width = 28) {
  const rects = fills.map((fill, i) => svgElement('rect', { x: (i * width) / fills.length, y: 0, width: width / fills.length + 0.3, height: 14, fill }));
  return element('span', {}, svgElement('svg', { viewBox: `0 0 ${width} 14`, class: 'swatch', 'aria-hidden': 'true' }, rects), text);
}

/** Of a scale of scaleOf. */
export function mapLegend({ low, high, hasZero, classes, values, colourOf }, unit) {
  const holes = element('span', {}, 'no colour: no data');
  if (classes !== null) return [...values.map((value) => key(classes.get(value) ?? String(value), [cssOf(colourOf(value))])), holes];
  const ramp = Array.from({ length: STEPS }, (_, i) => cssOf(rampColour(i / (STEPS - 1))));
  return [...(high >= low ? [key(`${format(low, 3)} to ${format(high, 3)} ${unit}`, ramp, 120)] : []),
    ...(hasZero ? [key('exactly 0', [cssOf(colourOf(0))])] : []), holes];
}
