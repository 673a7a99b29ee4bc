// The wheel state that is asked: a number and a slider for each part.

import { element } from './dom.js';
import { format, range, toDegrees } from './format.js';
import { ticks } from './plot.js';

const PARTS = [
  { name: 'slip', label: 'Slip [-]', step: 0.01 },
  { name: 'angleDeg', label: 'Attack angle [deg]', step: 1 },
  { name: 'load', label: 'Load [N]', least: 0 },
  { name: 'speed', label: 'Speed [m/s]', least: 0, optional: true },
];

/** A load in the middle of the training domain, with two digits. */
const middleLoad = ({ load_min_n: low, load_max_n: high }) => Number(Math.sqrt(low * high).toPrecision(2));

export class WheelState {
  /** onChange is called after each change by hand. */
  constructor(place, onChange) {
    this.onChange = onChange;
    this.values = { slip: 0.2, angleDeg: 0, load: NaN, speed: NaN };
    this.rows = Object.fromEntries(PARTS.map((part) => [part.name, this.#addRow(place, part)]));
  }

  #addRow(place, part) {
    const id = `state-${part.name}`;
    const change = (text) => this.#take(part, text);
    const number = element('input', {
      id, type: 'number', step: 'any', inputmode: 'decimal', 'aria-describedby': `${id}-note`,
      placeholder: part.optional ? 'model’s' : null, input: (event) => change(event.target.value),
    });
    const slider = part.optional ? null : element('input', {
      type: 'range', step: part.step ?? 'any', 'aria-label': `${part.label}, slider`, input: (event) => change(event.target.value),
    });
    const note = element('p', { class: 'note', id: `${id}-note` });
    place.append(element('div', { class: 'control' }, element('label', { for: id }, part.label), number, slider, note));
    return { part, number, slider, note };
  }

  #take(part, text) {
    const value = text.trim() === '' ? NaN : Number(text);
    this.values[part.name] = value;
    this.#show(part.name, document.activeElement === this.rows[part.name].number);
    this.onChange();
  }

  #show(name, isTyping) {
    const { part, number, slider } = this.rows[name];
    const value = this.values[name];
    if (!isTyping) number.value = Number.isNaN(value) ? '' : String(value);
    if (slider !== null && Number.isFinite(value)) slider.value = String(value);
    number.setAttribute('aria-invalid', String(number.validity.badInput || (Number.isNaN(value) && !part.optional)));
  }

  set(values) {
    Object.assign(this.values, values);
    PARTS.forEach(({ name }) => this.#show(name, false));
  }

  /** Whether there is something to ask: no number is missing. */
  get isComplete() {
    return PARTS.every(({ name, optional }) => optional || Number.isFinite(this.values[name])) &&
      !this.rows.speed.number.validity.badInput;
  }

  /**
   * Sliders go over the training domains and somewhat beyond; numbers may go anywhere. keepsLoad: also a load
   * that is far from these models.
   */
  fit(models, keepsLoad) {
    const most = (field) => Math.max(...models.map((model) => model.domain[field]));
    const least = (field) => Math.min(...models.map((model) => model.domain[field]));
    const bound = (name, low, high, step) => {
      const { slider } = this.rows[name];
      Object.assign(slider, { min: String(low), max: String(high), step: String(step) });
    };
    bound('slip', Math.min(-1, least('slip_min')), Math.max(1, most('slip_max')), 0.01);
    bound('angleDeg', -90, 90, 1);
    const top = 1.25 * most('load_max_n');
    const [zero, first] = ticks(0, top, 250);
    bound('load', zero, top, first - zero);
    const isFar = this.values.load > top || this.values.load < least('load_min_n') / 2;
    if (Number.isNaN(this.values.load) || (isFar && !keepsLoad)) this.values.load = middleLoad(models[0].domain);
    const widest = toDegrees(most('attack_angle_max_rad'));
    const trained = (text) => `trained: ${text}`;
    this.rows.slip.note.textContent = trained(range(least('slip_min'), most('slip_max'), 3));
    this.rows.angleDeg.note.textContent = trained(`${range(-widest, widest, 3)} deg`);
    this.rows.load.note.textContent = trained(`${range(least('load_min_n'), most('load_max_n'), 3)} N`);
    this.rows.speed.note.textContent = 'the larger of rim speed and hub speed; empty: that of the training runs, ' +
      `${[...new Set(models.map((model) => format(model.domain.speed_m_per_s, 3)))].join(' and ')} m/s`;
    PARTS.forEach(({ name }) => this.#show(name, document.activeElement === this.rows[name].number));
  }
}

/** Which interval is chosen: 'dem' or 'measured'. */
export const chosenTarget = () => document.querySelector('input[name=target]:checked').value;
