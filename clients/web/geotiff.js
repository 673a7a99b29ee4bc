// Rasters from a GeoTIFF file, a tile at a time: what ./grouser map writes (cloud-optimised, deflate with predictors),
// and what it takes. Tiles or strips, plain or deflate, numbers of 8 to 64 bits, BigTIFF too; other compressions are
// refused by name. No page is needed here.

const SIZES = { 1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8 };
const TAG = {
  subfile: 254, width: 256, height: 257, bits: 258, compression: 259, strips: 273, bands: 277, stripRows: 278,
  stripBytes: 279, planar: 284, predictor: 317, tileWidth: 322, tileHeight: 323, tiles: 324, tileBytes: 325, format: 339,
  cell: 33550, tie: 33922, metadata: 42112, nodata: 42113,
};
const COMPRESSIONS = { 1: 'none', 5: 'LZW', 7: 'JPEG', 8: 'deflate', 32773: 'PackBits', 32946: 'deflate', 34887: 'LERC', 50000: 'ZSTD', 50001: 'WebP' };
// A file says what is read of it: these bound memory and time.
const MOST_TAG_BYTES = 32e6;  // of all directories
const MOST_METADATA_BYTES = 1e6;
const MOST_BANDS = 1000;
const MOST_TILE_BYTES = 64 * 2 ** 20;
const MOST_BAND_BYTES = 4e9;  // of all tiles that hold a band, and no more than
const MOST_TIMES_LEVEL = 4;  // times what the level's cells need, beside
const SPARE_BAND_BYTES = 4 * MOST_TILE_BYTES;  // tiles are whole also where the level is small
const MOST_TILES = 65536;  // of a band

/** get and set of numbers in a DataView, by format (1: unsigned, 2: signed, 3: floating) and bits. */
const NUMBERS = {
  '1,8': 'Uint8', '1,16': 'Uint16', '1,32': 'Uint32', '2,8': 'Int8', '2,16': 'Int16', '2,32': 'Int32', '3,32': 'Float32', '3,64': 'Float64',
};

class Reader {
  constructor(blob, name) {
    Object.assign(this, { blob, name, tagBytes: 0 });
  }

  fail(what) {
    throw new Error(`${this.name}: ${what}`);
  }

  async view(offset, length) {
    if (!(offset >= 0 && length >= 0 && offset + length <= this.blob.size)) {
      this.fail(`ends at byte ${this.blob.size}, expected ${length} bytes at ${offset}`);
    }
    return new DataView(await this.blob.slice(offset, offset + length).arrayBuffer());
  }

  /** One directory: {tags: by number, next: offset or 0}. */
  async directory(offset) {
    const { little, big } = this;
    const wide = (view, at) => Number(view.getBigUint64(at, little));
    const head = await this.view(offset, big ? 8 : 2);
    const count = big ? wide(head, 0) : head.getUint16(0, little);
    const size = big ? 20 : 12;
    if (count > 1000) this.fail(`${count} tags in the directory at byte ${offset}, expected at most 1000`);
    const body = await this.view(offset + (big ? 8 : 2), count * size + (big ? 8 : 4));
    const tags = {};
    const seen = new Set();
    for (let i = 0; i < count; ++i) {
      const at = i * size;
      const [tag, type] = [body.getUint16(at, little), body.getUint16(at + 2, little)];
      const n = big ? wide(body, at + 4) : body.getUint32(at + 4, little);
      if (seen.has(tag)) this.fail(`tag ${tag} twice in the directory at byte ${offset}, expected once`);
      seen.add(tag);
      const bytes = n * SIZES[type];
      if (!Object.values(TAG).includes(tag) || Number.isNaN(bytes)) continue;  // none of ours, or an unknown type
      this.tagBytes += bytes;
      if (this.tagBytes > MOST_TAG_BYTES) this.fail(`more than ${MOST_TAG_BYTES} bytes of tags, with tag ${tag} at byte ${offset}`);
      if (tag === TAG.metadata && bytes > MOST_METADATA_BYTES) this.fail(`${bytes} bytes of metadata, expected at most ${MOST_METADATA_BYTES}`);
      const field = at + (big ? 12 : 8);
      const inline = bytes <= (big ? 8 : 4);
      const values = inline ? new DataView(body.buffer, body.byteOffset + field, bytes) :
        await this.view(big ? wide(body, field) : body.getUint32(field, little), bytes);
      tags[tag] = this.values(values, type, n);
    }
    const end = count * size;
    return { tags, next: big ? wide(body, end) : body.getUint32(end, little) };
  }

