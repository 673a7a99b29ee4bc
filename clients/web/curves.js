// Curves over slip at one load and attack angle: one query of many states for each model.

import { call } from './api.js';
import { element, svgElement } from './dom.js';
import { format, isExtrapolated, OUTPUTS, outputOf, possibleSlips, toDegrees, toNumber, toRadians } from './format.js';
import { rowText } from './measured.js';
import { drawBeside, drawPlot, drawRow } from './plot.js';

const POINTS = 81;
const SHOWN = ['f_x', 'f_y', 'torque', 'm_z', 'sinkage'];  // f_z is the load
// DEM runs of the provenance, and measured rows, that are drawn beside a curve.
const NEAR_LOAD_SHARE = 0.2;
const NEAR_ANGLE_DEG = 5;
// Ends of the interval by what it covers.
const ENDS = { dem: ['low', 'high'], measured: ['measured_low', 'measured_high'] };

/** The slips of a plot: those of the training domains, as far as a motion can have them. */
export function slipRange(models, angleDeg) {
  const [least, most] = possibleSlips(angleDeg);
  const low = Math.max(least, Math.min(...models.map((model) => model.domain.slip_min)));
  const high = Math.min(most, Math.max(...models.map((model) => model.domain.slip_max)));
  return high > low ? [low, high] : [least, most];
}

/** The SlipForm of states that differ in slip alone; speed NaN: the model's own. */
export function statesOf(slips, { angleDeg, load, speed }) {
  const all = (value) => slips.map(() => value);
  return {
    load_n: all(load),
    slip: {
      slip: slips, attack_angle_rad: all(toRadians(angleDeg)), speed_m_per_s: Number.isNaN(speed) ? [] : all(speed),
    },
  };
}

/** What a model answers over the plots' slips. */
export async function askCurve(model, state, [low, high]) {
  const slips = Array.from({ length: POINTS }, (_, i) => low + ((high - low) * i) / (POINTS - 1));
  const fields = SHOWN.flatMap((key) => ['value', ...ENDS.dem, ...ENDS.measured].map((part) => `${key}.${part}`));
  const answer = await call('TerrainService', 'EvaluateWheels', {
    model: model.reference, states: statesOf(slips, state), fields,
  });
  return { slips, responses: answer.responses };
}

const isNear = (load, angleDeg, state) => Math.abs(load - state.load) <= NEAR_LOAD_SHARE * state.load &&
  Math.abs(Math.abs(angleDeg) - Math.abs(state.angleDeg)) <= NEAR_ANGLE_DEG;

/** The runs near a load and attack angle; at an angle to the other side: mirrored. */
export const nearRuns = (runs, state) => runs.filter((run) => run.status === 'RUN_STATUS_STEADY' &&
  isNear(run.load_n, toDegrees(run.attack_angle_rad), state));

/**
 * The measured rows near a load and attack angle of which this output was measured, mirrored to the state's side where
 * they are of the other: [{line, x, value, sd, title, beside: what each answer says at the row's own state}].
 */
export function nearRows(points, answers, key, state) {
  const { unit, mirrored } = outputOf(key);
  return points.map((point, i) => ({ point, i })).filter(({ point }) =>
    Number.isFinite(point.value[key]) && isNear(point.load, point.angleDeg, state)).map(({ point, i }) => {
    const sign = mirrored && point.angleDeg * state.angleDeg < 0 ? -1 : 1;
    return {
      line: point.line, x: point.slip, value: sign * point.value[key], sd: point.sd[key],
      beside: answers.map((answer) => sign * toNumber(answer[key].value[i])),
      title: `measured at ${rowText(point)}: ${format(point.value[key], 4)} ${unit}` +
        (Number.isNaN(point.sd[key]) ? '' : `, sd ${format(point.sd[key], 2)}`),
    };
  });
}

function seriesOf(key, name, curve, runs, state, target) {
  const output = curve.responses[key];
  const numbers = (part) => curve.slips.map((_, i) => toNumber(output[part][i]));
  const [low, high] = ENDS[target].map(numbers);
  const sign = state.angleDeg < 0 && outputOf(key).mirrored ? -1 : 1;
  const index = OUTPUTS.findIndex((one) => one.key === key);
  return {
    name, x: curve.slips, value: numbers('value'), low, high, outside: curve.responses.flags.map(isExtrapolated),
    runs: nearRuns(runs, state).map((run) => ({ x: run.slip, value: sign * toNumber(run.mean[index]) })),
  };
}

