// The list of models, and what a model says of itself.

import { element, scrolled, table } from './dom.js';
import {
  enumWord, ERROR_SETS, format, outputOf, percent, range, REGIONS, shortDigest, toDegrees, toNumber, withUnit,
} from './format.js';

/** Of ListModels, with how a query names it and how people read it. */
export function readModel(info) {
  const domain = Object.fromEntries(Object.entries(info.domain).map(([name, value]) => [name, toNumber(value)]));
  const alias = info.aliases.includes('stable') ? 'stable' : info.aliases[0];
  const title = alias === undefined ? `${info.name}@sha256:${shortDigest(info.digest)}` : `${info.name}@${alias}`;
  return { ...info, domain, title, reference: `${info.name}@sha256:${info.digest}` };
}

const angleText = (domain) => `to ${format(toDegrees(domain.attack_angle_max_rad), 3)} deg`;

export function modelTable(models, chosen, onChoose) {
  return table(
    ['model', 'wheel: radius × width [m]', 'soil', 'slip [-]', '|attack angle| [deg]', 'load [N]', 'DEM runs'],
    models.map((model) => [
      element('button', { type: 'button', class: 'name', 'aria-pressed': String(chosen.includes(model)), click: () => onChoose(model) },
        model.title),
      `${format(model.radius_m, 4)} × ${format(model.width_m, 4)}`, model.soil,
      range(model.domain.slip_min, model.domain.slip_max, 3), angleText(model.domain).slice(3, -4),
      range(model.domain.load_min_n, model.domain.load_max_n, 3), String(model.runs),
    ]));
}

function facts(model, { provenance }) {
  const { domain } = model;
  const rows = [
    ['wheel', `radius ${withUnit(model.radius_m, 'm', 4)}, width ${withUnit(model.width_m, 'm', 4)}`],
    ['soil', model.soil],
    ['training domain', `slip ${range(domain.slip_min, domain.slip_max, 3)}, |attack angle| ${angleText(domain)}, ` +
      `load ${range(domain.load_min_n, domain.load_max_n, 3)} N`],
    ['speed', `${withUnit(domain.speed_m_per_s, 'm/s', 3)} of the training runs` +
      (domain.froude_max > 0 ? `; holds to a Froude number of ${format(domain.froude_max, 3)}` : '')],
    domain.load_overload_n > 0 ? ['overload', `the lightest run that sank too deep had ${withUnit(domain.load_overload_n, 'N', 3)}`] : null,
    ['aliases', (model.aliases.join(', ') || 'none') + (model.shipped ? '; shipped' : '')],
    ['trained with', `${model.runs} DEM runs${provenance.reason ? `; ${provenance.reason}` : ''}`],
    ['made by', element('code', {}, provenance.command || 'unknown'),
      provenance.grouser_version ? ` (grouser ${provenance.grouser_version})` : ''],
    ['digest', element('code', {}, model.digest)],
  ];
  return table([], rows.filter((row) => row !== null).map(([name, ...text]) => [name, element('span', {}, text)]),
    { class: 'facts' });
}

function errorTable(errors) {
  const rows = errors.map((row) => {
    const unit = outputOf(row.output)?.unit ?? '';
    return [outputOf(row.output)?.name ?? row.output, (REGIONS[row.region] ?? enumWord('REGION_', row.region)).replace(/ \(.*/, ''),
      String(row.n), withUnit(toNumber(row.rmse), unit, 3), withUnit(toNumber(row.max_abs), unit, 3),
      percent(toNumber(row.covered90))];
  });
  return table(['output', 'region', 'n', 'rms error', 'largest', 'in 90 % interval'], rows);
}

/** One table for each set of states that errors were measured on, the hardest first: it is open. */
function errorTables(model, errors) {
  const known = Object.keys(ERROR_SETS);
  const place = (set) => (known.includes(set) ? known.indexOf(set) : known.length);
  const sets = [...new Set(errors.map((row) => row.set))].sort((a, b) => place(a) - place(b));
  if (sets.length === 0) return [element('p', {}, 'This model has no error table.')];
  return sets.map((set, i) => element('details', { open: i === 0 },
    element('summary', {}, `Errors against DEM, ${ERROR_SETS[set] ?? set}`),
    scrolled(`Errors of ${model.title}`, errorTable(errors.filter((row) => row.set === set)))));
}

/** name: 'a' or 'b'; details: of GetModel. */
export function card(name, model, details) {
  return element('article', {},
    element('h3', { class: name }, model.title),
    element('div', { class: 'pair' }, facts(model, details),
      element('div', {}, ...errorTables(model, details.errors),
        element('p', { class: 'note' }, `Regions: ${Object.values(REGIONS).slice(1).join(', ')}.`))));
}

