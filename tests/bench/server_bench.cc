#include "tests/bench/server_bench.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>

#include "clients/cpp/lcm_client.h"
#include "clients/cpp/terrain_client.h"
#include "tests/bench/echo_server.h"

namespace grouser::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Request = v1alpha1::EvaluateWheelsRequest;
using Response = v1alpha1::EvaluateWheelsResponse;

constexpr int kSmall[] = {1, 4, 64};
constexpr int kMost = 10000;
/// What a planner needs: two outputs with their intervals.
const std::vector<std::string> kFewFields = {"f_x.value",     "f_x.low",     "f_x.high",
                                             "sinkage.value", "sinkage.low", "sinkage.high"};
constexpr int kParts = 5;       // of the measurement, for the spread
constexpr int kMinSamples = 2;  // in each
constexpr client::Milliseconds kLcmTimeout(200);
constexpr client::Milliseconds kDeadline(30000);

constexpr double kSmallP50 = 1.10, kMostP50 = 1.20, kLcmP50 = 1.07, kP99 = 1.15;

double Microseconds(Clock::time_point since) {
  return std::chrono::duration<double, std::micro>(Clock::now() - since).count();
}

/// One peer; `call` makes one round trip and says whether an answer came.
struct Side {
  std::function<bool()> call;
  std::array<std::vector<double>, kParts> microseconds;

  std::vector<double> All() const {
    std::vector<double> all;
    for (const auto& part : microseconds) all.insert(all.end(), part.begin(), part.end());
    return all;
  }
};

/// The server and the echo with one message by one transport.
struct Cell {
  ServerRow row;
  int calls_per_round = 1;
  std::array<Side, 2> sides;  // server, echo
};

grouser_lcm::wheel_query_t ToLcm(const v1alpha1::WheelStates& states) {
  const auto copy = [](const auto& field) {
    return std::vector<double>(field.begin(), field.end());
  };
  grouser_lcm::wheel_query_t query;
  query.n = states.load_n_size();
  query.v_x = copy(states.velocity().v_x_m_per_s());
  query.v_y = copy(states.velocity().v_y_m_per_s());
  query.rim_speed = copy(states.velocity().rim_speed_m_per_s());
  query.load = copy(states.load_n());
  return query;
}

std::function<bool()> Unary(const client::TerrainClient& client, const Request& request) {
  auto response = std::make_shared<Response>();
  return [&client, request, response] {
    client.Evaluate(request, response.get());
    return true;
  };
}

std::function<bool()> Stream(client::WheelStreamSession& stream, const Request& request) {
  auto response = std::make_shared<Response>();
  return [&stream, request, response] {
    if (!stream.Send(request) || !stream.Receive(response.get())) {
      stream.Finish();
      throw std::runtime_error("the stream ended early");
    }
    if (response->has_error()) throw std::runtime_error(response->error().message());
    return true;
  };
}

std::function<bool()> Lcm(client::LcmClient& client, const v1alpha1::WheelStates& states) {
  auto query = std::make_shared<grouser_lcm::wheel_query_t>(ToLcm(states));
  return [&client, query] { return client.Query(query.get(), kLcmTimeout).has_value(); };
}

/// The connections to a server and an echo at one kind of address.
class Connections {
 public:
  Connections(const ChildProgram& server, const ChildProgram& echo)
      : clients_{client::TerrainClient(server.address(), kDeadline),
                 client::TerrainClient(echo.address(), kDeadline)},
        streams_{clients_[0].OpenStream(), clients_[1].OpenStream()} {}

