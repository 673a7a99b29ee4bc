// A plot of curves with bands over one axis, as SVG.

import { svgElement } from './dom.js';
import { format } from './format.js';

export const MARGIN = { left: 50, right: 12, top: 10, bottom: 32 };
const HEIGHT_SHARE = 0.56;  // of the width
const RADIUS = 3;

/** Round numbers within [low, high], about `count` of them. */
export function ticks(low, high, count) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(span / count));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => span / size <= count);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

/** Stretches of the indices below `count` in which `keep` holds, of `least` indices or more. */
function stretches(count, keep, least) {
  const found = [];
  for (let i = 0; i < count; ++i) {
    if (!keep(i)) continue;
    if (i > 0 && keep(i - 1)) found.at(-1).push(i);
    else found.push([i]);
  }
  return found.filter((stretch) => stretch.length >= least);
}

export const path = (points) => points.map(([x, y], i) => `${i === 0 ? 'M' : 'L'}${x.toFixed(1)} ${y.toFixed(1)}`).join('');

/**
 * From lowest to highest of what is drawn and 0, with room around; bands outside of the training domain, which
 * may be many times wider than all else, are cut.
 */
function valueRange(series, rows) {
  const values = rows.flatMap((row) => [row.value, row.value - row.sd, row.value + row.sd, ...row.beside]).concat(series.flatMap((s) => {
    const isAllOutside = s.outside.every(Boolean);
    const inside = (ends) => ends.filter((_, i) => isAllOutside || !s.outside[i]);
    return [...s.value, ...inside(s.low), ...inside(s.high), ...s.runs.map((run) => run.value)];
  })).filter(Number.isFinite);
  return withRoom(values);
}

/** From lowest to highest of these and 0, with room around. */
export function withRoom(values) {
  const low = Math.min(0, ...values);
  const high = Math.max(0, ...values);
  const room = 0.06 * (high - low || 1);
  return [low < 0 ? low - room : 0, high > 0 || low === 0 ? high + room : 0];
}

/** The value at x of a curve, between its points; NaN outside. */
export function valueAt(series, x) {
  const next = series.x.findIndex((at) => at >= x);
  if (next < 0) return NaN;
  if (series.x[next] === x) return series.value[next];
  if (next === 0) return NaN;
  const share = (x - series.x[next - 1]) / (series.x[next] - series.x[next - 1]);
  return series.value[next - 1] + share * (series.value[next] - series.value[next - 1]);
}

function drawSeries({ name, x, value, low, high, outside, runs }, toX, toY, [bottom, top]) {
  const toCut = (y) => Math.min(bottom, Math.max(top, toY(y)));
  const known = (i) => Number.isFinite(value[i]);
  const bands = stretches(x.length, (i) => Number.isFinite(low[i]) && Number.isFinite(high[i]), 2)
    .map((stretch) => svgElement('path', {
      class: 'band',
      d: `${path([...stretch.map((i) => [toX(x[i]), toCut(high[i])]),
        ...stretch.toReversed().map((i) => [toX(x[i]), toCut(low[i])])])}Z`,
    }));
  // Of the segments from i to i + 1: outside of the training domain where one of their ends is.
  const curves = [false, true].flatMap((isOutside) => stretches(x.length - 1,
    (i) => known(i) && known(i + 1) && (outside[i] || outside[i + 1]) === isOutside, 1)
    .map((stretch) => svgElement('path', {
      class: isOutside ? 'curve outside' : 'curve',
      d: path([...stretch, stretch.at(-1) + 1].map((i) => [toX(x[i]), toY(value[i])])),
    })));
  const circles = runs.map((run) => svgElement('circle', {
    class: 'run', cx: toX(run.x), cy: toY(run.value), r: RADIUS,
  }));
  return svgElement('g', { class: name }, bands, curves, circles);
}

/** A measured row: a diamond with a bar of +- sd. */
export function drawRow({ x, value, sd, title }, toX, toY) {
  const [at, middle] = [toX(x), toY(value)];
  const r = RADIUS + 1;
  return svgElement('g', { class: 'measured' },
    title === undefined ? null : svgElement('title', {}, title),
    Number.isFinite(sd) ? svgElement('line', { x1: at, x2: at, y1: toY(value - sd), y2: toY(value + sd) }) : null,
    svgElement('path', { d: `M${at - r} ${middle}L${at} ${middle - r}L${at + r} ${middle}L${at} ${middle + r}Z` }));
}

