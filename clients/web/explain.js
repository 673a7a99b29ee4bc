// Why a model answers a state as it does (TerrainService.Explain), while its section is open.

import { commandLine } from './answer.js';
import { call } from './api.js';
import { statesOf } from './curves.js';
import { element, scrolled, svgElement, table } from './dom.js';
import { allRuns, isCovered, PARTS, stressText, varianceShares } from './explain_parts.js';
import {
  AXES, enumWord, format, interval, KINDS_OF_RUNS, OUTPUTS, outputOf, percent, range, shortDigest, toDegrees, toNumber, withUnit,
} from './format.js';
import { stressFigures } from './stress.js';

const REST_MS = 300;  // a slider that moves is not explained
const RUN_OUTPUTS = OUTPUTS.filter(({ key }) => key !== 'f_z');  // f_z is the load

function reasonsList({ reasons }) {
  if (reasons.length === 0) return element('p', {}, 'No flags.');
  return element('ul', { class: 'flags', 'aria-label': 'Reasons of the flags' }, reasons.map(({ flag, text }) =>
    element('li', {}, element('b', {}, String(flag).replace('STATE_FLAG_', '')), `: ${text}`)));
}

/** A bar of the three parts, as wide as the whole variance. */
function sharesBar(shares) {
  let left = 0;
  return svgElement('svg', { class: 'shares', viewBox: '0 0 100 10', preserveAspectRatio: 'none', 'aria-hidden': 'true' },
    shares.map((share, i) => {
      const bar = svgElement('rect', { class: `part-${PARTS[i].name}`, x: 100 * left, y: 0, width: 100 * share, height: 10 });
      left += share;
      return bar;
    }));
}

function partsTable(explanation) {
  const level = percent(toNumber(explanation.interval_level));
  const rows = explanation.outputs.map((output) => {
    const number = (key, digits = 3) => format(toNumber(output[key]), digits);
    const shares = varianceShares(output);
    return [
      `${outputOf(output.output)?.name ?? output.output} [${output.unit}]`,
      element('data', { value: String(toNumber(output.value)), 'data-explained': output.output }, number('value', 5)),
      interval(toNumber(output.low), toNumber(output.high)),
      ...PARTS.map(({ key }, i) => `${number(key)}${shares === null ? '' : ` (${percent(shares[i])})`}`),
      shares === null ? '–' : sharesBar(shares), `× ${number('interval_factor')}`, number('bulldozing_growth'),
      `${number('sd_form')}${Number.isNaN(toNumber(output.form_factor)) ? '' : ` × ${number('form_factor')}`}`,
      interval(toNumber(output.measured_low), toNumber(output.measured_high)),
    ];
  });
  return table(['output', 'value', `${level} interval (DEM)`, 'sd_fit near runs', 'sd_fit grown', 'sd_patch', 'shares', 'factor', 'bulldozing',
    'sd_form', `${level} (measured)`], rows);
}

function domainTable({ axes }) {
  return table(['axis', 'state', 'training runs', 'outside by', 'adds to hull distance'], axes.map((axis) => {
    const [name, unit, factor] = AXES[axis.quantity] ?? [axis.quantity, '', 1];
    const at = (key) => factor * toNumber(axis[key]);
    return [`${name} [${unit}]`, format(at('value'), 4), range(at('low'), at('high')), at('beyond') === 0 ? 'inside' : format(at('beyond'), 3),
      format(toNumber(axis.hull_distance), 3)];
  }));
}

function placeText(explanation) {
  const { measured_region: region } = explanation;
  const number = (key) => format(toNumber(explanation[key]), 3);
  return `Hull distance ${number('hull_distance')} (0 at runs, 1 far from them; by the model’s table ${number('table_distance')}); ` +
    `share of the motion that bulldozes: ${number('bulldozing')}; region of measurements: ` +
    `${region === 'MEASURED_REGION_UNSPECIFIED' ? 'none' : enumWord('MEASURED_REGION_', region)}.`;
}

function runRow({ kind, near }) {
  const { run } = near;
  const outputs = RUN_OUTPUTS.map(({ key }) => {
    const index = OUTPUTS.findIndex((one) => one.key === key);
    const covered = isCovered(near, index);
    if (covered === null) return '–';
    return element('span', { class: covered ? null : 'failed' },
      `${format(toNumber(near.mean[index]), 3)} | ${format(toNumber(near.model_value[index]), 3)}${covered ? '' : ' *'}`);
  });
  return [
    format(toNumber(near.distance), 3), KINDS_OF_RUNS[kind].replace(/:.*/, ''),
    element('code', { title: `run ${run.run_id}, sha256 ${run.sha256}` }, shortDigest(run.sha256) || run.run_id || '?'),
    enumWord('RUN_STATUS_', run.status), format(toNumber(run.slip), 3), format(toDegrees(toNumber(run.attack_angle_rad)), 3),
    format(toNumber(run.load_n), 4), ...outputs, near.mirrored_x || near.mirrored_y ? 'mirrored' : '',
    near.stress ? stressText(near.stress) : near.no_stress || '–',
  ];
}

