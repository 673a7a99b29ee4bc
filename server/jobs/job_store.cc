#include "server/jobs/job_store.h"

#include <spdlog/spdlog.h>

#include <limits>
#include <stdexcept>
#include <utility>

#include "proto/records/model_file.h"

namespace grouser::server {
namespace {

/// Takes the write lock at once; rolls back unless committed.
struct Transaction : SQLite::Transaction {
  explicit Transaction(SQLite::Database& db)
      : SQLite::Transaction(db, SQLite::TransactionBehavior::IMMEDIATE) {}
};

struct DamagedRow : std::runtime_error {
  using std::runtime_error::runtime_error;
};

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

constexpr char kColumns[] = "join_key, retries, job, spec, pending, job_id, state, lease_epoch";

std::string Bytes(SQLite::Statement& row, int column) { return row.getColumn(column).getString(); }

std::int64_t Signed(std::uint64_t number) { return static_cast<std::int64_t>(number); }

void BindBlob(SQLite::Statement& statement, int index, const google::protobuf::Message& message) {
  const std::string bytes = message.SerializeAsString();
  statement.bind(index, bytes.data(), static_cast<int>(bytes.size()));  // SQLite copies them
}

/// Rows of versions before 0.2 have their times as seconds.
void Upgrade(v1alpha1::Job* job) {
  if (job->submitted_unix_s() == 0) return;
  *job->mutable_submit_time() = records::TimestampOf(job->submitted_unix_s());
  *job->mutable_update_time() = records::TimestampOf(job->changed_unix_s());
  job->clear_submitted_unix_s();
  job->clear_changed_unix_s();
}

/// Columns as in kColumns. Throws DamagedRow.
JobRow ReadRow(SQLite::Statement& row, const std::string& path) {
  JobRow out;
  out.join_key = Bytes(row, 0);
  out.retries = row.getColumn(1).getInt();
  const std::string id = Bytes(row, 5);
  // Bytes that are lost may leave messages that parse: the columns must agree.
  if (!out.job.ParseFromString(Bytes(row, 2)) || !out.spec.ParseFromString(Bytes(row, 3)) ||
      !out.pending.ParseFromString(Bytes(row, 4)) || out.job.job_id() != id ||
      out.job.job_state() != row.getColumn(6).getInt64() ||
      Signed(out.job.lease_epoch()) != row.getColumn(7).getInt64()) {
    throw DamagedRow(path + ": the row of job '" + id +
                     "' is damaged, expected serialised messages that agree with its columns");
  }
  try {
    Upgrade(&out.job);
  } catch (const std::invalid_argument& e) {
    throw DamagedRow(path + ": the row of job '" + id + "': " + e.what());
  }
  return out;
}

}  // namespace

JobStore::JobStore(const std::string& path) : db_(os::OpenDatabase(path)) { Migrate(); }

void JobStore::Migrate() {
  const int version = db_.execAndGet("PRAGMA user_version").getInt();
  if (version == kSchemaVersion) return;
  if (version != 0) {
    throw std::runtime_error(Path() + ": schema version " + std::to_string(version) +
                             ", expected " + std::to_string(kSchemaVersion) +
                             " (made by another Grouser version)");
  }
  Transaction transaction(db_);
  db_.exec(kSchema);
  db_.exec("PRAGMA user_version=" + std::to_string(kSchemaVersion));
  transaction.commit();
}

void JobStore::Insert(const JobRow& row, const RequestRow& request) {
  Transaction transaction(db_);
  SQLite::Statement insert(
      db_,
      "INSERT INTO jobs (job_id, join_key, state, lease_epoch, retries, job, spec, pending)"
      " VALUES (?,?,?,?,?,?,?,?)");
  SQLite::bind(insert, row.job.job_id(), row.join_key, static_cast<int>(row.job.job_state()),
               Signed(row.job.lease_epoch()), row.retries);
  BindBlob(insert, 6, row.job);
  BindBlob(insert, 7, row.spec);
  BindBlob(insert, 8, row.pending);
  insert.exec();
  InsertRequest(request);
  transaction.commit();
}

void JobStore::InsertRequest(const RequestRow& request) {
  SQLite::Statement insert(db_, "INSERT INTO requests VALUES (?,?,?,?,?)");
  SQLite::bind(insert, request.request_id, request.job_id, request.content,
               static_cast<int>(request.joined), static_cast<int>(request.withdrawn));
  insert.exec();
}

bool JobStore::Update(const JobRow& row, std::uint64_t held_epoch) {
  SQLite::Statement update(
      db_,
      "UPDATE jobs SET state=?1, lease_epoch=?2, retries=?3, job=?5, pending=?6"
      " WHERE job_id=?4 AND lease_epoch=?7");
  SQLite::bind(update, static_cast<int>(row.job.job_state()), Signed(row.job.lease_epoch()),
               row.retries, row.job.job_id());
  BindBlob(update, 5, row.job);
  BindBlob(update, 6, row.pending);
  update.bind(7, Signed(held_epoch));
  return update.exec() == 1;
}

void JobStore::Join(const JobRow& row, const RequestRow& request) {
  Transaction transaction(db_);
  if (!Update(row, row.job.lease_epoch())) {
    throw std::runtime_error(Path() + ": job " + row.job.job_id() +
                             " is not stored under its lease epoch");
  }
  InsertRequest(request);
  transaction.commit();
}

bool JobStore::Withdraw(const JobRow& row, std::uint64_t held_epoch,
                        const std::string& request_id) {
  Transaction transaction(db_);
  if (!Update(row, held_epoch)) return false;
  SQLite::Statement update(db_, "UPDATE requests SET withdrawn=1 WHERE request_id=?");
  update.bind(1, request_id);
  update.exec();
  transaction.commit();
  return true;
}

bool JobStore::Save(const JobRow& row, std::uint64_t held_epoch) {
  Transaction transaction(db_);
  if (!Update(row, held_epoch)) return false;
  transaction.commit();
  return true;
}

std::optional<RequestRow> JobStore::FindRequest(const std::string& request_id) {
  SQLite::Statement query(
      db_, "SELECT job_id, content, joined, withdrawn FROM requests WHERE request_id=?");
  query.bind(1, request_id);
  if (!query.executeStep()) return std::nullopt;
  return RequestRow{request_id, Bytes(query, 0), Bytes(query, 1), query.getColumn(2).getInt() != 0,
                    query.getColumn(3).getInt() != 0};
}

std::optional<JobRow> JobStore::Find(const std::string& job_id) {
  SQLite::Statement query(db_, std::string("SELECT ") + kColumns + " FROM jobs WHERE job_id=?");
  query.bind(1, job_id);
  if (!query.executeStep()) return std::nullopt;
  return ReadRow(query, Path());
}

std::map<v1alpha1::JobState, std::size_t> JobStore::CountByState() {
  std::map<v1alpha1::JobState, std::size_t> counts;
  SQLite::Statement query(db_, "SELECT state, COUNT(*) FROM jobs GROUP BY state");
  while (query.executeStep()) {
    const int state = query.getColumn(0).getInt();
    if (v1alpha1::JobState_IsValid(state)) {
      counts[static_cast<v1alpha1::JobState>(state)] =
          static_cast<std::size_t>(query.getColumn(1).getInt64());
    }
  }
  return counts;
}

std::uint32_t JobStore::CountSubscribers(const std::string& job_id) {
  SQLite::Statement query(db_, "SELECT COUNT(*) FROM requests WHERE job_id=? AND withdrawn=0");
  query.bind(1, job_id);
  query.executeStep();
  return query.getColumn(0).getUInt();
}

std::vector<JobRow> JobStore::ReadRows(SQLite::Statement& query, std::size_t limit) const {
  std::vector<JobRow> rows;
  while (rows.size() < limit && query.executeStep()) {
    try {
      rows.push_back(ReadRow(query, Path()));
    } catch (const DamagedRow& e) {
      spdlog::error("{}; it is passed over, and stays as it is", e.what());
    }
  }
  return rows;
}

std::vector<JobRow> JobStore::LoadOpen() {
  using v1alpha1::JobState;
  SQLite::Statement query(db_, std::string("SELECT ") + kColumns +
                                   " FROM jobs WHERE state NOT IN (?,?,?) ORDER BY seq");
  SQLite::bind(query, static_cast<int>(JobState::JOB_STATE_DONE),
               static_cast<int>(JobState::JOB_STATE_FAILED),
               static_cast<int>(JobState::JOB_STATE_CANCELLED));
  return ReadRows(query);
}

void JobStore::ForEach(const std::function<void(const v1alpha1::Job&, std::uint64_t)>& visit) {
  SQLite::Statement query(db_, std::string("SELECT ") + kColumns + " FROM jobs ORDER BY seq");
  while (query.executeStep()) {
    std::uint64_t bytes = 0;
    for (int column = 2; column < 5; ++column) bytes += query.getColumn(column).getBytes();
    visit(ReadRow(query, Path()).job, bytes);
  }
}

void JobStore::Remove(const std::string& job_id) {
  Transaction transaction(db_);
  SQLite::Statement requests(db_,
                             "DELETE FROM requests WHERE job_id IN"
                             " (SELECT job_id FROM jobs WHERE job_id=?1 AND state IN (?2,?3,?4))");
  SQLite::Statement job(db_, "DELETE FROM jobs WHERE job_id=?1 AND state IN (?2,?3,?4)");
  for (SQLite::Statement* statement : {&requests, &job}) {
    SQLite::bind(*statement, job_id, static_cast<int>(v1alpha1::JOB_STATE_DONE),
                 static_cast<int>(v1alpha1::JOB_STATE_FAILED),
                 static_cast<int>(v1alpha1::JOB_STATE_CANCELLED));
    statement->exec();
  }
  transaction.commit();
}

void JobStore::Compact() {
  const int free = db_.execAndGet("PRAGMA freelist_count").getInt();
  const int all = db_.execAndGet("PRAGMA page_count").getInt();
  if (free > all / 4) db_.exec("VACUUM");
}

std::optional<std::vector<v1alpha1::Job>> JobStore::List(std::size_t limit,
                                                         const std::string& before) {
  std::int64_t end = std::numeric_limits<std::int64_t>::max();
  if (!before.empty()) {
    SQLite::Statement place(db_, "SELECT seq FROM jobs WHERE job_id=?");
    place.bind(1, before);
    if (!place.executeStep()) return std::nullopt;
    end = place.getColumn(0).getInt64();
  }
  SQLite::Statement query(
      db_, std::string("SELECT ") + kColumns + " FROM jobs WHERE seq<? ORDER BY seq DESC");
  query.bind(1, end);
  std::vector<v1alpha1::Job> jobs;
  for (auto& row : ReadRows(query, limit)) jobs.push_back(std::move(row.job));
  return jobs;
}

}  // namespace grouser::server
