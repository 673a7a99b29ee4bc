// One state asked of one model: values, intervals, their parts, flags in words.

import { element, scrolled, table } from './dom.js';
import { flagWords, format, interval, OUTPUTS, toNumber, withUnit } from './format.js';

// Single quotes, for a shell.
const quoted = (text) => (/^[\w@:.-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

/** The same question on the command line. */
export function commandLine(model, { slip, angleDeg, load, speed }) {
  return `./grouser query --model ${quoted(model.title)} --slip ${slip} --angle-deg ${angleDeg} --load ${load}` +
    (Number.isNaN(speed) ? '' : ` --speed ${speed}`);
}

function outputRow(output, responses) {
  const array = responses[output.key];
  const part = (name) => toNumber(array[name]?.[0]);
  const value = part('value');
  return [
    `${output.name} ${output.symbol}`,
    element('data', { value: String(value), 'data-output': output.key }, format(value)),
    output.unit,
    interval(part('low'), part('high')), interval(part('measured_low'), part('measured_high')),
    format(part('sd_fit'), 3), format(part('sd_patch'), 3), format(part('sd_form'), 3),
  ];
}

/** name: 'a' or 'b'; answer: of EvaluateWheels with this one state. */
export function answerArticle(name, model, state, answer) {
  const { responses } = answer;
  const level = Math.round(100 * toNumber(responses.interval_level));
  const flags = flagWords(responses.flags[0]);
  const [vX, vY, rim] = ['v_x_m_per_s', 'v_y_m_per_s', 'rim_speed_m_per_s'].map((field) => toNumber(responses.velocity?.[field]?.[0]));
  const head = ['output', 'value', 'unit', `${level} % interval (DEM)`, `${level} % (measured)`, 'sd_fit', 'sd_patch', 'sd_form'];
  const length = toNumber(responses.averaging_length_m);
  return element('article', {},
    element('h3', { class: name }, model.title),
    element('p', { class: 'note' }, `Hub velocity v_x ${withUnit(vX, 'm/s', 4)}, v_y ${withUnit(vY, 'm/s', 4)}; ` +
      `rim speed ${withUnit(rim, 'm/s', 4)}; load ${withUnit(state.load, 'N')}.`),
    scrolled(`Answer of ${model.title}`, table(head, OUTPUTS.map((output) => outputRow(output, responses)))),
    flags.length === 0 ? element('p', {}, 'No flags.') : element('ul', { class: 'flags', 'aria-label': 'Flags' },
      flags.map(([flag, words]) => element('li', {}, element('b', {}, flag), `: ${words}.`))),
    element('p', { class: 'note' }, 'sd_fit: surrogate against DEM; sd_patch: one random bed' +
      (length > 0 ? `, averaged over ${withUnit(length, 'm', 3)} of travel` : '') +
      '; sd_form: DEM minus measurement. All in the unit of the row. The same on the command line:'),
    element('code', { class: 'command', tabindex: '0' }, commandLine(model, state)));
}
