// The server's calls as JSON (docs/operating.md), at the address that this page came from.

import { pause } from './dom.js';

let token = '';
export function setToken(text) {
  token = text.trim();
}

/** code: of gRPC, or UNREACHABLE where nothing answers. */
export class CallError extends Error {
  constructor(code, message) {
    super(message);
    this.code = code;
  }
}

const BUSY_WAIT_MS = 1000;
const BUSY_TRIES = 3;

async function send(path, options, as = token) {
  const headers = { ...options.headers };
  if (as !== '') headers.authorization = `Bearer ${as}`;
  try {
    const response = await fetch(`../${path}`, { ...options, headers, credentials: 'omit', redirect: 'error' });
    return { status: response.status, body: await response.json() };
  } catch (error) {
    if (error instanceof SyntaxError) throw new CallError('INTERNAL', `${path}: the answer is no JSON`);
    throw new CallError('UNREACHABLE', 'the server does not answer; was it stopped?');
  }
}

/** A unary call; throws CallError. A busy server is asked again. as: a token for this call alone. */
export async function call(service, method, message = {}, as = token) {
  for (let attempt = 1; ; ++attempt) {
    const { status, body } = await send(`v1alpha1/${service}/${method}`, {
      method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(message),
    }, as);
    if (status === 200) return body;
    if (status !== 429 || attempt === BUSY_TRIES) throw new CallError(body.code, body.message);
    await pause(BUSY_WAIT_MS);
  }
}

/** All entries of a list that comes in pages, and the answer of the first page. */
export async function listAll(service, method, field) {
  const first = await call(service, method, { page_size: 1000 });
  const entries = [...first[field]];
  for (let next = first.next_page_token; next;) {
    const page = await call(service, method, { page_size: 1000, page_token: next });
    entries.push(...page[field]);
    next = page.next_page_token;
  }
  return { first, entries };
}

/** {ready, reasons}; not an error where it is not ready. */
export async function readiness() {
  const { status, body } = await send('readyz', {});
  if (typeof body.ready === 'boolean') return body;
  throw new CallError(body.code, body.message || `readyz: ${status}`);
}

export async function buildInfo() {
  const { status, body } = await send('buildinfo', {});
  if (status === 200) return body;
  throw new CallError(body.code, body.message);
}
