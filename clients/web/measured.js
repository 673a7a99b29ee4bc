// Measured wheel tests: the table that somebody chose, and how far models are from it. No page is needed here.
//
// A server tells nothing of the rows that a model was compared with (only sd_form, by region), so the table comes
// from the reader's disk. Form, and the words of what is refused: surrogate/fit/measured_read.cc, which a test compares.

import { format, isExtrapolated, OUTPUTS, possibleSlips, toNumber, toRadians } from './format.js';

const VALUE_COLUMNS = { f_x_n: 'f_x', f_y_n: 'f_y', torque_n_m: 'torque', sinkage_m: 'sinkage' };
const SD_COLUMNS = { f_x_sd: 'f_x', f_y_sd: 'f_y', torque_sd: 'torque', sinkage_sd: 'sinkage' };
const OTHER_COLUMNS = ['slip', 'attack_angle_deg', 'load_n', 'load_sd', 'rim_speed_m_per_s', 'speed_m_per_s', 'repeats'];
const NEEDED = ['slip', 'attack_angle_deg', 'load_n'];
const MOST_ROWS = 5000;  // one query
const MOST_COLUMNS = 64;
const LEAST_FORCE = 1e-3;  // of the load, in a whole table

/** Cells of a line; double quotes keep commas together. */
function cellsOf(line) {
  const cells = [''];
  let quoted = false;
  for (const c of line) {
    if (c === '"') quoted = !quoted;
    else if (c === ',' && !quoted) cells.push('');
    else if (c !== '\r') cells[cells.length - 1] += c;
  }
  if (quoted) throw new Error('a quote is not closed');
  return cells.map((cell) => cell.trim());
}

function checkHeader(header) {
  if (header.length > MOST_COLUMNS) throw new Error(`${header.length} columns, expected at most ${MOST_COLUMNS}`);
  for (const [i, name] of header.entries()) {
    if (header.indexOf(name) !== i) throw new Error(`${name}: the column stands here twice, expected each once`);
  }
  for (const name of NEEDED) {
    if (!header.includes(name)) throw new Error(`no column ${name}, expected slip,attack_angle_deg,load_n,...`);
  }
  for (const name of header) {
    const isKnown = Object.hasOwn(VALUE_COLUMNS, name) || Object.hasOwn(SD_COLUMNS, name) || OTHER_COLUMNS.includes(name);
    if (!isKnown) throw new Error(`${name}: unknown column`);
  }
}

function pointOf(header, cells, line) {
  if (cells.length !== header.length) throw new Error(`${cells.length} fields, expected ${header.length}`);
  const numbers = {};
  for (const [i, cell] of cells.entries()) {
    if (cell === '') continue;
    const value = Number(cell);
    if (!Number.isFinite(value)) throw new Error(`${header[i]}: "${cell}", expected a number`);
    numbers[header[i]] = value;
  }
  const point = { line, slip: numbers.slip ?? NaN, angleDeg: numbers.attack_angle_deg ?? NaN, load: numbers.load_n ?? NaN, value: {}, sd: {} };
  for (const [column, output] of Object.entries(VALUE_COLUMNS)) point.value[output] = numbers[column] ?? NaN;
  for (const [column, output] of Object.entries(SD_COLUMNS)) {
    if (numbers[column] < 0) throw new Error(`${column}: expected a number not below 0`);
    point.sd[output] = numbers[column] ?? NaN;
  }
  if (!(point.load > 0)) throw new Error('load_n: expected a positive load');
  const [low, high] = possibleSlips(point.angleDeg);
  if (!(Math.abs(point.angleDeg) <= 180 && point.slip >= low - 1e-12 && point.slip <= high + 1e-12)) {
    throw new Error('slip: no motion has this slip at this attack angle');
  }
  return point;
}

