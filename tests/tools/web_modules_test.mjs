// Run by web_modules_test.py beside the page's modules, with what the programs said in cases.json.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { deflateSync } from 'node:zlib';

import { latestMoves, olderText, rollbackQuestion, stableQuestion } from './aliases.js';
import { nearRows, nearRuns } from './curves.js';
import { allRuns, isCovered, stressText, varianceShares } from './explain_parts.js';
import { OUTPUTS } from './format.js';
import { excessOf, openGeotiff, readBand, readMetadata } from './geotiff.js';
import { jobsPeriodMs, promoteQuestion, readCheck } from './jobs.js';
import { boundedZoom } from './map.js';
import { pixelsOf, scaleOf } from './map_colours.js';
import { levelToShow, ShownRaster } from './map_read.js';
import { compareWithRows, parseMeasured, statesOfRows } from './measured.js';
import { stressesOf } from './stress.js';

const cases = JSON.parse(readFileSync('cases.json', 'utf8'));
const blobOf = (file) => new Blob([readFileSync(file)]);
const near = (a, b, relative = 1e-9) => Math.abs(a - b) <= relative * Math.max(Math.abs(a), Math.abs(b));

test('shares of the variance, runs and stresses are those of the command line', () => {
  for (const { explanation, text } of cases.explanations) {
    for (const output of explanation.outputs) {
      const line = text.split('\n').find((one) => one.startsWith(`${output.output} `));
      const shares = varianceShares(output).map((share) => String(Math.round(100 * share)));
      assert.match(line, new RegExp(`\\s${shares.join('\\s+')}\\s`), `${output.output}: ${shares}`);
    }
    const runs = allRuns(explanation);
    assert.ok(runs.length >= 10 && runs.some(({ kind }) => kind === 'held_out'));
    let stars = 0;
    for (const { near: one } of runs) {
      const at = text.indexOf(one.run.run_id);
      assert.ok(at > 0, one.run.run_id);
      const lines = text.slice(at).split('\n');
      if (one.stress) {
        const peak = /normal to (\S+) kPa at (\S+) deg/.exec(lines[2]);
        const ours = /normal to (\S+) kPa at (\S+) deg/.exec(stressText(one.stress));
        assert.ok(near(Number(peak[1]), Number(ours[1]), 0.01), `${lines[2]}: ${ours[0]}`);
        assert.ok(Math.abs(Number(peak[2]) - Number(ours[2].replace('−', '-'))) <= 1, `${lines[2]}: ${ours[0]}`);
      }
      const marked = lines[1].split('*').length - 1;
      assert.equal(OUTPUTS.filter(({ key }, i) => key !== 'f_z' && isCovered(one, i) === false).length, marked, lines[1]);
      stars += marked;
    }
    assert.ok(stars > 0);
    assert.ok(stressesOf(explanation).length >= 5);
  }
});

test('a table of measured rows is compared as `model compare` does', () => {
  const { points, source } = parseMeasured(cases.measured, 'measured.csv');
  assert.equal(points.length, cases.compared.rows.length);
  assert.match(source, /^A smooth rigid wheel/);
  const responses = { flags: points.map(() => 0) };
  for (const { key } of OUTPUTS) {
    const of = (part) => cases.compared.rows.map((row) => row.surrogate[key]?.[part] ?? 'NaN');
    responses[key] = { value: of('value'), low: of('low'), high: of('high') };
  }
  const { outputs } = compareWithRows(points, responses);
  const wanted = cases.compared.errors.filter(({ region }) => region === 'all');
  assert.deepEqual(outputs.map(({ key }) => key), wanted.map(({ output }) => output));
  for (const [i, { n, rmse }] of wanted.entries()) {
    assert.equal(outputs[i].n, n);
    assert.ok(near(outputs[i].rms, rmse), `${outputs[i].key}: ${outputs[i].rms}, ${rmse}`);
    assert.ok(outputs[i].inDem > 0 && outputs[i].inDem < n);
    assert.ok(Number.isNaN(outputs[i].inMeasured));
  }
  assert.equal(statesOfRows(points).slip.slip.length, points.length);
});

