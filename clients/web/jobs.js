// The page of grouser-jobs: what runs, how far it is, what its gate found.

import { listAll } from './api.js';
import { byId, element, latest, scrolled, table } from './dom.js';
import { duration, enumWord, format, moment, percent, shortDigest, toDegrees, toNumber } from './format.js';

const OPEN = ['queued', 'running', 'fitting', 'validating'];

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

function gateTable(gate) {
  const passed = (check) => element('span', { class: check.passed ? 'passed' : 'failed' }, check.passed ? 'passed' : 'FAILED');
  return table(['gate check', 'result', 'detail'], gate.map((check) => [check.name, passed(check), check.detail]), { class: 'gate' });
}

function jobArticle(job) {
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
    job.gate.length > 0 ? scrolled(`Gate of ${job.job_id}`, gateTable(job.gate)) : null);
}

export class Jobs {
  constructor(onError) {
    this.refresh = latest(async () => {
      try {
        const { entries } = await listAll('JobsService', 'ListJobs', 'jobs');
        this.#show(entries);
        onError(null);
      } catch (error) {
        onError(error);
      }
    });
  }

  #show(jobs) {
    const text = JSON.stringify(jobs);
    if (text === this.shown) return;  // what somebody reads or has selected stays
    this.shown = text;
    byId('job-list').replaceChildren(...(jobs.length > 0 ? jobs.map(jobArticle) :
      [element('p', {}, 'No jobs. ./grouser jobs submit asks for one.')]));
  }
}
