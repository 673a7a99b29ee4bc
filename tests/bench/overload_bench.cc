#include "tests/bench/overload_bench.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <unordered_map>

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "tests/bench/child_program.h"
#include "tests/bench/server_bench.h"
#include "tests/integration/h2_connection.h"

namespace grouser::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using testing::H2Answer;
using testing::H2Connection;

constexpr char kPath[] = "/grouser.v1alpha1.TerrainService/EvaluateWheels";
constexpr int kOk = 0, kDeadlineExceeded = 4, kResourceExhausted = 8;
constexpr Seconds kBetweenRss(0.5);
constexpr int kWarmCalls = 20;  // on each connection, before the start is noted

/// A serialized request of random slip states inside the shipped model's domain.
std::string Message(int states, std::mt19937& random) {
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  v1alpha1::EvaluateWheelsRequest request;
  for (int i = 0; i < states; ++i) {
    request.mutable_states()->mutable_slip()->add_slip(draw(-0.2, 0.6));
    request.mutable_states()->mutable_slip()->add_attack_angle_rad(draw(-0.5, 0.5));
    request.mutable_states()->add_load_n(draw(20, 40));
  }
  return request.SerializeAsString();
}

struct Client {
  std::unique_ptr<H2Connection> connection;
  std::unordered_map<std::uint32_t, Clock::time_point> sent;
  Clock::time_point waits_until{};
};

class Generator {
 public:
  Generator(ChildProgram& server, const OverloadOptions& options)
      : server_(server), options_(options), random_(options.seed) {
    message_ = Message(options.states, random_);
    for (int i = 0; i < options.connections; ++i) Connect(clients_.emplace_back());
  }

  void WarmUp() {
    Row row = {};
    const auto until = Clock::now() + Wait(600);
    Run(row, 0, until, kWarmCalls * options_.connections);
    if (row.ok.empty()) throw std::runtime_error("no call was answered");
    Drain();
  }

  OverloadRow Measure(const std::string& name, double rate) {
    Row row = {};
    const auto start = Clock::now();
    Run(row, rate, start + Wait(options_.seconds), SIZE_MAX);
    const double spent = Seconds(Clock::now() - start).count();
    Drain();
    OverloadRow result;
    result.load = name;
    const auto per_s = [&](double count) { return count / spent; };
    result.offered_per_s = rate > 0 ? rate : per_s(static_cast<double>(row.ok.size()));
    result.answered_per_s = per_s(static_cast<double>(row.ok.size()));
    result.refused_per_s = per_s(static_cast<double>(row.refused.size()));
    result.late_per_s = per_s(row.late);
    result.failed_per_s = per_s(row.failed);
    result.held_per_s = per_s(row.held);
    const auto quantile = [](std::vector<double>& values, double q) {
      std::sort(values.begin(), values.end());
      return values.empty() ? 0 : Quantile(values, q);
    };
    result.p50_ms = quantile(row.ok, 0.5);
    result.p99_ms = quantile(row.ok, 0.99);
    result.refused_p50_ms = quantile(row.refused, 0.5);
    result.refused_p99_ms = quantile(row.refused, 0.99);
    result.most_rss_mib = row.most_rss;
    return result;
  }

  void Stay(double seconds) {
    Row row = {};
    Run(row, 1e-9, Clock::now() + Wait(seconds), SIZE_MAX);
  }

  const std::vector<double>& rss() const { return rss_; }

 private:
  struct Row {
    std::vector<double> ok, refused;  // ms
    double late = 0, failed = 0, held = 0, most_rss = 0;
  };

  void Connect(Client& client) {
    client.connection = std::make_unique<H2Connection>(server_.address());
    client.sent.clear();
  }

  void Send(Client& client) {
    const auto stream = client.connection->Call(kPath, message_, options_.deadline_ms);
    client.sent[stream] = Clock::now();
    client.connection->Flush();
  }

  void Offer(Row& row) {
    Client& client = clients_[random_() % clients_.size()];
    const auto most = std::min<std::size_t>(client.connection->most_streams(),
                                            static_cast<std::size_t>(options_.in_flight));
    if (client.connection->streams() >= most ||
        (options_.heeds_hints && Clock::now() < client.waits_until)) {
      ++row.held;
    } else {
      Send(client);
    }
  }

  void OnEnd(Row& row, Client& client, const H2Answer& answer) {
    const auto it = client.sent.find(answer.stream);
    if (it == client.sent.end()) return;
    const double ms = Seconds(Clock::now() - it->second).count() * 1e3;
    client.sent.erase(it);
    if (answer.status == kOk && ms <= options_.deadline_ms) {
      row.ok.push_back(ms);
    } else if (answer.status == kResourceExhausted) {
      row.refused.push_back(ms);
      client.waits_until = Clock::now() + std::chrono::milliseconds(answer.pushback_ms);
    } else if (answer.status == kOk || answer.status == kDeadlineExceeded) {
      ++row.late;
    } else {
      ++row.failed;
    }
  }