test('a table that cannot be read is refused in the words of the programs', () => {
  for (const { text, refusal } of cases.badTables) {
    assert.throws(() => parseMeasured(text, 'bad.csv'), (error) => {
      const words = error.message.replace(/^bad\.csv:/, '');
      return refusal.includes(`bad.csv:${words}`) || assert.fail(`${JSON.stringify(text)}: ${error.message}; the program: ${refusal}`);
    });
  }
  assert.throws(() => parseMeasured(`slip,attack_angle_deg,load_n\n${'0,0,1\n'.repeat(5001)}`, 'm.csv'), /m\.csv:5002: more than 5000 rows/);
  assert.throws(() => parseMeasured(`slip,attack_angle_deg,load_n${',x'.repeat(800000)}\n`, 'm.csv'), /m\.csv:1: 800003 columns, expected at most 64/);
});

test('measured rows are drawn near the load and angle that are asked alone, and mirrored to their side', () => {
  const { points } = parseMeasured(cases.measured, 'measured.csv');
  const answer = Object.fromEntries(OUTPUTS.map(({ key }) => [key, { value: points.map((_, i) => i) }]));
  const rows = (state, key = 'f_y') => nearRows(points, [answer], key, state);
  assert.equal(rows({ angleDeg: 30, load: 22 }).length, 9);
  assert.ok(rows({ angleDeg: 30, load: 22 }).every(({ value }) => value < 0));
  assert.ok(rows({ angleDeg: -30, load: 22 }).every(({ value, beside }) => value > 0 && beside[0] <= 0));
  assert.ok(rows({ angleDeg: -30, load: 22 }, 'f_x').some(({ value }) => value < 0));
  assert.equal(rows({ angleDeg: 30, load: 22 }, 'torque').length, 0);  // not measured
  assert.equal(rows({ angleDeg: 15, load: 22 }).length, 0);
  assert.equal(rows({ angleDeg: 30, load: 40 }).length, 0);
  const light = rows({ angleDeg: 30, load: 16 });
  assert.ok(light.length > 0 && light.length < 9);
  const run = { status: 'RUN_STATUS_STEADY', load_n: 22, attack_angle_rad: Math.PI / 6 };
  assert.equal(nearRuns([run, { ...run, load_n: 30 }, { ...run, status: 'RUN_STATUS_FAILED' }], { angleDeg: -30, load: 22 }).length, 1);
});

test('a gate check is read as number and limit', () => {
  assert.ok(cases.gate.length >= 8);
  for (const check of cases.gate) {
    const { number, limit, words } = readCheck(check);
    const [, side, bound] = /^at (most|least) (\S+)$/.exec(limit);
    assert.equal(side === 'most' ? Number(number) <= Number(bound) : Number(number) >= Number(bound), check.passed, check.detail);
    assert.equal(`${number}, ${limit}: ${words}`, check.detail);
  }
  assert.ok(cases.gate.some(({ passed }) => passed) && cases.gate.some(({ passed }) => !passed));
  assert.deepEqual(readCheck({ detail: 'fine' }), { number: '–', limit: '–', words: 'fine' });
});

test('jobs are asked soon while one runs; of aliases the latest move counts', () => {
  const job = (state) => ({ job_state: `JOB_STATE_${state}` });
  assert.ok(jobsPeriodMs([job('DONE'), job('RUNNING')]) < jobsPeriodMs([job('DONE'), job('AWAITING_PROMOTION')]));
  const move = (model, alias, generation) => ({ model, alias, generation });
  const moves = [move('b', 'stable', 9), move('a', 'mine', 8), move('a', 'canary', 7), move('a', 'candidate', 6), move('a', 'stable', 5),
    move('a', 'canary', 4), move('a', 'previous', 3)];
  assert.deepEqual(latestMoves(moves).map(({ generation }) => generation), [5, 7, 8, 9]);
  assert.equal(olderText({ moves, next_page_token: '' }), '');
  assert.match(olderText({ moves, next_page_token: '3' }), /By the latest 7 moves: an alias whose last move is older is not shown/);
});

