// The page of grouser-jobs: what runs, how far it is, what its gate found; promotion by buttons.

import { Aliases } from './aliases.js';
import { call } from './api.js';
import { decide } from './decide.js';
import { byId, element, latest, replaceInPlace, scrolled, table } from './dom.js';
import { duration, enumWord, format, moment, percent, shortDigest, toDegrees, toNumber } from './format.js';

const OPEN = ['queued', 'running', 'fitting', 'validating'];
const OPEN_EVERY_MS = 2000;
const QUIET_EVERY_MS = 10000;
const ALIASES_EVERY_MS = 30000;  // and where a job has changed
const STEP = 25;  // jobs; what is shown is one call
const MOST = 500;

function titleOf(job) {
  if (job.campaign) return `Campaign ${job.campaign.file}, ${job.campaign.runs} runs`;
  if (job.calibration) return `Calibration of ${enumWord('CALIBRATION_KIND_', job.calibration.kind)} with ${job.calibration.data}`;
  return `Refinement of ${job.model.replace(/(@sha256:.{12}).*/, '$1')}`;
}

function stateText({ state, seed }) {
  if (!state) return null;
  return `slip ${format(toNumber(state.slip), 4)}, attack angle ${format(toDegrees(toNumber(state.attack_angle_rad)), 4)} deg, ` +
    `load ${format(toNumber(state.load_n), 4)} N, seed ${seed}`;
}

/** {number, limit, words} of a check's detail (surrogate/fit/gate.cc): "0.81, at most 1.1: WORDS"; else words alone. */
export function readCheck({ detail }) {
  const found = /^(\S+), (at (?:most|least) \S+): (.*)$/s.exec(detail);
  return found === null ? { number: '–', limit: '–', words: detail } : { number: found[1], limit: found[2], words: found[3] };
}

function gateTable(gate) {
  const passed = (check) => element('span', { class: check.passed ? 'passed' : 'failed' }, check.passed ? 'passed' : 'FAILED');
  return table(['gate check', 'result', 'number', 'limit', 'of what'], gate.map((check) => {
    const { number, limit, words } = readCheck(check);
    return [check.name, passed(check), number, limit, words];
  }), { class: 'gate' });
}

/** What is asked before the candidate of a job is promoted. */
export function promoteQuestion(job, alias) {
  const name = `${job.model.replace(/@.*/, '')}@${alias}`;
  return {
    title: `Promote to ${name}`,
    text: `${name} will be the candidate ${shortDigest(job.candidate_digest)} of job ${job.job_id}. Were the job to have another one ` +
      'by then, the server would refuse. Query servers of this state folder follow at once.',
    method: 'Promote', message: { job_id: job.job_id, alias, candidate_digest: job.candidate_digest },
  };
}

/** Buttons where a candidate waits; words where its gate stops it. */
function promotionPart(job, changed) {
  if (job.job_state !== 'JOB_STATE_AWAITING_PROMOTION') return null;
  if (job.gate.length === 0 || !job.gate.every((check) => check.passed)) {
    return element('p', {}, 'The gate stops this candidate. By hand all the same, with the role admin: ',
      element('code', {}, `./grouser jobs promote ${job.job_id} --candidate ${shortDigest(job.candidate_digest)} --override-gate --who WHO --why WHY`), '.');
  }
  const button = (alias) => element('button', {
    type: 'button', 'data-promote': alias, click: () => decide({ ...promoteQuestion(job, alias), done: changed }),
  }, `Promote to ${alias} ...`);
  return element('p', {}, button('canary'), ' ', button('stable'));
}

function jobArticle(job, changed) {
  const state = enumWord('JOB_STATE_', job.job_state);
  const progress = toNumber(job.progress);
  const isOpen = OPEN.includes(state);
  const rows = [
    ['state', state + (job.eta && isOpen ? `, about ${duration(job.eta)} left of this stage` : '')],
    isOpen ? ['progress of the stage', element('progress', { max: '1', value: String(progress), 'aria-label': 'progress of the stage' }),
      ` ${percent(progress)}`] : null,
    job.message ? ['message', job.message] : null,
    stateText(job) ? ['wheel state', stateText(job)] : null,
    job.candidate_digest ? ['candidate', element('code', {}, shortDigest(job.candidate_digest))] : null,
    ['asked by', `${job.who || 'unknown'}, ${moment(job.submit_time)}; last change ${moment(job.update_time)}`],
  ];
  return element('article', { class: 'job', 'aria-labelledby': `job-${job.job_id}` },
    element('h3', { id: `job-${job.job_id}` }, `${titleOf(job)} `, element('code', {}, job.job_id)),
    table([], rows.filter((row) => row !== null).map(([name, ...text]) => [name, element('span', {}, text)]), { class: 'facts' }),
    job.gate.length > 0 ? scrolled(`Gate of ${job.job_id}`, gateTable(job.gate)) : null,
    promotionPart(job, changed));
}

/** How long until the jobs are asked again: soon while something runs. */
export const jobsPeriodMs = (jobs) =>
  (jobs.some((job) => OPEN.includes(enumWord('JOB_STATE_', job.job_state))) ? OPEN_EVERY_MS : QUIET_EVERY_MS);

export class Jobs {
  constructor(onError) {
    this.everyMs = OPEN_EVERY_MS;
    this.count = STEP;
    this.articles = new Map();  // by id: {text, node}
    const changed = () => {
      this.aliasesDue = 0;
      this.refresh();
    };
    this.changed = changed;
    this.aliases = new Aliases(changed);
    this.aliasesDue = 0;
    byId('jobs-older').addEventListener('click', () => {
      this.count += STEP;
      this.refresh();
    });
    this.refresh = latest(async () => {
      try {
        await this.#ask();
        onError(null);
      } catch (error) {
        onError(error);
      }
    });
  }

  async #ask() {
    const { jobs, next_page_token: more } = await call('JobsService', 'ListJobs', { page_size: this.count });
    this.everyMs = jobsPeriodMs(jobs);
    const isOther = this.#show(jobs);
    byId('jobs-older').hidden = !more || this.count >= MOST;
    byId('jobs-note').textContent = `The latest ${jobs.length}, newest first; asked again every ${this.everyMs / 1000} s` +
      `${more && this.count >= MOST ? '; older ones: ./grouser jobs jobs' : ''}.`;
    if (!isOther && Date.now() < this.aliasesDue) return;
    await this.aliases.refresh();
    this.aliasesDue = Date.now() + ALIASES_EVERY_MS;
  }

  /** What has not changed keeps its elements: what somebody reads or has focused stays. Whether a job is in another state. */
  #show(jobs) {
    let isOther = false;
    const shown = new Map();
    for (const job of jobs) {
      const text = JSON.stringify(job);
      const before = this.articles.get(job.job_id);
      isOther ||= before?.state !== job.job_state;
      shown.set(job.job_id, before?.text === text ? before : { text, state: job.job_state, node: jobArticle(job, this.changed) });
    }
    this.articles = shown;
    const nodes = jobs.length > 0 ? [...shown.values()].map(({ node }) => node) :
      [element('p', {}, 'No jobs. ./grouser jobs submit asks for one.')];
    const place = byId('job-list');
    const isSame = jobs.length > 0 && nodes.length === place.childNodes.length && nodes.every((node, i) => node === place.childNodes[i]);
    if (!isSame) replaceInPlace(place, nodes);
    return isOther;
  }
}