  values(view, type, n) {
    const { little } = this;
    if (type === 2) return new TextDecoder().decode(view).replace(/\0+$/, '');
    const read = { 1: (at) => view.getUint8(at), 3: (at) => view.getUint16(at, little), 4: (at) => view.getUint32(at, little),
      11: (at) => view.getFloat32(at, little), 12: (at) => view.getFloat64(at, little), 16: (at) => Number(view.getBigUint64(at, little)) }[type];
    return read === undefined ? [] : Float64Array.from({ length: n }, (_, i) => read(i * SIZES[type]));
  }
}

/** The first `kept` of `expected` bytes; all of them are inflated, since the checksum stands at their end. */
async function inflate(bytes, expected, kept, fail) {
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate')).getReader();
  const out = new Uint8Array(kept);
  let at = 0;
  for (;;) {
    const { done, value } = await reader.read().catch(() => fail('damaged: it does not inflate'));
    if (done) break;
    if (at + value.length > expected) {
      reader.cancel().catch(() => {});
      fail(`damaged: inflates to more than ${expected} bytes`);
    }
    if (at < kept) out.set(value.subarray(0, kept - at), at);
    at += value.length;
  }
  if (at < expected) fail(`damaged: inflates to ${at} bytes, expected ${expected}`);
  return out;
}

/**
 * The numbers of one sample of a tile, one after the other. Predictors hold differences along a row, from the same sample: 2 of
 * whole numbers, 3 of bytes, the highest ones of a row's floating numbers first (they become little-endian).
 */
function sampleOf(bytes, { predictor, rows, columns, samples, size, little }, sample) {
  const out = new Uint8Array(rows * columns * size);
  const view = new DataView(out.buffer);
  const [get, set] = ['get', 'set'].map((verb) => view[`${verb}Uint${8 * size}`]?.bind(view));
  for (let row = 0; row < rows; ++row) {
    const [from, to] = [row * columns * samples * size, row * columns * size];
    let sum = 0;
    for (let plane = 0; predictor === 3 && plane < size; ++plane) {
      for (let column = 0; column < columns; ++column) {
        sum = (sum + bytes[from + (plane * columns + column) * samples + sample]) & 255;
        out[to + column * size + size - 1 - plane] = sum;
      }
    }
    for (let column = 0; predictor !== 3 && column < columns; ++column) {
      const [at, end] = [from + (column * samples + sample) * size, to + column * size];
      for (let b = 0; b < size; ++b) out[end + b] = bytes[at + b];
      if (predictor === 2 && column > 0) set(end, get(end, little) + get(end - size, little), little);
    }
  }
  return { view, little: predictor === 3 || little };
}

const ENTITIES = { '&lt;': '<', '&gt;': '>', '&quot;': '"', '&apos;': "'", '&amp;': '&' };
const plainText = (text) => text.replace(/&(lt|gt|quot|apos|amp);/g, (entity) => ENTITIES[entity]);

/** GDAL's metadata: {items: a Map by name, bands: [{description, unittype}]}. Other roles and bands are passed over. */
export function readMetadata(xml, count) {
  const bands = Array.from({ length: count }, () => ({}));
  const items = new Map();
  for (const [, attributes, text] of xml.matchAll(/<Item\s([^<>]*)>([^<]*)<\/Item>/g)) {
    const of = (name) => new RegExp(`(?:^|\\s)${name}="([^"]*)"`).exec(attributes)?.[1];
    const [name, sample, role] = ['name', 'sample', 'role'].map(of);
    const value = plainText(plainText(text));  // GDAL writes them so twice
    const isOfBand = /^\d+$/.test(sample ?? '') && Number(sample) < count;
    if (isOfBand && ['description', 'unittype'].includes(role)) bands[Number(sample)][role] = value;
    else if (sample === undefined && name !== undefined) items.set(name, value);
  }
  return { items, bands };
}