test('a call names the digest that its question names', () => {
  const [from, to] = ['a'.repeat(64), 'b'.repeat(64)];
  const move = { model: 'm', alias: 'canary', from_digest: from, to_digest: to, rollback: false };
  const back = rollbackQuestion(move);
  assert.deepEqual(back.message, { model: 'm@canary', to: from });
  assert.match(back.text, /aaaaaaaa/);
  for (const unknown of [{ ...move, rollback: true }, { ...move, from_digest: '' }]) {  // the server knows what was before
    assert.deepEqual(rollbackQuestion(unknown).message, { model: 'm@canary', to: '' });
    assert.doesNotMatch(rollbackQuestion(unknown).text, /aaaaaaaa/);
  }
  assert.deepEqual(stableQuestion(move).message, { model: `m@sha256:${to}`, alias: 'stable' });
  assert.match(stableQuestion(move).text, /m@stable will be bbbbbbbb/);
  const promote = promoteQuestion({ job_id: 'job-1', model: `m@sha256:${from}`, candidate_digest: to }, 'canary');
  assert.deepEqual(promote.message, { job_id: 'job-1', alias: 'canary', candidate_digest: to });  // what is shown
  assert.match(promote.text, /m@canary will be the candidate bbbbbbbb.* another one by then, the server would refuse/);
});

const same = (a, b) => a === b || (Number.isNaN(a) && Number.isNaN(b));

test('rasters of libtiff are read bit for bit', async () => {
  for (const { file, width, height, bands } of cases.rasters) {
    const raster = await openGeotiff(blobOf(file), 'x.tif');
    assert.deepEqual([raster.width, raster.height, raster.bands.length], [width, height, bands], file);
    for (let band = 0; band < bands; ++band) {
      const bytes = readFileSync(`${file}.${band}`);
      const wanted = new Float32Array(bytes.buffer, bytes.byteOffset, width * height);
      const cells = await readBand(raster, raster.levels[0], band);
      assert.equal(cells.length, wanted.length);
      assert.ok(cells.every((cell, i) => same(cell, wanted[i])), `${file}, band ${band}`);
    }
  }
});

test('names in GDAL metadata are read as GDAL 3.6 writes them', () => {
  const { items, bands } = readMetadata('<GDALMetadata>\n  <Item name="BINDING_2">R &amp;amp; D</Item>\n  <Item name="DESCRIPTION" sample="1" ' +
    'role="description">&amp;lt;c&amp;gt;</Item>\n  <Item name="UNITTYPE" sample="0" role="unittype">m/s</Item>\n</GDALMetadata>', 2);
  assert.deepEqual([[...items], bands], [[['BINDING_2', 'R & D']], [{ unittype: 'm/s' }, { description: '<c>' }]]);
});

test('metadata sets names and units of bands alone', () => {
  const item = (attributes) => `<Item ${attributes}>bad</Item>`;
  const { items, bands } = readMetadata(['name="a" sample="__proto__" role="map"', 'name="b" sample="length" role="description"',
    'sample="0" role="__proto__"', 'sample="0" role="map"', 'sample="2" role="description"', 'sample="-1" role="unittype"',
    'name="__proto__"', 'name="constructor"'].map(item).join(''), 2);
  assert.equal(typeof [].map, 'function');
  assert.equal(bands.length, 2);
  assert.ok(bands.every((band) => Reflect.ownKeys(band).length === 0 && Object.getPrototypeOf(band) === Object.prototype));
  assert.deepEqual([...items.keys()], ['__proto__', 'constructor']);
  // A tag ends before the next begins: else each of those that are not closed is looked for to the end, 150,000 times 0.9 MB.
  assert.deepEqual([...readMetadata('<Item name="a" <Item name="b">text</Item>', 1).items.keys()], ['b']);
  assert.equal(readMetadata('<Item '.repeat(150000), 1).items.size, 0);
});

/**
 * A TIFF of directories [[tag, type 2, 3, 4 or 12, values], ...], the first 4096 bytes as data of tiles at byte 8; next: the
 * number of the directory that follows the last one.
 */
function tiffOf(directories, { data = Buffer.alloc(0), next = null } = {}) {
  const blocks = [Buffer.from([0x49, 0x49, 42, 0, 0, 0, 0, 0]), data, Buffer.alloc(Math.max(0, 4096 - data.length))];
  const end = () => blocks.reduce((sum, block) => sum + block.length, 0);
  const places = [];
  for (const entries of directories) {
    const fields = entries.map(([tag, type, values]) => {
      const bytes = type === 2 ? Buffer.from(`${values}\0`) : Buffer.from(new { 3: Uint16Array, 4: Uint32Array, 12: Float64Array }[type](values).buffer);
      const field = Buffer.alloc(12);
      field.writeUInt16LE(tag, 0);
      field.writeUInt16LE(type, 2);
      field.writeUInt32LE(type === 2 ? bytes.length : values.length, 4);
      if (bytes.length <= 4) bytes.copy(field, 8);
      else {
        field.writeUInt32LE(end(), 8);
        blocks.push(bytes);
      }
      return field;
    });
    places.push(end());
    const count = Buffer.alloc(2);
    count.writeUInt16LE(fields.length);
    blocks.push(count, ...fields, Buffer.alloc(4));
  }
  const bytes = Buffer.concat(blocks);
  bytes.writeUInt32LE(places[0], 4);
  for (const [i, entries] of directories.entries()) {
    bytes.writeUInt32LE(i + 1 < places.length ? places[i + 1] : next === null ? 0 : places[next], places[i] + 2 + 12 * entries.length);
  }
  return new Blob([bytes]);
}