/** What the plot shows, for those who do not see it. */
function describe(output, models, series) {
  const texts = series.map((s, i) => {
    const known = s.x.map((x, k) => [x, s.value[k]]).filter(([, value]) => Number.isFinite(value));
    if (known.length === 0) return `${models[i].title}: no answer`;
    const [[x0, y0], [x1, y1]] = [known[0], known.at(-1)];
    return `${models[i].title}: ${format(y0, 3)} ${output.unit} at slip ${format(x0, 3)}, ` +
      `${format(y1, 3)} ${output.unit} at slip ${format(x1, 3)}`;
  });
  return `${output.name} over slip. ${texts.join('; ')}`;
}

/** Five plots; `onSlip` gets the slip where one is pressed. */
export class Curves {
  constructor(place, legend, note, onSlip) {
    this.legend = legend;
    this.note = note;
    this.plots = SHOWN.map((key) => {
      const output = outputOf(key);
      const svg = svgElement('svg', { id: `plot-${key}` });
      place.append(element('figure', {},
        element('figcaption', {}, `${output.name} ${output.symbol} [${output.unit}]`), svg));
      const plot = { key, output, svg, toSlip: null };
      const choose = (event) => {
        if (plot.toSlip !== null && event.buttons === 1) onSlip(Number(plot.toSlip(event.clientX).toFixed(2)));
      };
      svg.addEventListener('pointerdown', choose);
      svg.addEventListener('pointermove', choose);
      return plot;
    });
    new ResizeObserver(() => {
      if (place.clientWidth !== this.width) this.redraw();
    }).observe(place);
    this.place = place;
  }

  /** parts: [{model, curve, runs, rows: responses at the measured rows}], one or two; measured: of parseMeasured, or null. */
  show(parts, state, target, xRange, measured) {
    this.shown = { parts, state, target, xRange, measured };
    this.redraw();
  }

  redraw() {
    if (this.shown === undefined) return;
    const { parts, state, target, xRange, measured } = this.shown;
    this.width = this.place.clientWidth;
    let bands = 0;
    let dots = 0;
    const drawn = new Set();  // lines of the table
    for (const plot of this.plots) {
      const series = parts.map(({ curve, runs }, i) => seriesOf(plot.key, 'ab'[i], curve, runs, state, target));
      bands += series.filter((s) => s.low.some(Number.isFinite)).length;
      dots += series.reduce((sum, s) => sum + s.runs.length, 0);
      const rows = measured === null ? [] : nearRows(measured.points, parts.map((part) => part.rows), plot.key, state);
      rows.forEach((row) => drawn.add(row.line));
      plot.toSlip = drawPlot(plot.svg, {
        series, rows, xRange, xLabel: 'slip [-]', asked: state.slip,
        label: describe(plot.output, parts.map((part) => part.model), series) + (rows.length > 0 ? `; ${rows.length} measured rows` : ''),
      });
    }
    this.describeAll(parts, bands > 0, dots > 0, measured, drawn.size);
  }

  describeAll(parts, hasBands, hasRuns, measured, rows) {
    const key = (text, name, ...marks) => element('span', {},
      svgElement('svg', { viewBox: '0 0 28 14', 'aria-hidden': 'true', class: name }, marks), text);
    const line = (kind) => svgElement('path', { class: kind, d: 'M1 7H27' });
    const { responses } = parts[0].curve;
    const near = `load within ${100 * NEAR_LOAD_SHARE} %, attack angle within ${NEAR_ANGLE_DEG} deg`;
    const level = Math.round(100 * toNumber(responses.interval_level));
    this.legend.replaceChildren(
      ...parts.map(({ model }, i) => key(model.title, 'ab'[i], line('curve'))),
      ...(hasBands ? [key(`${level} % interval`, 'a', svgElement('path', { class: 'band', d: 'M1 2H27V12H1Z' }))] : []),
      key('outside of the training domain', 'a', line('curve outside')),
      ...(hasRuns ? [key(`DEM run: ${near}`, 'a', svgElement('circle', { class: 'run', cx: 14, cy: 7, r: 3 }))] : []),
      ...(rows > 0 ? [key(`measured: ${near}; bar: sd`, '', drawRow({ x: 14, value: 7, sd: NaN }, (x) => x, (y) => y)),
        ...parts.map((_, i) => key('the model at the measured row’s own load and angle', 'ab'[i], drawBeside(14, 7)))] : []));
    this.note.textContent = (hasBands ? '' : 'The interval that covers a measurement is unknown here. ') +
      (measured === null ? '' : `${rows} of ${measured.points.length} measured rows are drawn, the others have another load or angle. ` +
        (rows > 0 ? 'Each has a load of its own: compare a diamond with its cross, not with the curve. ' : '')) +
      'Press a plot, or move the slip, to ask another state.';
  }
}
