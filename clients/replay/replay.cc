#include "clients/replay/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server/core/evaluator.h"
#include "server/query/log/query_log_reader.h"
#include "surrogate/models/isa.h"

namespace grouser::replay {
namespace {

using server::QueryLogReader;
using v1alpha1::EvaluateWheelsRequest;
using v1alpha1::EvaluateWheelsResponse;
using v1alpha1::LoggedQuery;

/// More models are not selected among: what a log may make a replay do is bounded.
constexpr int kMostSelectable = 1000;

/// Why no server would have logged that; empty: one might have.
std::string WhyNoQuery(const LoggedQuery& query) {
  const int asked = query.request().states().load_n_size();
  const int answered = query.response().responses().flags_size();
  const int models = query.response().selectable_models_size();
  if (asked != answered) return fmt::format("{} states, {} answers", asked, answered);
  if (asked > server::kMaxStates) {
    return fmt::format("{} states, expected at most {}", asked, server::kMaxStates);
  }
  if (models > kMostSelectable) {
    return fmt::format("{} models to select among, expected at most {}", models, kMostSelectable);
  }
  return "";
}

/// Which states which model answered.
std::map<std::string, std::vector<bool>> AnsweredBy(const EvaluateWheelsResponse& response) {
  const int n = response.responses().flags_size();
  std::map<std::string, std::vector<bool>> by_model;
  if (response.answered_by().empty()) {
    by_model[response.model()].assign(n, true);
    return by_model;
  }
  for (int i = 0; i < n; ++i) {
    const auto k = i < response.answered_by_size() ? response.answered_by(i) : UINT32_MAX;
    if (k >= static_cast<std::uint32_t>(response.selectable_models_size())) {
      throw Refused(fmt::format("answered_by[{}]: names no model of the logged answer", i));
    }
    auto& states = by_model[response.selectable_models(static_cast<int>(k))];
    states.resize(n);
    states[i] = true;
  }
  return by_model;
}

}  // namespace

void Replay::Add(const std::string& path) {
  QueryLogReader reader(path);
  const auto& server = reader.header().server();
  if (const std::string here = surrogate::BestIsa(); server.instruction_set() != here) {
    report_.notes.push_back(
        fmt::format("{}: was answered with the instruction set {}, here it is {}", path,
                    server.instruction_set(), here));
  }
  if (server.version() != GROUSER_VERSION) {
    report_.notes.push_back(fmt::format("{}: was answered by version {}, this is " GROUSER_VERSION,
                                        path, server.version()));
  }
  LoggedQuery query;
  for (std::uint64_t number = 1; reader.Next(&query); ++number) {
    AddQuery(query,
             fmt::format("{}, query {} (sequence {})", path, number, query.request().sequence()));
  }
  if (reader.end() == QueryLogReader::End::kCutOff) {
    report_.cut_off.push_back(reader.problem() + " (a kill leaves such: see --allow-cut-tail)");
  }
  if (reader.end() == QueryLogReader::End::kDamaged) report_.damaged.push_back(reader.problem());
}

std::map<std::string, std::vector<bool>> Replay::EvaluatorsOf(
    const EvaluateWheelsResponse& logged) const {
  if (model_.empty()) return AnsweredBy(logged);
  return {{model_, std::vector<bool>(logged.responses().flags_size(), true)}};
}

bool Replay::SetSpeeds(const std::string& named, v1alpha1::WheelStates* states) {
  if (!states->has_slip() || !states->slip().speed_m_per_s().empty()) return false;
  const double speed = answers_.TrainingSpeed(named);
  for (int i = 0; i < states->load_n_size(); ++i) {
    states->mutable_slip()->add_speed_m_per_s(speed);
  }
  return true;
}

void Replay::AddQuery(const LoggedQuery& query, const std::string& where) {
  ++report_.queries;
  if (const std::string why = WhyNoQuery(query); !why.empty()) {
    ++report_.refused;
    if (report_.refusals.size() < kMostShown) report_.refusals.push_back(where + ": " + why);
    return;
  }
  try {
    Compare(query, where);
  } catch (const NoModel& e) {
    Missing& missing = report_.missing[e.model];
    if (missing.queries++ == 0) missing.why = e.what();
  }
}

void Replay::Compare(const LoggedQuery& query, const std::string& where) {
  EvaluateWheelsResponse logged = query.response();
  EvaluateWheelsRequest request = query.request();
  const bool selected = !logged.selectable_models().empty();
  request.clear_accuracy();
  std::vector<std::pair<std::vector<bool>, EvaluateWheelsResponse>> now;
  std::string refusal;
  try {
    const bool given_speeds = selected && SetSpeeds(logged.model(), request.mutable_states());
    for (const auto& [reference, states] : EvaluatorsOf(logged)) {
      request.set_model(reference);
      now.emplace_back(states, answers_.Answer(request));
      // Of invalid states the echo has what was asked, and no speed was.
      if (given_speeds)
        now.back().second.mutable_responses()->mutable_slip()->clear_speed_m_per_s();
    }
    if (given_speeds) logged.mutable_responses()->mutable_slip()->clear_speed_m_per_s();
  } catch (const Refused& e) {
    refusal = e.what();
  }
  ++report_.replayed;
  report_.states += logged.responses().flags_size();
  std::vector<bool> differs(logged.responses().flags_size());
  bool any = false;
  const auto tell = [&](Difference difference) {
    any = true;
    if (difference.state >= 0) {
      differs[difference.state] = true;
    } else {
      differs.assign(differs.size(), true);
    }
    if (report_.first.size() < kMostShown) report_.first.push_back({where, std::move(difference)});
  };
  if (!refusal.empty()) tell({"answer", -1, "an answer", refusal});
  for (const auto& [states, answer] : now) {
    Comparison comparison{states};
    const bool of_lcm = query.transport() == v1alpha1::QUERY_TRANSPORT_LCM;  // which carries less
    comparison.whole_message = !selected && model_.empty() && !of_lcm;
    comparison.of_lcm = of_lcm;
    if (selected) comparison.ignored_flags = v1alpha1::STATE_FLAG_TOLERANCE_UNMET;
    CompareBits(logged.responses(), answer.responses(), comparison, tell);
  }
  report_.differing_queries += any;
  report_.differing_states += std::ranges::count(differs, true);
}

}  // namespace grouser::replay
