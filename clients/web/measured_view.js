// The measured table that the reader chooses from his disk, and models beside it.

import { call } from './api.js';
import { byId, element, scrolled, table } from './dom.js';
import { format, outputOf, percent, toNumber, withUnit } from './format.js';
import { compareWithRows, parseMeasured, statesOfRows } from './measured.js';

const MOST_BYTES = 4e6;

export class MeasuredTable {
  /** onChange is called when another table is shown, or none. */
  constructor(onChange) {
    this.onChange = onChange;
    this.table = null;  // of parseMeasured
    this.answers = new Map();  // of EvaluateWheels at the rows, by the model's digest
    byId('measured-file').addEventListener('change', (event) => this.#read(event.target.files[0]));
    byId('measured-file').addEventListener('click', (event) => { event.target.value = ''; });  // the same may be chosen, once it is mended
    byId('measured-clear').addEventListener('click', () => {
      byId('measured-file').value = '';
      this.#set(null, '');
    });
  }

  async #read(file) {
    if (file === undefined) return;
    try {
      if (file.size > MOST_BYTES) throw new Error(`${file.name}: ${file.size} bytes, expected a table of at most ${MOST_BYTES}`);
      const read = parseMeasured(await file.text(), file.name);
      this.#set(read, `${file.name}: ${read.points.length} rows${read.source === '' ? '' : `. ${read.source}`}`);
    } catch (error) {  // what was shown before stays
      this.#say(`${error.message}${this.table === null ? '' : `. Still shown: ${this.table.name}.`}`, true);
    }
  }

  #set(read, text) {
    this.table = read;
    this.answers.clear();
    byId('measured-clear').hidden = read === null;
    if (read === null) byId('measured-errors').replaceChildren();
    this.#say(text, false);
    this.onChange();
  }

  #say(text, isError) {
    byId('measured-note').textContent = text;
    byId('measured-note').className = isError ? 'note failed' : 'note';
  }

  /** What a model answers at the rows; null without a table. */
  async ask(model) {
    const shown = this.table;
    if (shown === null) return null;
    if (!this.answers.has(model.digest)) {
      const { responses } = await call('TerrainService', 'EvaluateWheels', { model: model.reference, states: statesOfRows(shown.points) });
      if (shown !== this.table) return this.ask(model);
      this.answers.set(model.digest, responses);
    }
    return this.answers.get(model.digest);
  }

  /** parts: as Curves.show's. */
  show(parts) {
    if (this.table === null) return;
    byId('measured-errors').replaceChildren(...parts.map(({ model, rows }, i) => this.#article('ab'[i], model, rows)));
  }

  #article(name, model, responses) {
    const { points } = this.table;
    const { outputs, outside } = compareWithRows(points, responses);
    const level = percent(toNumber(responses.interval_level));
    const share = (count, n) => (Number.isNaN(count) ? 'unknown' : `${count} of ${n}`);
    const rows = outputs.map((one) => {
      const { name: output, unit } = outputOf(one.key);
      return [output, String(one.n), element('data', { value: String(one.rms), 'data-rms': one.key }, withUnit(one.rms, unit, 4)),
        withUnit(one.size, unit, 3), share(one.inDem, one.n), share(one.inMeasured, one.n)];
    });
    const head = ['output', 'rows', 'rms of model − measured', 'mean |measured|', `within ${level} (DEM)`, `within ${level} (measured)`];
    return element('article', {},
      element('h3', { class: name }, `${model.title} beside ${this.table.name}`),
      scrolled(`${model.title} beside measured rows`, table(head, rows, { class: 'wrap' })),
      element('p', { class: 'note' }, 'Over all rows, each at its own slip, attack angle and load, at the ' +
        `${format(model.domain.speed_m_per_s, 3)} m/s of the training runs: ${outside} of ${points.length} lie outside of the ` +
        'training domain. Whether the table is of this wheel ' +
        'and soil, and which of its rows the model was fitted to, the page does not know. ' +
        'With regions: ./grouser model compare MODEL_FILE --measured TABLE.'));
  }
}