/** What a single row cannot tell: all of it in another unit. [line, what] or null. */
function wrongUnits(points) {
  const most = (size) => points.reduce((best, point) => (size(point) > size(best) ? point : best));
  const widest = most((point) => Math.abs(point.angleDeg));
  const degrees = Math.abs(widest.angleDeg);
  if (degrees > 0 && degrees <= Math.PI / 2) {
    return [widest.line, `attack_angle_deg: ${degrees} is the largest, expected degrees: radians?`];
  }
  const share = ({ value, load }) => Math.max(...['f_x', 'f_y'].map((key) => (Number.isNaN(value[key]) ? -1 : Math.abs(value[key]) / load)));
  const strongest = most(share);
  if (share(strongest) >= 0 && share(strongest) < LEAST_FORCE) {
    return [strongest.line, `f_x_n, f_y_n: at most ${Number(share(strongest).toPrecision(2))} of the load in every row, expected N: kN?`];
  }
  return null;
}

/**
 * The rows of a CSV: '#' comments, a header line that names slip, attack_angle_deg, load_n and any of f_x_n, f_y_n,
 * torque_n_m, sinkage_m and their ..._sd; an empty field is not measured. {name, source (its first comment), points:
 * [{line, slip [-], angleDeg, load [N], value, sd}]}, the last two by output, NaN where not measured. Throws an Error
 * "NAME:LINE: COLUMN: VALUE, expected ..."; whether values fit the wheel's size is not looked at.
 */
export function parseMeasured(text, name) {
  const lines = text.replace(/\n$/, '').split('\n');
  const points = [];
  let header = null;
  let source = '';
  for (const [i, line] of lines.entries()) {
    if (line === '' || line === '\r') continue;
    if (line[0] === '#') {
      source ||= line.replace(/^#+/, '').trim();
      continue;
    }
    try {
      const cells = cellsOf(line);
      if (header === null) checkHeader(header = cells);
      else points.push(pointOf(header, cells, i + 1));
      if (points.length > MOST_ROWS) throw new Error(`more than ${MOST_ROWS} rows`);
    } catch (error) {
      throw new Error(`${name}:${i + 1}: ${error.message}`);
    }
  }
  if (points.length === 0) throw new Error(`${name}:${lines.length}: no measured row, expected a header line and rows`);
  const wrong = wrongUnits(points);
  if (wrong !== null) throw new Error(`${name}:${wrong[0]}: ${wrong[1]}`);
  return { name, source, points };
}

/** The rows' own states, at the speed of the model's training runs. */
export function statesOfRows(points) {
  return {
    load_n: points.map((point) => point.load),
    slip: { slip: points.map((point) => point.slip), attack_angle_rad: points.map((point) => toRadians(point.angleDeg)) },
  };
}

/**
 * A model beside all rows, each at its own slip, attack angle and load: of each output that was measured the number of rows n,
 * the root mean square of model minus measurement, the mean of |measured|, and how many lie within the interval for a
 * DEM run and within that for a measurement (NaN: unknown at one of them). outside: rows outside of the training domain.
 */
export function compareWithRows(points, responses) {
  const outputs = OUTPUTS.flatMap(({ key }) => {
    const rows = points.map((point, i) => ({ i, measured: point.value[key] })).filter(({ measured, i }) =>
      Number.isFinite(measured) && Number.isFinite(toNumber(responses[key].value[i])));
    if (rows.length === 0) return [];
    const array = responses[key];
    const mean = (of) => rows.reduce((sum, row) => sum + of(row), 0) / rows.length;
    const within = (low, high) => rows.reduce((count, { i, measured }) => {
      const ends = [toNumber(array[low]?.[i]), toNumber(array[high]?.[i])];
      return ends.some(Number.isNaN) ? NaN : count + (measured >= ends[0] && measured <= ends[1]);
    }, 0);
    return [{
      key, n: rows.length,
      rms: Math.sqrt(mean(({ i, measured }) => (toNumber(array.value[i]) - measured) ** 2)),
      size: mean(({ measured }) => Math.abs(measured)),
      inDem: within('low', 'high'), inMeasured: within('measured_low', 'measured_high'),
    }];
  });
  return { outputs, outside: responses.flags.filter(isExtrapolated).length };
}

/** A row in words. */
export const rowText = (point) =>
  `slip ${format(point.slip, 3)}, ${format(point.angleDeg, 3)} deg, ${format(point.load, 4)} N`;