  void AddCells(const std::string& name, const Request& request, std::size_t answer_bytes,
                std::vector<Cell>* cells) {
    Cell unary;
    unary.row.transport = name + " unary";
    unary.row.states = request.states().load_n_size();
    unary.row.fields =
        request.fields().empty() ? "all" : fmt::format("{} arrays", request.fields_size());
    unary.row.answer_bytes = answer_bytes;
    const bool small = unary.row.states < kMost;
    unary.calls_per_round = small ? 20 : 2;
    unary.row.p50.target = small ? kSmallP50 : kMostP50;
    unary.row.p99.target = kP99;
    Cell stream = unary;
    stream.row.transport = name + " stream";
    for (int k = 0; k < 2; ++k) {
      unary.sides[k].call = Unary(clients_[k], request);
      stream.sides[k].call = Stream(*streams_[k], request);
    }
    cells->push_back(std::move(unary));
    cells->push_back(std::move(stream));
  }

  void Finish() {
    for (auto& stream : streams_) stream->Finish();
  }

 private:
  std::array<client::TerrainClient, 2> clients_;
  std::array<std::unique_ptr<client::WheelStreamSession>, 2> streams_;
};

/// A group for each, so that nothing else answers.
std::array<std::string, 2> LcmUrls() {
  const int port = 20000 + ::getpid() % 20000;
  const auto url = [](int p) { return fmt::format("udpm://239.255.76.67:{}?ttl=0", p); };
  return {url(port), url(port + 1)};
}

class LcmConnections {
 public:
  LcmConnections(const std::array<std::string, 2>& urls, const std::string& interface)
      : clients_{std::make_unique<client::LcmClient>(urls[0], interface),
                 std::make_unique<client::LcmClient>(urls[1], interface)} {}

  void Save(const v1alpha1::WheelStates& states, const std::string& folder) {
    auto query = ToLcm(states);
    grouser_lcm::wheel_measured_t measured;
    const auto answer = clients_[0]->Query(&query, client::Milliseconds(5000), &measured);
    if (!answer) throw std::runtime_error("lcm: no answer");
    Write(*answer, LcmAnswerPath(folder, query.n));
    if (measured.n > 0) Write(measured, LcmMeasuredPath(folder, query.n));
  }

  Cell MakeCell(const v1alpha1::WheelStates& states) {
    Cell cell;
    cell.row.transport = "lcm";
    cell.row.fields = "all";
    cell.row.states = states.load_n_size();
    cell.row.p50.target = kLcmP50;
    cell.row.p99.target = kP99;
    cell.calls_per_round = 20;
    for (int k = 0; k < 2; ++k) cell.sides[k].call = Lcm(*clients_[k], states);
    return cell;
  }

 private:
  template <class Message>
  static void Write(const Message& message, const std::string& path) {
    std::string bytes(message.getEncodedSize(), '\0');
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    std::ofstream(path, std::ios::binary) << bytes;
  }

  std::array<std::unique_ptr<client::LcmClient>, 2> clients_;
};

/// Every cell by turns; within it the two sides call by call, in an order that changes.
/// `part` -1: warms up.
void RunRound(std::vector<Cell>& cells, int part, bool echo_first) {
  for (Cell& cell : cells) {
    for (int i = 0; i < 2 * cell.calls_per_round; ++i) {
      Side& side = cell.sides[(i + (echo_first ? 1 : 0)) % 2];
      const auto start = Clock::now();
      const bool answered = side.call();
      const double spent = Microseconds(start);
      if (part < 0) continue;
      answered ? side.microseconds[part].push_back(spent) : void(++cell.row.lost);
    }
  }
}

void Run(std::vector<Cell>& cells, double seconds) {
  RunRound(cells, -1, false);  // connections, page faults
  const auto start = Clock::now();
  bool echo_first = false;
  for (int part = 0; part < kParts; ++part) {
    const auto until = start + std::chrono::duration<double>(seconds * (part + 1) / kParts);
    const auto too_few = [part](const Cell& cell) {
      return cell.sides[0].microseconds[part].size() + cell.row.lost < kMinSamples ||
             cell.sides[1].microseconds[part].size() + cell.row.lost < kMinSamples;
    };
    do {
      RunRound(cells, part, echo_first);
      echo_first = !echo_first;
    } while (Clock::now() < until || std::any_of(cells.begin(), cells.end(), too_few));
  }
}

