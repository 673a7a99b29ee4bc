// A raster from the reader's disk on a canvas: pan, zoom, the value under the cursor, all of it by keyboard too.

import { element } from './dom.js';
import { format } from './format.js';
import { pixelsOf, scaleOf } from './map_colours.js';
import { mapLegend } from './map_legend.js';
import { ShownRaster } from './map_read.js';

const MOST_ZOOM = 60;  // pixels a cell, but for a raster of a few cells
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** Pixels a cell, from the whole raster (`least`) to the nearest. */
export const boundedZoom = (zoom, least) => Math.min(Math.max(MOST_ZOOM, least), Math.max(least, zoom));

/** What is drawn of a band that was read. */
function drawn({ raster, level, band, cells }) {
  const scale = scaleOf(cells, raster.classes);
  const image = document.createElement('canvas');
  Object.assign(image, { width: level.width, height: level.height });
  image.getContext('2d').putImageData(new ImageData(pixelsOf(cells, scale), level.width), 0, 0);
  return { raster, level, cells, scale, image, index: band, band: raster.bands[band] };
}

export class MapView {
  constructor(place) {
    this.chosen = new ShownRaster(drawn);
    this.note = element('p', { class: 'note', role: 'status' });
    this.bands = element('select', { id: 'map-band', change: () => this.#openBand() });
    this.canvas = element('canvas', { id: 'map-canvas', tabindex: '0', role: 'img', 'aria-describedby': 'map-keys' });
    this.value = element('output', { id: 'map-value' });
    this.legend = element('div', { class: 'legend' });
    const button = (text, label, factor) => element('button', {
      type: 'button', 'aria-label': label, click: () => (factor === 0 ? this.#fit() : this.#zoom(factor)) }, text);
    this.frame = element('div', { hidden: true },
      element('div', { class: 'choice' }, element('label', {}, 'Band ', this.bands),
        element('span', {}, button('+', 'nearer', 1.5), ' ', button('−', 'farther', 1 / 1.5), ' ', button('Whole', 'the whole map', 0))),
      this.canvas, element('p', {}, this.value), this.legend,
      element('p', { class: 'note', id: 'map-keys' }, 'Drag to move; two fingers, Ctrl and the wheel, or + and − to zoom. In the map: arrows move the ' +
        'cursor by a cell (with Shift by ten), + and − zoom about it, 0 shows the whole map.'));
    place.append(element('label', {}, 'GeoTIFF ', element('input', {
      type: 'file', id: 'map-file', accept: '.tif,.tiff,image/tiff', change: (event) => this.#open(event.target.files[0]),
      click: (event) => { event.target.value = ''; },  // the same file may be chosen again
    })), this.note, this.frame);
    this.pointers = new Map();
    this.canvas.addEventListener('pointerdown', (event) => this.#press(event));
    this.canvas.addEventListener('pointermove', (event) => this.#move(event));
    for (const name of ['pointerup', 'pointercancel']) this.canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    this.canvas.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
    this.canvas.addEventListener('keydown', (event) => this.#key(event));
    new ResizeObserver(() => this.#draw()).observe(this.canvas);
  }

  async #open(file) {
    if (file === undefined) return;
    this.#say(`Reading ${file.name} ...`);
    await this.#show(this.chosen.openFile(file, file.name));
  }

  async #openBand() {
    this.#say(`Reading ${this.raster.name} ...`);
    await this.#show(this.chosen.openBand(Number(this.bands.value)));
  }

  /** Once it is read; what cannot be read leaves what is shown. */
  async #show(opening) {
    try {
      if (!await opening) return;
    } catch (error) {
      if (this.raster !== undefined) this.bands.value = String(this.index);
      this.#say(`${error.message}${this.raster === undefined ? '' : `. Still shown: ${this.raster.name}.`}`, true);
      return;
    }
    const isNew = this.raster !== this.chosen.shown.raster;
    Object.assign(this, this.chosen.shown);
    const { raster, level, scale, band, index } = this;
    this.frame.hidden = false;
    if (isNew) this.bands.replaceChildren(...raster.bands.map(({ name }, i) => element('option', { value: String(i) }, name)));
    this.bands.value = String(index);
    const step = Math.round(raster.width / level.width);
    this.#say(`${raster.name}: ${raster.width} × ${raster.height} cells` +
      (step > 1 ? `, shown by its overview of every ${step}th cell.` : raster.place === null ? '.' : ` of ${format(raster.place.dx, 4)} m.`));
    this.legend.replaceChildren(...mapLegend(scale, band.unit));
    if (isNew) this.#fit();
    else this.#draw();
  }

  #say(text, isError = false) {
    this.note.textContent = text;
    this.note.className = isError ? 'note failed' : 'note';
  }

  /** Pixels a cell with which the whole raster is seen. */
  get least() {
    return Math.min(this.canvas.clientWidth / this.level.width, this.canvas.clientHeight / this.level.height);
  }

  #fit() {
    const { level } = this;
    this.zoom = this.least;
    this.centre = [level.width / 2, level.height / 2];
    this.cursor = this.centre.map(Math.floor);
    this.#draw();
  }

  #zoom(factor, about = this.centre) {
    const zoom = boundedZoom(this.zoom * factor, this.least);
    this.centre = this.centre.map((at, i) => about[i] + (at - about[i]) * (this.zoom / zoom));
    this.zoom = zoom;
    this.#draw();
  }

  /** The place of an event, in cells. */
  #cellAt({ clientX, clientY }) {
    const box = this.canvas.getBoundingClientRect();
    return [clientX - box.left - box.width / 2, clientY - box.top - box.height / 2].map((at, i) => this.centre[i] + at / this.zoom);
  }

  #press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.#point(event);
  }

