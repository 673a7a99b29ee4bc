#include "server/jobs/job_store.h"

#include <stdexcept>

namespace grouser::server {
namespace {

constexpr char kSchema[] = R"sql(
CREATE TABLE jobs (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  job_id TEXT NOT NULL UNIQUE,
  join_key TEXT NOT NULL,
  state INTEGER NOT NULL,
  lease_epoch INTEGER NOT NULL,
  retries INTEGER NOT NULL,
  job BLOB NOT NULL,
  spec BLOB NOT NULL,
  pending BLOB NOT NULL
);
CREATE INDEX jobs_state ON jobs (state, seq);
CREATE TABLE requests (
  request_id TEXT PRIMARY KEY,
  job_id TEXT NOT NULL REFERENCES jobs (job_id),
  content TEXT NOT NULL,
  joined INTEGER NOT NULL,
  withdrawn INTEGER NOT NULL
);
CREATE INDEX requests_job ON requests (job_id);
)sql";

constexpr char kColumns[] = "join_key, retries, job, spec, pending";

/// Columns as in kColumns.
JobRow ReadRow(const Statement& row, const std::string& path) {
  JobRow out;
  out.join_key = row.ColumnBytes(0);
  out.retries = static_cast<int>(row.ColumnInt(1));
  if (!out.job.ParseFromString(row.ColumnBytes(2)) ||
      !out.spec.ParseFromString(row.ColumnBytes(3)) ||
      !out.pending.ParseFromString(row.ColumnBytes(4))) {
    throw std::runtime_error(path + ": a job row is damaged, expected serialised messages");
  }
  return out;
}

}  // namespace

JobStore::JobStore(const std::string& path) : db_(path) { Migrate(); }

void JobStore::Migrate() {
  std::int64_t version = 0;
  {
    Statement query(db_, "PRAGMA user_version");
    if (query.Step()) version = query.ColumnInt(0);
  }
  if (version == kSchemaVersion) return;
  if (version != 0) {
    throw std::runtime_error(db_.path() + ": schema version " + std::to_string(version) +
                             ", expected " + std::to_string(kSchemaVersion) +
                             " (made by another Grouser version)");
  }
  Transaction transaction(db_);
  db_.Exec(kSchema);
  db_.Exec("PRAGMA user_version=" + std::to_string(kSchemaVersion));
  transaction.Commit();
}

void JobStore::Insert(const JobRow& row, const RequestRow& request) {
  Transaction transaction(db_);
  Statement(db_,
            "INSERT INTO jobs (job_id, join_key, state, lease_epoch, retries, job, spec, pending)"
            " VALUES (?,?,?,?,?,?,?,?)")
      .Text(1, row.job.job_id())
      .Text(2, row.join_key)
      .Int(3, row.job.job_state())
      .Int(4, static_cast<std::int64_t>(row.job.lease_epoch()))
      .Int(5, row.retries)
      .Blob(6, row.job.SerializeAsString())
      .Blob(7, row.spec.SerializeAsString())
      .Blob(8, row.pending.SerializeAsString())
      .Step();
  InsertRequest(request);
  transaction.Commit();
}

void JobStore::InsertRequest(const RequestRow& request) {
  Statement(db_, "INSERT INTO requests VALUES (?,?,?,?,?)")
      .Text(1, request.request_id)
      .Text(2, request.job_id)
      .Text(3, request.content)
      .Int(4, request.joined)
      .Int(5, request.withdrawn)
      .Step();
}

bool JobStore::Update(const JobRow& row, std::uint64_t held_epoch) {
  Statement(db_,
            "UPDATE jobs SET state=?, lease_epoch=?, retries=?, job=?, pending=?"
            " WHERE job_id=? AND lease_epoch=?")
      .Int(1, row.job.job_state())
      .Int(2, static_cast<std::int64_t>(row.job.lease_epoch()))
      .Int(3, row.retries)
      .Blob(4, row.job.SerializeAsString())
      .Blob(5, row.pending.SerializeAsString())
      .Text(6, row.job.job_id())
      .Int(7, static_cast<std::int64_t>(held_epoch))
      .Step();
  return db_.Changes() == 1;
}

void JobStore::Join(const JobRow& row, const RequestRow& request) {
  Transaction transaction(db_);
  if (!Update(row, row.job.lease_epoch())) {
    throw std::runtime_error(db_.path() + ": job " + row.job.job_id() +
                             " is not stored under its lease epoch");
  }
  InsertRequest(request);
  transaction.Commit();
}

bool JobStore::Withdraw(const JobRow& row, std::uint64_t held_epoch,
                        const std::string& request_id) {
  Transaction transaction(db_);
  if (!Update(row, held_epoch)) return false;
  Statement(db_, "UPDATE requests SET withdrawn=1 WHERE request_id=?").Text(1, request_id).Step();
  transaction.Commit();
  return true;
}

bool JobStore::Save(const JobRow& row, std::uint64_t held_epoch) {
  Transaction transaction(db_);
  if (!Update(row, held_epoch)) return false;
  transaction.Commit();
  return true;
}

std::optional<RequestRow> JobStore::FindRequest(const std::string& request_id) {
  Statement query(db_,
                  "SELECT job_id, content, joined, withdrawn FROM requests WHERE request_id=?");
  query.Text(1, request_id);
  if (!query.Step()) return std::nullopt;
  return RequestRow{request_id, query.ColumnBytes(0), query.ColumnBytes(1), query.ColumnInt(2) != 0,
                    query.ColumnInt(3) != 0};
}

std::optional<JobRow> JobStore::Find(const std::string& job_id) {
  Statement query(db_, std::string("SELECT ") + kColumns + " FROM jobs WHERE job_id=?");
  query.Text(1, job_id);
  if (!query.Step()) return std::nullopt;
  return ReadRow(query, db_.path());
}

std::uint32_t JobStore::CountSubscribers(const std::string& job_id) {
  Statement query(db_, "SELECT COUNT(*) FROM requests WHERE job_id=? AND withdrawn=0");
  query.Text(1, job_id);
  query.Step();
  return static_cast<std::uint32_t>(query.ColumnInt(0));
}

std::vector<JobRow> JobStore::LoadOpen() {
  using v1alpha1::JobState;
  Statement query(db_, std::string("SELECT ") + kColumns +
                           " FROM jobs WHERE state NOT IN (?,?,?) ORDER BY seq");
  query.Int(1, JobState::JOB_STATE_DONE)
      .Int(2, JobState::JOB_STATE_FAILED)
      .Int(3, JobState::JOB_STATE_CANCELLED);
  std::vector<JobRow> rows;
  while (query.Step()) rows.push_back(ReadRow(query, db_.path()));
  return rows;
}

std::vector<v1alpha1::Job> JobStore::List(std::uint32_t limit) {
  Statement query(db_, "SELECT job FROM jobs ORDER BY seq DESC LIMIT ?");
  query.Int(1, limit);
  std::vector<v1alpha1::Job> jobs;
  while (query.Step()) {
    if (!jobs.emplace_back().ParseFromString(query.ColumnBytes(0))) {
      throw std::runtime_error(db_.path() + ": a job row is damaged");
    }
  }
  return jobs;
}

}  // namespace grouser::server