/** What a model says at the state of a measured row: a cross. */
export const drawBeside = (x, y) =>
  svgElement('path', { class: 'beside', d: `M${x - RADIUS} ${y - RADIUS}l${2 * RADIUS} ${2 * RADIUS}m0 ${-2 * RADIUS}l${-2 * RADIUS} ${2 * RADIUS}` });

export const scale = ([low, high], from, to) => (at) => from + ((at - low) / (high - low)) * (to - from);

export function drawAxes([xLow, xHigh], [yLow, yHigh], toX, toY, xLabel, width, height) {
  const [left, right] = [toX(xLow), toX(xHigh)];
  const [bottom, top] = [toY(yLow), toY(yHigh)];
  const line = (kind, x1, y1, x2, y2) => svgElement('line', { class: kind, x1, y1, x2, y2 });
  return [
    ticks(xLow, xHigh, Math.max(3, width / 55)).map((x) => [
      line('grid', toX(x), bottom, toX(x), top),
      svgElement('text', { x: toX(x), y: bottom + 14, 'text-anchor': 'middle' }, format(x)),
    ]),
    ticks(yLow, yHigh, Math.max(3, height / 40)).map((y) => [
      line('grid', left, toY(y), right, toY(y)),
      svgElement('text', { x: left - 5, y: toY(y) + 4, 'text-anchor': 'end' }, format(y)),
    ]),
    line('axis', left, bottom, right, bottom), line('axis', left, bottom, left, top),
    yLow < 0 && yHigh > 0 ? line('zero', left, toY(0), right, toY(0)) : null,
    svgElement('text', { x: (left + right) / 2, y: height - 4, 'text-anchor': 'middle' }, xLabel),
  ].flat(3);
}

/**
 * Draws into an empty or drawn <svg>. series: {name (a CSS class), x, value, low, high, outside (of the
 * training domain), runs: [{x, value}]}; rows: measured, [{x, value, sd, title, beside: a value of each series}]; asked:
 * the x of the state that is asked. Returns the function from a place in the window to x.
 */
export function drawPlot(svg, { series, rows, xRange, xLabel, asked, label }) {
  const width = Math.max(260, svg.getBoundingClientRect().width || 400);
  const height = Math.round(Math.max(190, HEIGHT_SHARE * width));
  const shownRows = rows.filter(({ x }) => x >= xRange[0] && x <= xRange[1]);
  const yRange = valueRange(series, shownRows);
  const toX = scale(xRange, MARGIN.left, width - MARGIN.right);
  const toY = scale(yRange, height - MARGIN.bottom, MARGIN.top);
  svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
  svg.setAttribute('role', 'img');
  svg.setAttribute('aria-label', label);
  const isShown = asked >= xRange[0] && asked <= xRange[1];
  const spots = series.map((s) => [s.name, valueAt(s, asked)]).filter(([, value]) => Number.isFinite(value));
  svg.replaceChildren(
    ...drawAxes(xRange, yRange, toX, toY, xLabel, width, height).filter((node) => node !== null),
    ...series.map((s) => drawSeries(s, toX, toY, [height - MARGIN.bottom, MARGIN.top])),
    ...shownRows.map((row) => svgElement('g', {},
      drawRow(row, toX, toY), row.beside.map((value, i) => (Number.isFinite(value) ?
        svgElement('g', { class: series[i].name }, drawBeside(toX(row.x), toY(value))) : null)))),
    ...(isShown ? [svgElement('line', {
      class: 'asked', x1: toX(asked), x2: toX(asked), y1: MARGIN.top, y2: height - MARGIN.bottom,
    })] : []),
    ...spots.map(([name, value]) => svgElement('g', { class: name }, svgElement('circle', {
      class: 'spot', cx: toX(asked), cy: toY(value), r: RADIUS + 1,
    }))));
  return (clientX) => {
    const box = svg.getBoundingClientRect();
    const at = ((clientX - box.left) * (width / box.width) - MARGIN.left) / (width - MARGIN.left - MARGIN.right);
    return xRange[0] + Math.min(1, Math.max(0, at)) * (xRange[1] - xRange[0]);
  };
}
