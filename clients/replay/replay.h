#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "clients/replay/answers.h"
#include "clients/replay/compare_bits.h"
#include "grouser/v1alpha1/query_log.pb.h"

namespace grouser::replay {

/// So many differences are kept, and so many refusals.
inline constexpr std::size_t kMostShown = 10;

struct Shown {
  std::string where;  ///< "FILE, query 3 (sequence 7)"
  Difference difference;
};

/// Queries that were not replayed for want of a model.
struct Missing {
  std::uint64_t queries = 0;
  std::string why;  ///< of the first one
};

struct Report {
  std::uint64_t queries = 0;           ///< that the logs hold
  std::uint64_t replayed = 0;          ///< of these
  std::uint64_t states = 0;            ///< of those that were replayed
  std::uint64_t differing_states = 0;  ///< any number of which has other bits
  std::uint64_t differing_queries = 0;
  std::uint64_t refused = 0;               ///< queries that no server would have logged so
  std::vector<Shown> first;                ///< differences, kMostShown of them
  std::vector<std::string> refusals;       ///< which and why, kMostShown of them
  std::map<std::string, Missing> missing;  ///< by model that is not there
  std::vector<std::string> damaged;        ///< files that are not whole, and why
  std::vector<std::string> cut_off;        ///< files that end in a record, as kills leave them
  std::vector<std::string> notes;

  /// But for ends that are cut off.
  bool all_equal() const {
    return differing_queries == 0 && refused == 0 && missing.empty() && damaged.empty();
  }
};

/// Evaluates logged queries again, each by the model that the log says answered, and compares bits:
/// outputs, intervals, echoes and flags of every state. Of a query with an accuracy request each
/// state is evaluated by the model that answered it, without the request; which model was chosen is
/// not compared, nor TOLERANCE_UNMET, for models are chosen by times that are measured. Of a query
/// over LCM what LCM carries is compared.
class Replay {
 public:
  /// `model`: "name@sha256:HEX" of one that evaluates all queries instead; empty: none.
  Replay(Answers& answers, std::string model) : answers_(answers), model_(std::move(model)) {}

  /// Adds one file. Throws std::runtime_error as QueryLogReader's constructor, and where a server
  /// cannot be asked.
  void Add(const std::string& path);
  const Report& report() const { return report_; }

 private:
  void AddQuery(const v1alpha1::LoggedQuery& query, const std::string& where);
  /// Models, and the states that each is to evaluate.
  std::map<std::string, std::vector<bool>> EvaluatorsOf(
      const v1alpha1::EvaluateWheelsResponse& logged) const;
  /// Where the slip form has no speeds, the model that was named gave them, whoever answered: fills
  /// them in. Whether it did.
  bool SetSpeeds(const std::string& named, v1alpha1::WheelStates* states);
  void Compare(const v1alpha1::LoggedQuery& query, const std::string& where);

  Answers& answers_;
  std::string model_;
  Report report_;
};

}  // namespace grouser::replay
