// A question before an alias moves: who decides, and why. What the server refuses is said there, and a token taken.

import { call, CallError, setToken } from './api.js';
import { byId, element } from './dom.js';

const REFUSED = ['UNAUTHENTICATED', 'PERMISSION_DENIED'];
let lastWho = '';

function field(id, label, attributes) {
  return element('p', {}, element('label', { for: id }, label), element('input', { id, autocomplete: 'off', ...attributes }));
}

/**
 * Asks, then calls `method` of JobsService with `message`, who and why; where that is refused the question stays open. text:
 * what will happen; done is called once it has. While the call runs the question cannot be closed.
 */
export function decide({ title, text, method, message, done }) {
  const dialog = byId('decide');
  const problem = element('p', { class: 'failed', role: 'alert', hidden: true });
  const token = field('decide-token', 'Token with the role promote (docs/security.md)', { type: 'password', spellcheck: 'false' });
  token.hidden = true;
  const go = element('button', { id: 'decide-go' }, title);
  const cancel = element('button', { type: 'button', click: () => dialog.close() }, 'Cancel');
  const hold = (isRunning) => [go, cancel].forEach((button) => Object.assign(button, { disabled: isRunning }));
  const submit = async (event) => {
    event.preventDefault();
    if (go.disabled) return;  // Enter, once more
    const value = (id) => form.elements[id].value.trim();
    lastWho = value('decide-who');
    hold(true);
    try {
      const as = value('decide-token');
      await call('JobsService', method, { ...message, who: lastWho, why: value('decide-why') }, as === '' ? undefined : as);
      if (as !== '') setToken(as);  // it was taken
      if (form.isConnected) dialog.close();  // else another question is asked by now
      done();
    } catch (error) {
      if (!(error instanceof CallError)) console.error(error);
      problem.textContent = `${error.code ?? 'ERROR'}: ${error.message}`;
      problem.hidden = false;
      if (REFUSED.includes(error.code)) token.hidden = false;
    }
    hold(false);
  };
  const form = element('form', { submit },
    field('decide-who', 'Who decides (recorded beside the caller that the server knows)', { required: true, maxlength: 128, value: lastWho }),
    field('decide-why', 'Why', { required: true, maxlength: 1000 }),
    token, problem, element('p', {}, go, ' ', cancel));
  dialog.replaceChildren(element('h2', { id: 'decide-title' }, title), element('p', {}, text), form);
  // A browser may close it at a second Escape although `cancel` was prevented: the key is stopped as well.
  dialog.oncancel = (event) => { if (go.disabled) event.preventDefault(); };
  dialog.onkeydown = (event) => { if (go.disabled && event.key === 'Escape') event.preventDefault(); };
  dialog.onclose = () => { if (!dialog.open) dialog.replaceChildren(); };  // with the token that was typed
  dialog.showModal();
}
