// Which raster is shown: the level of a file that a canvas takes, and what was chosen last. No page is needed here.

import { excessOf, openGeotiff, readBand } from './geotiff.js';

const MOST_CELLS = 12e6;  // on a canvas; finer files are shown by an overview
const MOST_SIDE = 16384;  // of a canvas, in every browser

/** The finest level of an opened file that is shown; an Error where there is none. */
export function levelToShow(raster) {
  const isFit = ({ width, height }) => width * height <= MOST_CELLS && Math.max(width, height) <= MOST_SIDE;
  const level = raster.levels.find((one) => isFit(one) && excessOf(one) === null);
  if (level !== undefined) return level;
  const excess = raster.levels.filter(isFit).map(excessOf)[0];
  throw new Error(`${raster.name}: ${excess ?? `${raster.width} x ${raster.height} cells and no smaller overview, expected at most ` +
    `${MOST_CELLS} cells and ${MOST_SIDE} on a side`}`);
}

export class ShownRaster {
  #asked = null;

  /** finish: makes of {raster, level, band (its index), cells} what is shown. */
  constructor(finish) {
    this.finish = finish;
    this.shown = null;
  }

  /**
   * Its first band. True once it is shown, all of it at once; false where something else was chosen meanwhile. An Error where it
   * cannot be read. What is shown changes in the first case alone.
   */
  openFile(blob, name) {
    return this.#choose(async (isWanted) => {
      const raster = await openGeotiff(blob, name);
      return isWanted() ? this.#read(raster, levelToShow(raster), 0, isWanted) : null;
    });
  }

  /** Another band of the file that is shown, as openFile. */
  openBand(band) {
    const { raster, level } = this.shown;
    return this.#choose((isWanted) => this.#read(raster, level, band, isWanted));
  }

  async #read(raster, level, band, isWanted) {
    const cells = await readBand(raster, level, band, isWanted);
    return cells === null ? null : this.finish({ raster, level, band, cells });
  }

  async #choose(read) {
    const asked = {};
    this.#asked = asked;
    const isWanted = () => this.#asked === asked;
    try {
      const shown = await read(isWanted);
      if (!isWanted()) return false;
      this.shown = shown;
      return true;
    } catch (error) {
      if (!isWanted()) return false;
      throw error;
    }
  }
}