/** A directory of one byte a cell in square tiles, all at byte 8. */
function tiled(width, height, tile, { bands = 1, compression = 1, bytes = tile * tile * bands, more = [] } = {}) {
  const count = Math.ceil(width / tile) * Math.ceil(height / tile);
  return [[256, 4, [width]], [257, 4, [height]], [258, 3, [8]], [259, 3, [compression]], [277, 4, [bands]], [322, 4, [tile]], [323, 4, [tile]],
    [324, 4, Array(count).fill(8)], [325, 4, Array(count).fill(bytes)], ...more];
}
const openTiff = (...made) => openGeotiff(tiffOf(...made), 'x.tif');

test('what a raster may cost is bounded, and said by name', async () => {
  const plain = await openTiff([tiled(20, 17, 16)], { data: Buffer.from(Array.from({ length: 256 }, (_, i) => i)) });
  assert.deepEqual([...(await readBand(plain, plain.levels[0], 0)).subarray(16, 22)], [0, 1, 2, 3, 16, 17]);
  await assert.rejects(openTiff([tiled(16, 16, 16, { bands: 5e8 })]), /^Error: x\.tif: 500000000 bands, expected 1 to 1000$/);
  await assert.rejects(openTiff([tiled(16, 16, 16, { bands: 1001 })]), /x\.tif: 1001 bands/);
  await assert.rejects(openTiff([tiled(16, 16, 16384)]), /x\.tif: a tile of 268435456 bytes, expected at most 67108864/);
  await assert.rejects(openTiff([tiled(16, 16, 16)], { next: 0 }), /x\.tif: the directory at byte 4104 comes again/);
  await assert.rejects(openTiff([tiled(16, 16, 16), tiled(8, 8, 16)], { next: 0 }), /x\.tif: the directory at byte 4104 comes again/);
  await assert.rejects(openTiff([tiled(16, 16, 16, { more: [[256, 4, [16]]] })]), /x\.tif: tag 256 twice in the directory at byte 4104/);
  const metadata = (length) => tiled(16, 16, 16, { more: [[42112, 2, 'x'.repeat(length)]] });
  await openTiff([metadata(900000)]);
  await assert.rejects(openTiff([metadata(1100000)]), /x\.tif: 1100001 bytes of metadata, expected at most 1000000/);
  const many = tiled(16, 16, 16).map((entry) => (entry[0] === 324 ? [324, 4, Array(2.1e6).fill(8)] : entry));
  await assert.rejects(openTiff([many, many, many, many]), /x\.tif: more than 32000000 bytes of tags, with tag 324/);
  await assert.rejects(openTiff([tiled(16, 16, 16).map((entry) => (entry[0] === 256 ? [256, 2, '16'] : entry))]), /x\.tif: no raster in it/);
});

test('tiles that a level does not explain are not read', async () => {
  const wide = await openTiff([tiled(4000, 2, 4096, { bytes: 16 })]);
  assert.equal(excessOf(wide.levels[0]), null);  // one tile of 16 MB is whole
  const long = await openTiff([tiled(81920, 2, 8192, { bytes: 16 })]);
  assert.match(excessOf(long.levels[0]), /^81920 x 2 cells in tiles of 671088640 bytes in all, expected at most 269090816$/);
  await assert.rejects(readBand(long, long.levels[0], 0), /x\.tif: 81920 x 2 cells in tiles of/);
  const small = await openTiff([tiled(300, 300, 1)]);
  await assert.rejects(readBand(small, small.levels[0], 0), /x\.tif: 90000 tiles for a band, expected at most 65536/);
  const padded = await openTiff([tiled(16, 16, 16, { compression: 8, bytes: 100000 })]);
  await assert.rejects(readBand(padded, padded.levels[0], 0), /x\.tif: tile 0: 100000 bytes, expected at most 4377 for 256 inflated ones/);
  const bomb = await openTiff([tiled(16, 16, 16, { compression: 8, bytes: 4000 })], { data: deflateSync(Buffer.alloc(3e6)) });
  await assert.rejects(readBand(bomb, bomb.levels[0], 0), /x\.tif: tile 0: damaged: inflates to more than 256 bytes/);
  const fewer = await openTiff([tiled(32, 32, 16, { bands: 2 }), tiled(16, 16, 16)]);
  await assert.rejects(readBand(fewer, fewer.levels[1], 1), /x\.tif: 1 bands in an overview, expected 2/);
});