function levelOf(reader, tags) {
  const one = (tag, otherwise) => (typeof tags[tag] === 'string' ? NaN : tags[tag]?.[0] ?? otherwise);
  const isTiled = tags[TAG.tiles] !== undefined;
  const [width, height] = [one(TAG.width), one(TAG.height)];
  const level = {
    width, height, samples: one(TAG.bands, 1), size: one(TAG.bits, 1) / 8, isPlanar: one(TAG.planar, 1) === 2,
    predictor: one(TAG.predictor, 1), compression: COMPRESSIONS[one(TAG.compression, 1)] ?? `number ${one(TAG.compression)}`,
    kind: NUMBERS[`${one(TAG.format, 1)},${one(TAG.bits, 1)}`],
    tileWidth: isTiled ? one(TAG.tileWidth) : width,
    tileHeight: isTiled ? one(TAG.tileHeight) : Math.min(one(TAG.stripRows, height), height),
    offsets: tags[isTiled ? TAG.tiles : TAG.strips], bytes: tags[isTiled ? TAG.tileBytes : TAG.stripBytes], isTiled,
  };
  if (![width, height, level.tileWidth, level.tileHeight].every((size) => Number.isInteger(size) && size > 0) ||
      !level.offsets || !level.bytes) reader.fail('no raster in it');
  if (!(Number.isInteger(level.samples) && level.samples > 0 && level.samples <= MOST_BANDS)) {
    reader.fail(`${level.samples} bands, expected 1 to ${MOST_BANDS}`);
  }
  if (!['none', 'deflate'].includes(level.compression)) reader.fail(`compressed by ${level.compression}, expected deflate or none`);
  if (level.kind === undefined) reader.fail(`numbers of ${tags[TAG.bits]?.[0]} bits, expected 8 to 32, or floating ones of 32 or 64`);
  if (![1, 2, 3].includes(level.predictor) || (level.predictor === 2 && level.size > 4) ||
      (level.predictor === 3 && !level.kind.startsWith('Float'))) {
    reader.fail(`predictor ${level.predictor} for ${level.kind}, expected 1, 2 of whole numbers or 3 of floating ones`);
  }
  const across = Math.ceil(width / level.tileWidth);
  const perBand = across * Math.ceil(height / level.tileHeight);
  const tiles = perBand * (level.isPlanar ? level.samples : 1);
  if (level.offsets.length < tiles || level.bytes.length < tiles) reader.fail(`${level.offsets.length} tiles, expected ${tiles}`);
  const cellBytes = level.size * (level.isPlanar ? 1 : level.samples);  // beside each other in a tile
  const tileBytes = level.tileWidth * level.tileHeight * cellBytes;
  if (!(tileBytes <= MOST_TILE_BYTES)) reader.fail(`a tile of ${tileBytes} bytes, expected at most ${MOST_TILE_BYTES}`);
  return { ...level, across, perBand, cellBytes };
}

/** Why a band of this level is not read: more tiles, or more bytes of them, than its cells explain; null: it is. */
export function excessOf(level) {
  const bytes = level.perBand * level.tileWidth * level.tileHeight * level.cellBytes;
  const most = Math.min(MOST_BAND_BYTES, MOST_TIMES_LEVEL * level.width * level.height * level.cellBytes + SPARE_BAND_BYTES);
  if (level.perBand > MOST_TILES) return `${level.perBand} tiles for a band, expected at most ${MOST_TILES}`;
  return bytes > most ? `${level.width} x ${level.height} cells in tiles of ${bytes} bytes in all, expected at most ${most}` : null;
}

/**
 * Opens a file (a Blob with its name): {width, height, bands: [{name, unit}], nodata, classes: a Map of names by value or null,
 * place: {x, y, dx, dy} of the north-west corner and a cell, or null, levels: [{width, height}], the finest first}. Throws
 * an Error "NAME: what, expected ...".
 */
