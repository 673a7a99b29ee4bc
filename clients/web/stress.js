// Stresses on the rim, unrolled: over the angle from straight down.

import { element, svgElement } from './dom.js';
import { KINDS_OF_RUNS } from './format.js';
import { stressCurves, stressText } from './explain_parts.js';
import { drawAxes, MARGIN, path, scale, withRoom } from './plot.js';

const ANGLES_DEG = [-120, 120];  // nothing touches beyond
const MOST = { nearest: 4, held_out: 2, overloads: 0 };  // curves of runs that can be told apart

const nameOf = ({ run }) => run.sha256.slice(0, 6) || run.run_id.slice(0, 6) || '?';

/** What is drawn: [{name, style (a CSS class), curves: [normal, shear], text}]. */
export function stressesOf(explanation) {
  const drawn = [];
  for (const [kind, most] of Object.entries(MOST)) {
    const runs = explanation[kind].filter((near) => near.stress && stressCurves(near.stress)[0].length > 0).slice(0, most);
    runs.forEach((near, i) => drawn.push({
      name: `run ${nameOf(near)}, ${KINDS_OF_RUNS[kind].replace(/:.*/, '')}`, style: kind === 'nearest' ? `rim near-${i}` : `rim held-${i}`,
      curves: stressCurves(near.stress), text: stressText(near.stress),
    }));
  }
  if (explanation.physics_stress) {
    drawn.push({
      name: 'the model’s physics at the state', style: 'rim physics', curves: stressCurves(explanation.physics_stress),
      text: stressText(explanation.physics_stress),
    });
  }
  return drawn;
}

function plotOf(which, words, drawn) {
  const [width, height] = [440, 230];
  const yRange = withRoom(drawn.flatMap(({ curves }) => curves[which].map(({ y }) => y)).filter(Number.isFinite));
  const toX = scale(ANGLES_DEG, MARGIN.left, width - MARGIN.right);
  const toY = scale(yRange, height - MARGIN.bottom, MARGIN.top);
  const lines = drawn.map(({ style, curves }) => {
    const points = curves[which].filter(({ x, y }) => Number.isFinite(y) && x >= ANGLES_DEG[0] && x <= ANGLES_DEG[1]);
    return svgElement('path', { class: style, d: path(points.map(({ x, y }) => [toX(x), toY(y)])) });
  });
  const label = `${words} over the angle. ${drawn.map(({ name, text }) => `${name}: ${text}`).join('; ')}`;
  return element('figure', {}, element('figcaption', {}, `${words} [kPa]`),
    svgElement('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': label, class: 'stress' },
      drawAxes(ANGLES_DEG, yRange, toX, toY, 'angle from straight down, forward positive [deg]', width, height).filter(Boolean), lines));
}

/** Both stresses as drawings with a legend; null where nothing has one. */
export function stressFigures(explanation) {
  const drawn = stressesOf(explanation);
  if (drawn.length === 0) return null;
  const line = (style) => svgElement('svg', { viewBox: '0 0 28 14', 'aria-hidden': 'true' }, svgElement('path', { class: style, d: 'M1 7H27' }));
  return element('div', {},
    element('div', { class: 'legend' }, drawn.map(({ name, style }) => element('span', {}, line(style), name))),
    element('div', { class: 'plots pair' }, plotOf(0, 'Normal stress on the rim', drawn), plotOf(1, 'Shear stress along the rim', drawn)));
}