test('rows below the level are not kept, but checked', async () => {
  const packed = deflateSync(Buffer.from(Array.from({ length: 256 }, (_, i) => i)));
  const of = (data) => openTiff([tiled(3, 2, 16, { compression: 8, bytes: packed.length })], { data });
  const raster = await of(packed);
  assert.deepEqual([...await readBand(raster, raster.levels[0], 0)], [0, 1, 2, 16, 17, 18]);
  const damaged = Buffer.from(packed);
  damaged[damaged.length - 1] ^= 1;
  const bad = await of(damaged);
  await assert.rejects(readBand(bad, bad.levels[0], 0), /x\.tif: tile 0: damaged/);
});

test('between tiles it is asked whether they are still wanted', async () => {
  const raster = await openTiff([tiled(64, 64, 16)]);
  let asked = 0;
  assert.equal(await readBand(raster, raster.levels[0], 0, () => ++asked < 4), null);
  assert.equal(asked, 4);
});

test('the finest level that a canvas takes is shown, by cells and by sides', async () => {
  const level = (width, height) => ({ width, height, perBand: 1, tileWidth: width, tileHeight: height, cellBytes: 1 });
  const widths = (...levels) => levelToShow({ name: 'x.tif', levels, width: levels[0].width, height: levels[0].height }).width;
  assert.equal(widths(level(4000, 3000), level(2000, 1500)), 4000);
  assert.equal(widths(level(4001, 3000), level(2000, 1500)), 2000);
  assert.equal(widths(level(16385, 100), level(8193, 50)), 8193);
  assert.equal(widths({ ...level(300, 300), perBand: 90000 }, level(150, 150)), 150);
  assert.throws(() => widths(level(100, 16385)), /^Error: x\.tif: 100 x 16385 cells and no smaller overview, expected at most 12000000 cells and 16384 on a side$/);
  assert.throws(() => widths({ ...level(300, 300), perBand: 90000 }), /^Error: x\.tif: 90000 tiles for a band/);
});

test('what was chosen last is shown; reads before it neither show nor fail', async () => {
  const two = (value) => tiffOf([tiled(4, 4, 16, { bands: 2 })], { data: Buffer.alloc(512, value) });
  const chosen = new ShownRaster((read) => read);
  /** A file whose bytes come when it is let go. */
  const slow = (blob) => {
    let go;
    const held = new Promise((done) => { go = done; });
    return { go, blob: { size: blob.size, slice: (...part) => ({ arrayBuffer: async () => { await held; return blob.slice(...part).arrayBuffer(); } }) } };
  };
  assert.equal(await chosen.openFile(two(1), 'one.tif'), true);
  assert.deepEqual([chosen.shown.raster.name, chosen.shown.cells[5], chosen.shown.band], ['one.tif', 1, 0]);
  for (const late of [two(2), new Blob([Buffer.alloc(40)])]) {
    const { go, blob } = slow(late);
    const first = chosen.openFile(blob, 'late.tif');
    assert.equal(await chosen.openFile(two(3), 'three.tif'), true);
    const { shown } = chosen;
    go();
    assert.equal(await first, false);
    assert.equal(chosen.shown, shown);
    assert.equal(shown.raster.name, 'three.tif');
  }
  const { shown } = chosen;
  await assert.rejects(chosen.openFile(new Blob([Buffer.alloc(40)]), 'bad.tif'), /^Error: bad\.tif: no TIFF file/);
  assert.equal(chosen.shown, shown);
  const [first, second] = [chosen.openBand(1), chosen.openBand(0)];
  assert.deepEqual([await first, await second, chosen.shown.band], [false, true, 0]);
});