  /// `rate` 0: closed. Ends at `until`, or once so many calls have ended.
  void Run(Row& row, double rate, Clock::time_point until, std::size_t calls) {
    std::exponential_distribution<double> gap(std::max(rate, 1e-9));
    auto next = rate > 0 ? Clock::now() + Wait(gap(random_)) : Clock::time_point::max();
    for (auto now = Clock::now(); now < until; now = Clock::now()) {
      if (now >= next_rss_) {
        rss_.push_back(server_.RssMib());
        row.most_rss = std::max(row.most_rss, rss_.back());
        next_rss_ = now + std::chrono::duration_cast<Clock::duration>(kBetweenRss);
      }
      for (; next <= now; next += Wait(gap(random_))) Offer(row);
      std::size_t ended = 0;
      if (rate == 0) SendAgain();
      const auto soon = rate == 0 ? now + std::chrono::milliseconds(1) : next;
      Poll(std::min({soon, until, next_rss_}), [&](Client& client, const H2Answer& answer) {
        OnEnd(row, client, answer);
        ++ended;
      });
      if (calls <= ended) return;
      calls -= ended;
    }
  }

  /// Of a closed loop: who has no call under way and need not wait.
  void SendAgain() {
    const auto now = Clock::now();
    for (Client& client : clients_) {
      if (client.sent.empty() && client.waits_until <= now) Send(client);
    }
  }

  static Clock::duration Wait(double seconds) {
    return std::chrono::duration_cast<Clock::duration>(Seconds(std::min(seconds, 1e6)));
  }

  template <class Report>
  void Poll(Clock::time_point until, const Report& report) {
    polls_.clear();
    for (const Client& client : clients_) {
      const short events = POLLIN | (client.connection->wants_write() ? POLLOUT : 0);
      polls_.push_back({client.connection->fd(), events, 0});
    }
    const auto wait = std::max<Clock::duration>(until - Clock::now(), Clock::duration(0));
    const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(wait).count();
    const timespec time{ns / 1'000'000'000, ns % 1'000'000'000};
    ::ppoll(polls_.data(), polls_.size(), &time, nullptr);
    for (std::size_t i = 0; i < polls_.size(); ++i) {
      if (polls_[i].revents == 0) continue;
      Client& client = clients_[i];
      if (polls_[i].revents & POLLOUT) client.connection->Flush();
      client.connection->Read([&](const H2Answer& answer) { report(client, answer); });
      if (!client.connection->open()) Connect(client);
    }
  }

  /// Waits for what is still under way, so that it does not count for the next load.
  void Drain() {
    const auto until = Clock::now() + std::chrono::milliseconds(2 * options_.deadline_ms);
    const auto idle = [](const Client& c) { return c.connection->streams() == 0; };
    while (Clock::now() < until && !std::all_of(clients_.begin(), clients_.end(), idle)) {
      Poll(Clock::now() + std::chrono::milliseconds(10), [](Client&, const H2Answer&) {});
    }
    for (Client& client : clients_) client.sent.clear();
  }

  ChildProgram& server_;
  const OverloadOptions& options_;
  std::mt19937 random_;
  std::string message_;
  std::vector<Client> clients_;
  std::vector<pollfd> polls_;
  std::vector<double> rss_;
  Clock::time_point next_rss_{};
};

}  // namespace

std::vector<std::string> OverloadResult::Missed() const {
  std::vector<std::string> missed;
  const auto judge = [&](bool met, const std::string& what, double found) {
    if (!met) missed.push_back(fmt::format("{}, found {:.2f}", what, found));
  };
  judge(goodput >= 0.8, "goodput at 2 at least 0.8 of the closed loop's", goodput);
  judge(p99_ratio <= 3, "p99 at 2 at most 3 times that at 0.8", p99_ratio);
  judge(most_rss_mib <= 1024, "RSS at most 1024 MiB", most_rss_mib);
  judge(rss_ratio <= 1.2, "RSS at the end at most 1.2 times that at the start", rss_ratio);
  return missed;
}

OverloadResult MeasureOverload(const OverloadOptions& options) {
  const TempFolder folder;
  auto words = ServerWords(folder, options.program);
  words.push_back("--no-lcm");
  words.insert(words.end(), options.server_options.begin(), options.server_options.end());
  ChildProgram server(words, "127.0.0.1:0", options.server_core);
  const Pinned pinned(options.client_core);
  Generator generator(server, options);
  generator.WarmUp();
  OverloadResult result;
  result.start_rss_mib = server.RssMib();
  result.rows.push_back(generator.Measure("closed", 0));
  const double capacity = result.rows[0].answered_per_s;
  result.rows.push_back(generator.Measure("0.8", 0.8 * capacity));
  result.rows.push_back(generator.Measure("2", 2 * capacity));
  generator.Stay(options.settle_s);
  result.end_rss_mib = server.RssMib();
  result.rss_mib = generator.rss();
  result.goodput = result.rows[2].answered_per_s / capacity;
  result.p99_ratio = result.rows[2].p99_ms / result.rows[1].p99_ms;
  for (const double mib : result.rss_mib) {
    result.most_rss_mib = std::max(result.most_rss_mib, mib);
  }
  result.rss_ratio = result.end_rss_mib / result.start_rss_mib;
  return result;
}

}  // namespace grouser::bench