  #point(event) {
    const cell = this.#cellAt(event).map(Math.floor);
    if (cell[0] >= 0 && cell[1] >= 0 && cell[0] < this.level.width && cell[1] < this.level.height) this.cursor = cell;
    this.#draw();
  }

  #move(event) {
    const before = this.pointers.get(event.pointerId);
    if (before === undefined) return this.#point(event);
    const now = [event.clientX, event.clientY];
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    const distance = ([x, y]) => Math.hypot(x - other[0], y - other[1]);
    if (other !== undefined) this.#zoom(distance(now) / Math.max(1, distance(before)), this.#cellAt({ clientX: other[0], clientY: other[1] }));
    else this.centre = this.centre.map((at, i) => at - (now[i] - before[i]) / this.zoom);
    this.#point(event);
  }

  #wheel(event) {
    if (!event.ctrlKey && document.activeElement !== this.canvas) return;  // the page scrolls
    event.preventDefault();
    this.#zoom(Math.exp(-event.deltaY / 300), this.#cellAt(event));
  }

  #key(event) {
    const way = KEYS[event.key];
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (way !== undefined) this.#step(way.map((step) => step * (event.shiftKey ? 10 : 1)));
    else if (event.key === '+' || event.key === '-') this.#zoom(event.key === '+' ? 1.5 : 1 / 1.5, this.cursor.map((at) => at + 0.5));
    else if (event.key === '0') this.#fit();
    else return;
    event.preventDefault();
  }

  #step(way) {
    const last = [this.level.width - 1, this.level.height - 1];
    this.cursor = this.cursor.map((at, i) => Math.min(last[i], Math.max(0, at + way[i])));
    const half = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2].map((pixels) => pixels / this.zoom - 1);
    this.centre = this.centre.map((at, i) => Math.min(this.cursor[i] + half[i], Math.max(this.cursor[i] + 1 - half[i], at)));
    this.#draw();
  }

  #draw() {
    const { canvas, image, zoom, centre, cursor } = this;
    if (image === undefined || centre === undefined || canvas.clientWidth === 0) return;
    const ratio = window.devicePixelRatio;
    Object.assign(canvas, { width: Math.round(canvas.clientWidth * ratio), height: Math.round(canvas.clientHeight * ratio) });
    const context = canvas.getContext('2d');
    context.imageSmoothingEnabled = zoom * ratio < 1;  // cells that can be seen keep their edges
    context.setTransform(zoom * ratio, 0, 0, zoom * ratio, canvas.width / 2 - centre[0] * zoom * ratio, canvas.height / 2 - centre[1] * zoom * ratio);
    context.drawImage(image, 0, 0);
    const size = Math.max(1, 9 / zoom);
    const at = cursor.map((cell) => cell + 0.5 - size / 2);
    for (const [colour, width] of [['#000', 3], ['#fff', 1.2]]) {
      context.strokeStyle = colour;
      context.lineWidth = width / zoom;
      context.strokeRect(...at, size, size);
    }
    this.#tell();
  }

  #tell() {
    const { raster, level, band, cells, scale, cursor: [column, row] } = this;
    const value = cells[row * level.width + column];
    const [stepX, stepY] = [raster.width / level.width, raster.height / level.height];
    const text = Number.isNaN(value) ? 'no data' : scale.classes?.get(value) ?? `${format(value, 4)} ${band.unit}`.trim();
    const { place } = raster;
    const where = place === null ? '' : `; east ${format(place.x + (column + 0.5) * stepX * place.dx, 9)} m, ` +
      `north ${format(place.y + (row + 0.5) * stepY * place.dy, 9)} m`;
    this.value.textContent = `${band.name}: ${text} at column ${Math.floor(column * stepX)}, row ${Math.floor(row * stepY)}${where}`;
    this.canvas.setAttribute('aria-label', `Map ${raster.name}, ${this.value.textContent}`);
  }
}
