// Run by web_modules_test.py beside the page's modules, with what the programs said in cases.json.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';

import { latestMoves } from './aliases.js';
import { nearRows, nearRuns } from './curves.js';
import { allRuns, isCovered, stressText, varianceShares } from './explain_parts.js';
import { OUTPUTS } from './format.js';
import { openGeotiff, readBand, readMetadata } from './geotiff.js';
import { jobsPeriodMs, readCheck } from './jobs.js';
import { pixelsOf, scaleOf } from './map_colours.js';
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
        assert.ok(Math.abs(Number(peak[2]) - Number(ours[2])) <= 1, `${lines[2]}: ${ours[0]}`);
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
  assert.deepEqual([items, bands], [{ BINDING_2: 'R & D' }, [{ unittype: 'm/s' }, { description: '<c>' }]]);
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
  assert.deepEqual(Object.fromEntries(Object.entries(binding.classes).filter(([value]) => value !== '255')), names);
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
  assert.deepEqual(scaleOf(Float32Array.of(7, 2, 2, NaN), { 2: 'A', 7: 'B' }).values, [2, 7]);
});