test('a raster of a few cells is seen whole', () => {
  assert.equal(boundedZoom(300, 200), 200);
  assert.equal(boundedZoom(100, 200), 200);
  assert.equal(boundedZoom(100, 2), 60);
  assert.equal(boundedZoom(1, 2), 2);
});

test('a raster that is cut short, damaged or of another kind is refused by name', async () => {
  const whole = readFileSync(cases.rasters[2].file);
  const open = async (bytes) => {
    const raster = await openGeotiff(new Blob([bytes]), 'x.tif');
    return readBand(raster, raster.levels[0], 0);
  };
  await open(whole);
  for (const end of [0, 3, 7, 40, 900, whole.length - 1]) {
    await assert.rejects(open(whole.subarray(0, end)), /^Error: x\.tif: /, `${end} bytes`);
  }
  await assert.rejects(open(Buffer.from('%PDF-1.7, and then some')), /no TIFF file/);
  const bad = Buffer.from(whole);
  bad.fill(0x55, 100, 400);
  await assert.rejects(open(bad), /x\.tif: tile 0: damaged/);
});

test('a map of grouser-map has the bands, names and counts that its map.json has', { skip: cases.map === null && 'grouser-map was not built' }, async () => {
  const { folder, json } = cases.map;
  const read = async (name) => openGeotiff(blobOf(`${folder}/${name}`), name);
  const speed = await read('speed.tif');
  assert.deepEqual(speed.bands.map(({ name }) => name), json.bands);
  assert.equal(speed.bands[0].unit, 'm/s');
  assert.deepEqual([speed.width, speed.height], [json.grid.columns, json.grid.rows]);
  assert.deepEqual([speed.place.x, speed.place.dx, speed.place.y, speed.place.dy], [0, 1, 3, 5].map((i) => json.grid.geotransform[i]));
  const headings = await Promise.all(json.bands.map((_, i) => i).slice(3).map((i) => readBand(speed, speed.levels[0], i)));
  const cells = headings[0].map((_, i) => i);
  const holes = [...cells].filter((i) => headings.some((band) => Number.isNaN(band[i]))).length;
  assert.equal(holes, json.cells.holes);
  assert.equal([...cells].filter((i) => headings.every((band) => band[i] > 0)).length, json.cells.driven_on_all_headings);
  assert.equal([...cells].filter((i) => headings.every((band) => band[i] === 0)).length, json.cells.driven_on_none);
  const binding = await read('binding.tif');
  const names = Object.fromEntries(Object.entries(json.binding).filter(([value]) => value !== '255'));
  assert.deepEqual(Object.fromEntries([...binding.classes].filter(([value]) => value !== 255)), names);
  const bound = await readBand(binding, binding.levels[0], 0);
  assert.ok(bound.every((value) => Number.isNaN(value) || names[value] !== undefined));
});

test('colours: exact zeros apart, holes transparent', () => {
  const scale = scaleOf(Float32Array.of(0, 0.5, 1, NaN), null);
  assert.deepEqual([scale.low, scale.high, scale.hasZero], [0.5, 1, true]);
  const pixels = pixelsOf(Float32Array.of(0, 0.5, 1, NaN), scale);
  assert.deepEqual([...pixels.filter((_, i) => i % 4 === 3)], [255, 255, 255, 0]);
  assert.notDeepEqual([...pixels.slice(0, 3)], [...pixels.slice(4, 7)]);
  assert.deepEqual([scaleOf(Float32Array.of(-1, 0, 2), null).hasZero, scaleOf(Float32Array.of(-1, 0, 2), null).low], [false, -1]);
  assert.deepEqual(scaleOf(Float32Array.of(7, 2, 2, NaN), new Map([[2, 'A'], [7, 'B']])).values, [2, 7]);
});

test('colours: as many classes as a legend holds, else numbers', () => {
  const names = new Map([[0, 'none']]);
  const [few, many] = [256, 257].map((count) => Float32Array.from({ length: count }, (_, i) => i));
  const scale = scaleOf(few, names);
  assert.deepEqual([scale.values.length, scale.classes], [256, names]);
  assert.deepEqual(scale.colourOf(3), scale.colourOf(13));
  const { colourOf, ...without } = scaleOf(many, null);
  const { colourOf: ofClasses, ...of } = scaleOf(many, names);
  assert.deepEqual(of, without);
  assert.deepEqual([...many].map(ofClasses), [...many].map(colourOf));
});
