// Elements. What comes from outside is put in as text, never as HTML.

const SVG = 'http://www.w3.org/2000/svg';

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') node.addEventListener(name, value);
    else if (value === true) node.setAttribute(name, '');
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return node;
}

/** Attributes with a function are events; those that are false, null or undefined are left out. */
export function element(name, attributes = {}, ...children) {
  return fill(document.createElement(name), attributes, children);
}

export function svgElement(name, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, name), attributes, children);
}

export const byId = (id) => document.getElementById(id);

/** header: texts; rows: arrays of texts or nodes. The first cell of a row names it. */
export function table(header, rows, attributes = {}) {
  const cells = (row) => row.map((cell, i) => element(i === 0 ? 'th' : 'td', i === 0 ? { scope: 'row' } : {}, cell));
  return element('table', attributes,
    header.length ? element('thead', {}, element('tr', {}, header.map((text) => element('th', { scope: 'col' }, text)))) : null,
    element('tbody', {}, rows.map((row) => element('tr', {}, cells(row)))));
}

/** In a frame that scrolls sideways, also by keyboard. */
export const scrolled = (label, content) =>
  element('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': label }, content);

/** Children become `nodes`; those that stay are not touched, so that the focus stays in them. */
export function replaceInPlace(place, nodes) {
  [...place.childNodes].filter((node) => !nodes.includes(node)).forEach((node) => node.remove());
  nodes.forEach((node, i) => {
    if (place.childNodes[i] !== node) place.insertBefore(node, place.childNodes[i] ?? null);
  });
}

export const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });

/** Runs `work` once at a time; what is asked meanwhile is run once more, `restMs` afterwards. */
export function latest(work, restMs = 0) {
  let running = false;
  let again = false;
  return async function run() {
    if (running) {
      again = true;
      return;
    }
    running = true;
    try {
      do {
        again = false;
        await work();
        if (again) await pause(restMs);
      } while (again);
    } finally {
      running = false;
    }
  };
}