function runsPart(explanation) {
  const counts = ['fitted', 'repeats', 'held_out', 'of_no_use'].map((name) => `${explanation[`runs_${name}`]} ${name.replaceAll('_', ' ')}`);
  const runs = allRuns(explanation);
  const head = ['distance', 'kind', 'sha256', 'status', 'slip', 'deg', 'load [N]',
    ...RUN_OUTPUTS.map(({ symbol, unit }) => `${symbol} [${unit}] DEM | model`), 'side', 'rim'];
  return [
    element('p', { class: 'note' }, `DEM runs of this model: ${counts.join(', ')}. Distance 1: 0.3 on the unit sphere of (v_x, v_y, r w), or a ` +
      'factor of 1.5 in load. *: DEM outside of the model’s interval at the run’s own state.'),
    runs.length === 0 ? element('p', {}, 'No run stands beside this state.') :
      scrolled('Nearest runs', table(head, runs.map(runRow), { class: 'runs' })),
  ];
}

/** name: 'a' or 'b'; state: that was asked; explanation: of ExplainResponse. */
export function explainArticle(name, model, state, explanation) {
  const number = (key, unit) => withUnit(toNumber(explanation[key]), unit, 4);
  const head = (text) => element('h4', {}, text);
  const figures = stressFigures(explanation);
  return element('article', {},
    element('h3', { class: name }, model.title),
    element('p', { class: 'note' }, `Slip ${format(toNumber(explanation.slip), 4)}, attack angle ` +
      `${format(toDegrees(toNumber(explanation.attack_angle_rad)), 4)} deg, load ${number('load_n', 'N')}, speed ${number('speed_m_per_s', 'm/s')}; ` +
      `${enumWord('MODEL_KIND_', explanation.kind)} model of wheel ${explanation.wheel} on ${explanation.soil}.`),
    head('Flags: what is beyond what'), reasonsList(explanation),
    head('Parts of the interval'), scrolled(`Parts of the interval of ${model.title}`, partsTable(explanation)),
    element('p', { class: 'note legend' }, PARTS.map(({ name: part, words }) => element('span', {},
      svgElement('svg', { viewBox: '0 0 28 14', 'aria-hidden': 'true' },
        svgElement('rect', { class: `part-${part}`, x: 1, y: 2, width: 26, height: 10 })), words)),
    'In %: of the variance of the interval for DEM.'),
    ...(explanation.axes.length === 0 ? [] : [head('Where the state lies'), scrolled(`Axes of ${model.title}`, domainTable(explanation)),
      element('p', { class: 'note' }, placeText(explanation))]),
    head('Nearest runs'), ...runsPart(explanation),
    head('Stresses on the rim'), figures ?? element('p', {}, 'None in this model file.'),
    ...explanation.notes.map((note) => element('p', { class: 'note' }, `${note}.`)),
    element('p', { class: 'note' }, 'The same on the command line, and with --plot FILE as one picture:'),
    element('code', { class: 'command', tabindex: '0' }, `${commandLine(model, state)} --explain`));
}

/** The section; it asks once the state rests, and only while it is open. onError: as Terrain's. */
export class Why {
  constructor(details, place, onError) {
    Object.assign(this, { details, place, onError });
    details.addEventListener('toggle', () => {
      if (!details.open) onError(null);
      this.#start(0);
    });
  }

  show(models, state) {
    this.asked = { models, state };
    this.#start(REST_MS);
  }

  #start(restMs) {
    clearTimeout(this.timer);
    if (!this.details.open || this.asked === undefined) return;
    this.timer = setTimeout(() => this.#ask(this.asked), restMs);
  }

  async #ask(asked) {
    if (this.shown === asked) return;
    try {
      const articles = [];
      for (const [i, model] of asked.models.entries()) {  // one call at a time, as Terrain
        const { explanation } = await call('TerrainService', 'Explain', { model: model.reference, state: statesOf([asked.state.slip], asked.state) });
        articles.push(explainArticle('ab'[i], model, asked.state, explanation));
      }
      if (asked !== this.asked) return;  // another state meanwhile
      this.shown = asked;
      this.place.replaceChildren(...articles);
      this.onError(null);
    } catch (error) {
      this.onError(error);
    }
  }
}
