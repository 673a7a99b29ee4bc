#include "tests/bench/latency_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>

#include "clients/cpp/lcm_client.h"
#include "clients/cpp/terrain_client.h"

namespace grouser::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kQueryBatches[] = {1, 4, 100, 10000};
constexpr int kMaxLcmStates = 64;
constexpr int kMinSamples = 30;
constexpr client::Milliseconds kLcmTimeout(200);

/// One transport at one batch size; `call` makes one round trip and says
/// whether an answer came.
struct Cell {
  LatencyRow row;
  int calls_per_round = 1;
  std::function<bool()> call;
  std::vector<double> microseconds;
};

/// Random states inside the model's domain, as velocities.
v1alpha1::WheelStates RandomStates(const v1alpha1::Domain& domain, int n, std::mt19937& random) {
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const double speed = domain.speed_m_per_s() > 0 ? domain.speed_m_per_s() : 0.1;
  v1alpha1::WheelStates states;
  auto* velocity = states.mutable_velocity();
  for (int i = 0; i < n; ++i) {
    const double angle = draw(-1, 1) * domain.attack_angle_max_rad();
    velocity->add_v_x_m_per_s(draw(0.2, 1) * speed * std::cos(angle));
    velocity->add_v_y_m_per_s(draw(0.2, 1) * speed * std::sin(angle));
    velocity->add_rim_speed_m_per_s(draw(0.2, 1) * speed);
    states.add_load_n(draw(domain.load_min_n(), domain.load_max_n()));
  }
  return states;
}

v1alpha1::Domain DomainOf(const client::TerrainClient& client, const std::string& reference) {
  const std::string name = reference.substr(0, reference.find('@'));
  const auto listing = client.ListModels();
  for (const auto& model : listing.models()) {
    if (name.empty() || model.name() == name) return model.domain();
  }
  throw std::runtime_error("the server has no model '" + name + "'");
}

grouser_lcm::wheel_query_t ToLcm(const std::string& model, const v1alpha1::WheelStates& states) {
  const auto copy = [](const auto& field) {
    return std::vector<double>(field.begin(), field.end());
  };
  grouser_lcm::wheel_query_t query;
  query.model = model;
  query.n = states.load_n_size();
  query.v_x = copy(states.velocity().v_x_m_per_s());
  query.v_y = copy(states.velocity().v_y_m_per_s());
  query.rim_speed = copy(states.velocity().rim_speed_m_per_s());
  query.load = copy(states.load_n());
  return query;
}

Cell UnaryCell(const client::TerrainClient& client,
               const v1alpha1::EvaluateWheelsRequest& request) {
  Cell cell;
  cell.row.transport = "grpc_unary";
  auto response = std::make_shared<v1alpha1::EvaluateWheelsResponse>();
  cell.call = [&client, request, response] {
    client.Evaluate(request, response.get());
    return true;
  };
  return cell;
}

Cell StreamCell(client::WheelStreamSession& stream,
                const v1alpha1::EvaluateWheelsRequest& request) {
  Cell cell;
  cell.row.transport = "grpc_stream";
  auto response = std::make_shared<v1alpha1::EvaluateWheelsResponse>();
  cell.call = [&stream, request, response] {
    if (!stream.Send(request) || !stream.Receive(response.get())) {
      stream.Finish();
      throw std::runtime_error("grpc_stream: the stream ended early");
    }
    if (response->has_error()) throw std::runtime_error(response->error().message());
    return true;
  };
  return cell;
}

Cell LcmCell(client::LcmClient& client, const std::string& model,
             const v1alpha1::WheelStates& states) {
  Cell cell;
  cell.row.transport = "lcm";
  auto query = std::make_shared<grouser_lcm::wheel_query_t>(ToLcm(model, states));
  cell.call = [&client, query] { return client.Query(query.get(), kLcmTimeout).has_value(); };
  return cell;
}

void RunRound(std::vector<Cell>& cells, bool record) {
  for (Cell& cell : cells) {
    for (int i = 0; i < cell.calls_per_round; ++i) {
      const auto start = Clock::now();
      const bool answered = cell.call();
      const std::chrono::duration<double, std::micro> spent = Clock::now() - start;
      if (!record) continue;
      if (answered) {
        cell.microseconds.push_back(spent.count());
      } else {
        ++cell.row.lost;
      }
    }
  }
}

LatencyRow Summarise(Cell cell) {
  LatencyRow row = cell.row;
  auto& values = cell.microseconds;
  row.samples = values.size();
  if (values.empty()) throw std::runtime_error(row.transport + ": no answer at all");
  std::sort(values.begin(), values.end());
  row.p50_us = Quantile(values, 0.5);
  row.p99_us = Quantile(values, 0.99);
  const double total_us = std::accumulate(values.begin(), values.end(), 0.0);
  row.states_per_s = 1e6 * row.batch * static_cast<double>(row.samples) / total_us;
  return row;
}

}  // namespace

double Quantile(const std::vector<double>& sorted, double q) {
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

std::vector<LatencyRow> MeasureLatency(const LatencyOptions& options) {
  const client::TerrainClient client(options.server);
  const auto stream = client.OpenStream();
  const auto lcm = options.lcm
                       ? std::make_unique<client::LcmClient>(options.lcm_url, options.lcm_interface)
                       : nullptr;
  const auto domain = DomainOf(client, options.model);
  std::mt19937 random(options.seed);
  std::vector<Cell> cells;
  for (const int batch : kQueryBatches) {
    v1alpha1::EvaluateWheelsRequest request;
    request.set_model(options.model);
    *request.mutable_states() = RandomStates(domain, batch, random);
    const std::size_t first = cells.size();
    cells.push_back(UnaryCell(client, request));
    cells.push_back(StreamCell(*stream, request));
    if (lcm && batch <= kMaxLcmStates) {
      cells.push_back(LcmCell(*lcm, options.model, request.states()));
    }
    for (std::size_t i = first; i < cells.size(); ++i) {
      cells[i].row.batch = batch;
      cells[i].calls_per_round = batch <= kMaxLcmStates ? 20 : batch <= 1000 ? 10 : 2;
    }
  }
  const auto until = Clock::now() + std::chrono::duration<double>(options.seconds);
  RunRound(cells, /*record=*/false);  // connections, page faults
  const auto too_few = [](const Cell& cell) {
    return cell.microseconds.size() + cell.row.lost < kMinSamples;
  };
  do {
    RunRound(cells, /*record=*/true);
  } while (Clock::now() < until || std::any_of(cells.begin(), cells.end(), too_few));
  stream->Finish();
  std::vector<LatencyRow> rows;
  for (Cell& cell : cells) rows.push_back(Summarise(std::move(cell)));
  return rows;
}

}  // namespace grouser::bench