export async function openGeotiff(blob, name) {
  const reader = new Reader(blob, name);
  const head = await reader.view(0, Math.min(16, blob.size));
  const order = blob.size < 16 ? 0 : head.getUint16(0);
  reader.little = order === 0x4949;
  const version = reader.little || order === 0x4d4d ? head.getUint16(2, reader.little) : 0;
  if (version !== 42 && version !== 43) reader.fail('no TIFF file, expected a raster as ./grouser map writes');
  reader.big = version === 43;
  let next = reader.big ? Number(head.getBigUint64(8, reader.little)) : head.getUint32(4, reader.little);
  let first = null;
  const levels = [];
  const seen = new Set();
  while (next !== 0) {
    if (seen.has(next)) reader.fail(`the directory at byte ${next} comes again, expected an end`);
    if (seen.size === 100) reader.fail('more than 100 directories');
    seen.add(next);
    const { tags, next: following } = await reader.directory(next);
    const isMask = ((tags[TAG.subfile]?.[0] ?? 0) & 4) !== 0;
    if (!isMask) levels.push(levelOf(reader, tags));
    first ??= tags;
    next = following;
  }
  if (levels.length === 0) reader.fail('no raster in it');
  const { samples } = levels[0];
  const metadata = readMetadata(typeof first[TAG.metadata] === 'string' ? first[TAG.metadata] : '', samples);
  const classes = [...metadata.items].filter(([key]) => /^BINDING_\d+$/.test(key)).map(([key, value]) => [Number(key.slice(8)), value]);
  const [tie, cell] = [first[TAG.tie], first[TAG.cell]];
  return {
    reader, name, levels, width: levels[0].width, height: levels[0].height,
    bands: metadata.bands.map(({ description, unittype }, i) => ({ name: description || `band ${i + 1}`, unit: unittype ?? '' })),
    nodata: first[TAG.nodata] === undefined ? NaN : Number(first[TAG.nodata]),
    classes: classes.length > 0 ? new Map(classes) : null,
    place: tie && cell ? { x: tie[3] - tie[0] * cell[0], y: tie[4] + tie[1] * cell[1], dx: cell[0], dy: -cell[1] } : null,
  };
}

/** The first `rows` of the tile's `allRows`. */
async function tileOf({ reader }, level, index, { rows, allRows }, band) {
  const [samples, sample] = level.isPlanar ? [1, 0] : [level.samples, band];
  const rowBytes = level.tileWidth * level.cellBytes;
  const [expected, kept, packed] = [allRows * rowBytes, rows * rowBytes, level.bytes[index]];
  const fail = (what) => reader.fail(`tile ${index}: ${what}`);
  const isPlain = level.compression === 'none';
  if (isPlain && packed < expected) fail(`${packed} bytes, expected ${expected}`);
  const most = 1.1 * expected + 4096;  // deflate makes nothing longer than this
  if (!isPlain && packed > most) fail(`${packed} bytes, expected at most ${Math.floor(most)} for ${expected} inflated ones`);
  const { buffer } = await reader.view(level.offsets[index], isPlain ? kept : packed);
  const bytes = new Uint8Array(buffer);
  const plain = isPlain ? bytes : await inflate(bytes, expected, kept, fail);
  return sampleOf(plain, { ...level, rows, columns: level.tileWidth, samples, little: reader.little }, sample);
}

/**
 * The cells of one band of a level, row by row from the north-west; NaN: no data. isWanted is asked between tiles; null where it
 * says no.
 */
export async function readBand(file, level, band, isWanted = () => true) {
  const { perBand } = level;
  if (!(band < level.samples)) file.reader.fail(`${level.samples} bands in an overview, expected ${file.bands.length}`);
  const excess = excessOf(level);
  if (excess !== null) file.reader.fail(excess);
  const cells = new Float32Array(level.width * level.height).fill(NaN);
  for (let t = 0; t < perBand; ++t) {
    if (!isWanted()) return null;
    const index = level.isPlanar ? band * perBand + t : t;
    const [left, top] = [(t % level.across) * level.tileWidth, Math.floor(t / level.across) * level.tileHeight];
    const [columns, rows] = [Math.min(level.tileWidth, level.width - left), Math.min(level.tileHeight, level.height - top)];
    if (level.bytes[index] === 0) continue;  // a tile that was never written
    const { view, little } = await tileOf(file, level, index, { rows, allRows: level.isTiled ? level.tileHeight : rows }, band);
    const read = view[`get${level.kind}`].bind(view);
    for (let row = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column) {
        const value = read((row * level.tileWidth + column) * level.size, little);
        if (value !== file.nodata) cells[(top + row) * level.width + left + column] = value;
      }
    }
  }
  return cells;
}
