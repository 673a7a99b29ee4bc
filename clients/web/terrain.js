// The page of grouser-server: models, curves, one state.

import { answerArticle } from './answer.js';
import { call, listAll } from './api.js';
import { askCurve, Curves, slipRange, statesOf } from './curves.js';
import { byId, element, latest } from './dom.js';
import { Why } from './explain.js';
import { MapView } from './map.js';
import { MeasuredTable } from './measured_view.js';
import { card, modelTable, readModel } from './models.js';
import { chosenTarget, WheelState } from './state.js';

const LIST_EVERY_MS = 5000;
const ASK_REST_MS = 60;  // while a slider moves: planners share the server
const HASH_REST_MS = 500;  // Safari throws at more than 100 addresses in 30 s (newer: 10 s)
const HASH_STATE = ['slip', 'angleDeg', 'load', 'speed'];

export class Terrain {
  /** onError gets what a call threw, or null once calls work again. */
  constructor(onError) {
    this.onError = onError;
    this.models = [];
    this.everyMs = LIST_EVERY_MS;
    this.details = new Map();  // of GetModel, by digest: models never change
    this.wheelState = new WheelState(byId('wheel-state'), () => this.ask());
    this.curves = new Curves(byId('plots'), byId('legend'), byId('plots-note'), (slip) => {
      this.wheelState.set({ slip });
      this.ask();
    });
    this.measured = new MeasuredTable(() => this.ask());
    this.problems = { refresh: null, ask: null, why: null };
    this.why = new Why(byId('why'), byId('why-answer'), (error) => this.#say('why', error));
    new MapView(byId('map'));
    this.ask = latest(() => this.#guarded('ask', () => this.#ask()), ASK_REST_MS);
    this.refresh = latest(async () => {
      await this.#guarded('refresh', () => this.#refresh());
      if (this.problems.refresh === null && this.problems.ask !== null) await this.ask();
    });
    for (const select of [byId('model-a'), byId('model-b')]) select.addEventListener('change', () => this.#choose());
    document.querySelectorAll('input[name=target]').forEach((radio) => radio.addEventListener('change', () => this.ask()));
    this.#readHash();
  }

  async #guarded(name, work) {
    try {
      await work();
      this.#say(name, null);
    } catch (error) {
      this.#say(name, error);
    }
  }

  #say(name, error) {
    this.problems[name] = error;
    this.onError(this.problems.refresh ?? this.problems.ask ?? this.problems.why);
  }

  get chosen() {
    const find = (id) => this.models.find((model) => model.title === byId(id).value);
    return [find('model-a'), find('model-b')].filter((model) => model !== undefined);
  }

  /** Reads the list of models where it is not the one that is shown. */
  async #refresh() {
    const { generation } = await call('TerrainService', 'ListModels', { page_size: 1 });
    if (generation === this.generation) return;
    const { first, entries } = await listAll('TerrainService', 'ListModels', 'models');
    const wanted = this.generation === undefined ? this.fromHash : this.chosen.map((model) => model.title);
    this.generation = first.generation;
    this.models = entries.map(readModel);
    const option = (model) => element('option', { value: model.title }, model.title);
    byId('model-a').replaceChildren(...this.models.map(option));
    byId('model-b').replaceChildren(element('option', { value: '' }, 'none'), ...this.models.map(option));
    const known = wanted.map((title) => (this.models.some((model) => model.title === title) ? title : undefined));
    if (known[0] !== undefined) byId('model-a').value = known[0];
    byId('model-b').value = known[1] ?? '';
    this.#choose(true);
  }

  #choose(keepsLoad = false) {
    const list = modelTable(this.models, this.chosen.slice(0, 1), (model) => {
      byId('model-a').value = model.title;
      this.#choose();
      byId('model-a').focus();
    });
    byId('models').replaceChildren(this.models.length > 0 ? list : element('p', {}, 'No model is served. ./grouser demo makes one.'));
    byId('of-models').hidden = this.chosen.length === 0;
    if (this.chosen.length > 0) this.wheelState.fit(this.chosen, keepsLoad);
    this.ask();
  }

  async #detailsOf(model) {
    if (!this.details.has(model.digest)) {
      this.details.set(model.digest, await call('TerrainService', 'GetModel', { model: model.reference }));
    }
    return this.details.get(model.digest);
  }

  async #ask() {
    const models = this.chosen;
    if (models.length === 0 || !this.wheelState.isComplete) return;
    const state = { ...this.wheelState.values };
    const target = chosenTarget();
    const measured = this.measured.table;
    this.#writeHash(models, state);
    const xRange = slipRange(models, state.angleDeg);
    const parts = [];
    for (const model of models) {  // one call at a time: the server has eight places for all pages
      const details = await this.#detailsOf(model);
      const answer = await call('TerrainService', 'EvaluateWheels', { model: model.reference, states: statesOf([state.slip], state) });
      const curve = await askCurve(model, state, xRange);
      const drawn = new Set(parts.flatMap((part) => part.runs.map((run) => run.sha256)));
      const runs = details.provenance.runs.filter((run) => !drawn.has(run.sha256));
      parts.push({ model, details, answer, curve, runs, rows: await this.measured.ask(model) });
    }
    if (measured !== this.measured.table) return this.#ask();  // chosen meanwhile
    this.curves.show(parts, state, target, xRange, measured);
    this.measured.show(parts);
    this.why.show(models, state);
    const articles = (make) => parts.map((part, i) => make('ab'[i], part));
    byId('answer').replaceChildren(...articles((name, part) => answerArticle(name, part.model, state, part.answer)));
    const shown = parts.map((part) => part.model.digest).join();
    if (shown === this.cardsOf) return;
    this.cardsOf = shown;
    byId('card').replaceChildren(...articles((name, part) => card(name, part.model, part.details)));
  }

  /** Models and state stand behind '#', so that a page can be kept and sent. */
  #writeHash(models, state) {
    const parts = new URLSearchParams({ model: models[0].title });
    if (models[1] !== undefined) parts.set('with', models[1].title);
    HASH_STATE.filter((name) => Number.isFinite(state[name])).forEach((name) => parts.set(name, String(state[name])));
    clearTimeout(this.hashTimer);
    this.hashTimer = setTimeout(() => {  // once the slider rests
      try {
        history.replaceState(null, '', `#${parts}`);
      } catch (error) {  // the next change writes it
        console.warn(error);
      }
    }, HASH_REST_MS);
  }

  #readHash() {
    const parts = new URLSearchParams(location.hash.slice(1));
    this.fromHash = [parts.get('model'), parts.get('with')];
    const given = HASH_STATE.filter((name) => parts.has(name) && Number.isFinite(Number(parts.get(name))));
    this.wheelState.set(Object.fromEntries(given.map((name) => [name, Number(parts.get(name))])));
  }
}
