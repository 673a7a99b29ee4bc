// What program this is, whether it is ready, and whether this page may ask it.

import { buildInfo, readiness, setToken } from './api.js';
import { byId, element, latest } from './dom.js';
import { Jobs } from './jobs.js';
import { Terrain } from './terrain.js';

const PARTS = {
  'grouser-server': { place: 'terrain', make: (onError) => new Terrain(onError) },
  'grouser-jobs': { place: 'jobs', make: (onError) => new Jobs(onError) },
};

// What to do, by the code of gRPC.
const ADVICE = {
  UNAUTHENTICATED: 'Who asks has to be known: give a token of the rights file with the role read. HTTP knows no certificates ' +
    '(docs/security.md).',
  PERMISSION_DENIED: 'Who may call what: docs/security.md.',
  RESOURCE_EXHAUSTED: 'The server is busy; change something to ask again.',
  UNREACHABLE: 'It is asked again until it answers.',
};

const REFUSED = ['UNAUTHENTICATED', 'PERMISSION_DENIED'];

const FIRST_WAIT_MS = 5000;
const LONGEST_WAIT_MS = 20000;  // where nothing answers

let part = null;  // has everyMs: how often it wants to be refreshed
let waitMs = FIRST_WAIT_MS;
let isLost = false;  // nothing answers
let isRefused = false;  // asked again with another token alone
let hasNewToken = false;

function showProblem(error) {
  const place = byId('problem');
  place.hidden = error === null;
  if (error === null) return;
  const code = error.code ?? 'ERROR';
  if (error.code === undefined) console.error(error);
  isRefused = REFUSED.includes(code);
  if (code === 'UNAUTHENTICATED') byId('access').hidden = false;
  const text = `${code}: ${error.message}`;
  if (place.dataset.text === text && place.childNodes.length > 0) return;  // said once
  place.dataset.text = text;
  place.replaceChildren(element('p', {}, element('b', {}, code), `: ${error.message}`),
    ...(ADVICE[code] ? [element('p', {}, ADVICE[code])] : []));
}

function showState(program, { ready, reasons }) {
  const more = part?.generation !== undefined ? `; generation ${part.generation}, ${part.models.length} model${part.models.length === 1 ? '' : 's'}` : '';
  const content = [`${program}: `, element('span', { class: ready ? 'ready' : 'not-ready' }, ready ? 'ready' : 'not ready'),
    ready ? more : ` (${reasons.join('; ')})`];
  const text = content.map((piece) => piece.textContent ?? piece).join('');
  if (byId('state').textContent !== text) byId('state').replaceChildren(...content);
}

async function open() {
  const build = await buildInfo();
  const { place, make } = PARTS[build.program];
  part = make(showProblem);
  part.program = build.program;
  byId(place).hidden = false;
  byId('access').hidden = true;
  document.title = build.program;
  byId('build').textContent = `${build.program} ${build.version}, commit ${build.commit}.`;
}

// Once at a time: a token may come while it is asked with another.
const look = latest(async () => {
  try {
    const told = await readiness();
    isLost = false;
    showState(part?.program ?? 'This program', told);
    if (hasNewToken) {
      hasNewToken = isRefused = false;
      byId('access').hidden = true;
    }
    if (isRefused) return;
    if (part === null) await open();
    await part.refresh();
    showState(part.program, told);
  } catch (error) {
    isLost = error.code === 'UNREACHABLE';
    if (isLost) showState(part?.program ?? 'This program', { ready: false, reasons: ['no answer'] });
    showProblem(error);
  }
});

byId('access').addEventListener('submit', (event) => {
  event.preventDefault();
  setToken(byId('token').value);
  byId('token').value = '';
  byId('access').hidden = true;
  hasNewToken = true;
  look();
});

let timer;
async function watch() {
  clearTimeout(timer);
  if (document.visibilityState !== 'visible') return;  // nobody looks: nothing is asked
  await look();
  waitMs = isLost ? Math.min(2 * waitMs, LONGEST_WAIT_MS) : part?.everyMs ?? FIRST_WAIT_MS;
  clearTimeout(timer);
  timer = setTimeout(watch, waitMs);
}
document.addEventListener('visibilitychange', watch);
watch();