double QuantileOf(std::vector<double> values, double q) {
  if (values.empty()) throw std::runtime_error("no answer at all");
  std::sort(values.begin(), values.end());
  return Quantile(values, q);
}

void Compare(const Cell& cell, double q, LatencyRatio* to) {
  to->server_us = QuantileOf(cell.sides[0].All(), q);
  to->echo_us = QuantileOf(cell.sides[1].All(), q);
  to->ratio = to->server_us / to->echo_us;
  to->least = to->most = to->ratio;
  for (int part = 0; part < kParts; ++part) {
    const double ratio = QuantileOf(cell.sides[0].microseconds[part], q) /
                         QuantileOf(cell.sides[1].microseconds[part], q);
    to->least = std::min(to->least, ratio);
    to->most = std::max(to->most, ratio);
  }
}

ServerRow Summarise(const Cell& cell) {
  ServerRow row = cell.row;
  row.samples = cell.sides[0].All().size();
  Compare(cell, 0.5, &row.p50);
  Compare(cell, 0.99, &row.p99);
  return row;
}

/// The first big message [us] on a new connection to a program that just started.
double FirstOf(const std::vector<std::string>& words, const Request& small, const Request& big,
               double* in_server_us) {
  const ChildProgram program(words, "127.0.0.1:0", -1);
  const client::TerrainClient client(program.address(), kDeadline);
  Response response;
  client.Evaluate(small, &response);
  const auto start = Clock::now();
  client.Evaluate(big, &response);
  const double spent = Microseconds(start);
  *in_server_us =
      1e6 * static_cast<double>(response.latency().seconds()) + 1e-3 * response.latency().nanos();
  return spent;
}

FirstMessage MeasureFirst(const std::vector<std::string>& server,
                          const std::vector<std::string>& echo, const Request& small,
                          const Request& big, const LatencyRatio& usual, int starts) {
  std::vector<double> first, of_echo, inside;
  for (int i = 0; i < starts; ++i) {
    double in_server = 0, unused = 0;
    first.push_back(FirstOf(server, small, big, &in_server));
    inside.push_back(in_server);
    of_echo.push_back(FirstOf(echo, small, big, &unused));
  }
  FirstMessage result;
  result.server_us = QuantileOf(first, 0.5);
  result.echo_us = QuantileOf(of_echo, 0.5);
  result.in_server_us = QuantileOf(inside, 0.5);
  result.ratio = result.server_us / usual.server_us;
  result.echo_ratio = result.echo_us / usual.echo_us;
  result.least = std::ranges::min(first) / usual.server_us;
  result.most = std::ranges::max(first) / usual.server_us;
  return result;
}

}  // namespace

