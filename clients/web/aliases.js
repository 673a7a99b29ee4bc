// Where aliases point, by their recorded moves; rollback, and canary to stable.

import { call } from './api.js';
import { decide } from './decide.js';
import { byId, element, scrolled, table } from './dom.js';
import { moment, shortDigest } from './format.js';

const MOST_MOVES = 200;
const BY_THEMSELVES = ['candidate', 'previous'];  // nobody moves these
const ORDER = ['stable', 'canary'];

/** The latest move of each alias: by model, stable and canary first, and what moves by itself left out. */
export function latestMoves(moves) {
  const latest = new Map();
  for (const move of moves) {  // newest first
    const key = `${move.model}@${move.alias}`;
    if (!BY_THEMSELVES.includes(move.alias) && !latest.has(key)) latest.set(key, move);
  }
  const place = ({ alias }) => (ORDER.includes(alias) ? ORDER.indexOf(alias) : ORDER.length);
  return [...latest.values()].sort((a, b) =>
    a.model.localeCompare(b.model) || place(a) - place(b) || a.alias.localeCompare(b.alias));
}

/** What the list leaves out, in words; '' where it has every move. */
export const olderText = ({ moves, next_page_token: more }) => (more ? `By the latest ${moves.length} moves: an alias whose last move ` +
  'is older is not shown here; all: ./grouser jobs history.' : '');

/** What is asked before `move`, the latest of its alias, is undone; the call names the digest that the question does. */
export function rollbackQuestion(move) {
  const name = `${move.model}@${move.alias}`;
  const to = move.rollback ? '' : move.from_digest;  // after a rollback only the server knows what was before
  return {
    title: `Roll ${name} back`,
    text: `It is ${shortDigest(move.to_digest)} now, and will be what it named before${to === '' ? '' : `, ${shortDigest(to)}`}. ` +
      'Query servers of this state folder follow at once.',
    method: 'RollbackAlias', message: { model: name, to },
  };
}

/** What is asked before stable becomes what this alias names. */
export function stableQuestion(move) {
  return {
    title: `Make ${move.model}@${move.alias} stable`,
    text: `${move.model}@stable will be ${shortDigest(move.to_digest)}. Query servers of this state folder follow at once.`,
    method: 'MoveAlias', message: { model: `${move.model}@sha256:${move.to_digest}`, alias: 'stable' },
  };
}

const code = (digest) => element('code', { title: digest }, digest === '' ? 'none' : shortDigest(digest));

function movesTable(moves) {
  return scrolled('Latest moves of aliases', table(['alias', 'generation', 'when', 'from', 'to', 'by', 'why'], moves.map((move) => [
    `${move.model}@${move.alias}`, String(move.generation), moment(move.time), code(move.from_digest),
    element('span', {}, code(move.to_digest), move.rollback ? ' back' : ''), move.who, move.why]), { class: 'words' }));
}

export class Aliases {
  /** changed: called after a move that was made here. */
  constructor(changed) {
    this.changed = changed;
  }

  async refresh() {
    const answer = await call('JobsService', 'ListAliasMoves', { page_size: MOST_MOVES });
    const text = JSON.stringify(answer);
    if (text === this.text) return;  // a button that has the focus stays
    this.text = text;
    const latest = latestMoves(answer.moves);
    const older = olderText(answer);
    byId('aliases').replaceChildren(...(latest.length === 0 ? [element('p', {}, 'No move is recorded: every name means its shipped model.')] :
      latest.map((move) => this.#article(move, latest))), ...(older === '' ? [] : [element('p', { class: 'note' }, older)]));
    byId('moves').replaceChildren(movesTable(answer.moves), ...(older === '' ? [] :
      [element('p', { class: 'note' }, `The latest ${answer.moves.length}; all: ./grouser jobs history.`)]));
  }

  #article(move, latest) {
    const name = `${move.model}@${move.alias}`;
    const stable = latest.find((one) => one.model === move.model && one.alias === 'stable');
    const back = element('button', { type: 'button', 'data-rollback': name, click: () => this.#ask(rollbackQuestion(move)) }, 'Roll back ...');
    const up = move.alias === 'canary' && stable?.to_digest !== move.to_digest ?
      element('button', { type: 'button', 'data-stable': name, click: () => this.#ask(stableQuestion(move)) }, 'Make it stable ...') : null;
    return element('article', { class: 'job' },
      element('h3', {}, `${name} `, code(move.to_digest)),
      table([], [[move.rollback ? 'rolled back' : 'since', `${moment(move.time)}, by ${move.who}`], ['why', move.why]], { class: 'facts' }),
      element('p', {}, ...(up === null ? [] : [up, ' ']), back));
  }

  #ask(question) {
    decide({ ...question, done: this.changed });
  }
}