double Quantile(const std::vector<double>& sorted, double q) {
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

Request RandomRequest(const std::string& server, int states, unsigned seed,
                      const std::vector<std::string>& fields) {
  const auto listing = client::TerrainClient(server, kDeadline).ListModels();
  if (listing.models().empty()) throw std::runtime_error("the server has no model");
  const v1alpha1::Domain& domain = listing.models(0).domain();
  std::mt19937 random(seed);
  const auto draw = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const double speed = domain.speed_m_per_s() > 0 ? domain.speed_m_per_s() : 0.1;
  Request request;
  request.mutable_fields()->Assign(fields.begin(), fields.end());
  auto* velocity = request.mutable_states()->mutable_velocity();
  for (int i = 0; i < states; ++i) {
    const double angle = draw(-1, 1) * domain.attack_angle_max_rad();
    velocity->add_v_x_m_per_s(draw(0.2, 1) * speed * std::cos(angle));
    velocity->add_v_y_m_per_s(draw(0.2, 1) * speed * std::sin(angle));
    velocity->add_rim_speed_m_per_s(draw(0.2, 1) * speed);
    request.mutable_states()->add_load_n(draw(domain.load_min_n(), domain.load_max_n()));
  }
  return request;
}

std::size_t SaveAnswer(const std::string& server, const Request& request,
                       const std::string& folder) {
  const auto answer = client::TerrainClient(server, kDeadline).Evaluate(request);
  std::ofstream(AnswerPath(folder, request), std::ios::binary) << answer.SerializeAsString();
  return answer.ByteSizeLong();
}

std::vector<std::string> EchoWords(const std::string& answers) {
  return {Beside("grouser-bench"), "echo", "--answers", answers};
}

ServerResult MeasureServer(const ServerOptions& options) {
  const TempFolder folder;
  const auto with = [](std::vector<std::string> words, std::vector<std::string> more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const auto urls = LcmUrls();
  const auto server_words = ServerWords(folder, options.program);
  const auto without_lcm = with(server_words, {"--no-lcm"});
  const auto echo_words = EchoWords(folder / "");
  const auto logging = [&](const std::vector<std::string>& words, const char* name) {
    return with(words, {"--query-log", folder / name, "--query-log-files", "2"});
  };
  const bool lcm = options.lcm && !options.query_log;
  const auto lcm_words = [&](const std::string& url) {
    return std::vector<std::string>{"--lcm-url", url, "--lcm-interface", options.lcm_interface};
  };
  const ChildProgram server(options.query_log ? logging(without_lcm, "tcp.log")
                            : lcm             ? with(server_words, lcm_words(urls[0]))
                                              : without_lcm,
                            "127.0.0.1:0", -1);
  const ChildProgram socket_server(
      options.query_log ? logging(without_lcm, "unix.log") : without_lcm,
      "unix:" + (folder / "server.sock"), -1);
  std::vector<Request> requests;
  for (const int states : kSmall) {
    requests.push_back(RandomRequest(server.address(), states, options.seed));
  }
  requests.push_back(RandomRequest(server.address(), kMost, options.seed));
  requests.push_back(RandomRequest(server.address(), kMost, options.seed, kFewFields));
  std::vector<std::size_t> bytes;
  for (const Request& request : requests) {
    bytes.push_back(SaveAnswer(server.address(), request, folder / ""));
  }
  const auto peer_words = options.query_log ? without_lcm : echo_words;
  const ChildProgram echo(lcm ? with(peer_words, lcm_words(urls[1])) : peer_words, "127.0.0.1:0",
                          -1);
  const ChildProgram socket_echo(peer_words, "unix:" + (folder / "echo.sock"), -1);
  Connections by_tcp(server, echo), by_socket(socket_server, socket_echo);
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    by_tcp.AddCells("tcp", requests[i], bytes[i], &cells);
    by_socket.AddCells("unix", requests[i], bytes[i], &cells);
  }
  std::unique_ptr<LcmConnections> by_lcm;
  if (lcm) {
    by_lcm = std::make_unique<LcmConnections>(urls, options.lcm_interface);
    for (std::size_t i = 0; i < std::size(kSmall); ++i) {
      by_lcm->Save(requests[i].states(), folder / "");
      cells.push_back(by_lcm->MakeCell(requests[i].states()));
    }
  }
  Run(cells, options.seconds);
  by_tcp.Finish();
  by_socket.Finish();
  ServerResult result;
  result.query_log = options.query_log;
  for (const Cell& cell : cells) result.rows.push_back(Summarise(cell));
  if (options.query_log) {
    for (ServerRow& row : result.rows) row.p50.target = row.p99.target = 0;
    return result;
  }
  const auto usual = std::ranges::find_if(result.rows, [](const ServerRow& row) {
    return row.transport == "tcp unary" && row.states == kMost && row.fields == "all";
  });
  result.first = MeasureFirst(without_lcm, echo_words, requests[0], requests[std::size(kSmall)],
                              usual->p50, options.starts);
  return result;
}

}  // namespace grouser::bench
