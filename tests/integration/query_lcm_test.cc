// grouser-server over LCM, in a network namespace of this test's own.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <net/route.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <lcm/lcm-cpp.hpp>
#include <limits>
#include <string>
#include <vector>

#include "clients/cpp/lcm_client.h"
#include "clients/cpp/lcm_response.h"
#include "clients/cpp/terrain_client.h"
#include "proto/lcm/group_receiver.h"
#include "server/query/log/query_log_reader.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr client::Milliseconds kTimeout(30000);
constexpr const char* kGroup = "239.255.76.67";

void WriteTo(const char* path, const std::string& text) {
  const int fd = ::open(path, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return;
  [[maybe_unused]] const auto written = ::write(fd, text.data(), text.size());
  ::close(fd);
}

/// A user and network namespace where the loopback is up and nothing is routed
/// to it but itself. Returns why not, or nothing. Before any thread starts.
std::string EnterOwnNetwork() {
  const std::string uid = std::to_string(::getuid());
  const std::string gid = std::to_string(::getgid());
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return std::string("no network namespace of its own is permitted here: ") +
           std::strerror(errno);
  }
  WriteTo("/proc/self/setgroups", "deny");
  WriteTo("/proc/self/uid_map", "0 " + uid + " 1");
  WriteTo("/proc/self/gid_map", "0 " + gid + " 1");
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP;
  const bool up = ::ioctl(fd, SIOCSIFFLAGS, &request) == 0;
  const std::string why = up ? "" : std::string("lo cannot be set up: ") + std::strerror(errno);
  ::close(fd);
  return why;
}

/// What the two commands do that the server's error names.
std::string GiveMulticastRoute() {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP | IFF_MULTICAST;
  rtentry route{};
  char device[] = "lo";
  route.rt_dev = device;
  route.rt_flags = RTF_UP;
  const auto set = [](sockaddr* to, const char* address) {
    auto* in = reinterpret_cast<sockaddr_in*>(to);
    in->sin_family = AF_INET;
    ::inet_pton(AF_INET, address, &in->sin_addr);
  };
  set(&route.rt_dst, "224.0.0.0");
  set(&route.rt_genmask, "240.0.0.0");
  const bool good = ::ioctl(fd, SIOCSIFFLAGS, &request) == 0 && ::ioctl(fd, SIOCADDRT, &route) == 0;
  const std::string why = good ? "" : std::string("no route: ") + std::strerror(errno);
  ::close(fd);
  return why;
}

std::string g_no_network;

class QueryLcmTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!g_no_network.empty()) GTEST_SKIP() << g_no_network;
    testing::MakeStable(dir_.path(), testing::PhysicsModel("sand"));
  }
  static grouser_lcm::wheel_query_t Query(int n) {
    grouser_lcm::wheel_query_t query;
    query.model = "sand";
    query.n = n;
    query.v_x.assign(n, 0.08);
    query.v_y.assign(n, 0.01);
    query.rim_speed.assign(n, 0.1);
    query.load.assign(n, 24);
    return query;
  }
  /// A state of Query().
  static v1alpha1::EvaluateWheelsResponse AskOverGrpc(const testing::ServerProcess& server) {
    v1alpha1::EvaluateWheelsRequest request;
    auto* velocity = request.mutable_states()->mutable_velocity();
    velocity->add_v_x_m_per_s(0.08);
    velocity->add_v_y_m_per_s(0.01);
    velocity->add_rim_speed_m_per_s(0.1);
    request.mutable_states()->add_load_n(24);
    return client::TerrainClient(server.address(), kTimeout).Evaluate(request);
  }
  testing::TempDir dir_;
};

// First: the tests run in this order, and the next one gives the route.
TEST_F(QueryLcmTest, WithoutARouteTheServerFailsByNameAndGrpcAloneStarts) {
  const auto server = testing::RunProgram(
      "grouser-server", {"--state", dir_.path(), "--grpc", "127.0.0.1:0"}, dir_.path());
  EXPECT_EQ(server.code, 1);
  EXPECT_THAT(server.err,
              AllOf(HasSubstr("lcm"), HasSubstr("ip link set lo multicast on"),
                    HasSubstr("ip route add 224.0.0.0/4 dev lo"), HasSubstr("--no-lcm")));
  EXPECT_NO_THROW(testing::ServerProcess(dir_.path(), {"--no-lcm"}));
}

TEST_F(QueryLcmTest, WithARouteItAnswersAndSurvivesBadMessages) {
  ASSERT_EQ(GiveMulticastRoute(), "");
  testing::ServerProcess server(dir_.path(), {});
  EXPECT_THAT(server.program().Stderr(), HasSubstr("lcm=udpm://"));
  client::LcmClient client("");
  auto query = Query(4);
  query.v_x[2] = std::numeric_limits<double>::quiet_NaN();
  const auto answer = client.Query(&query, kTimeout);
  ASSERT_TRUE(answer.has_value());
  ASSERT_EQ(answer->n, 4);
  EXPECT_NEAR(answer->f_z.value[0], 24, 1e-3);
  EXPECT_TRUE(answer->flags[2] & 1);
  EXPECT_TRUE(std::isnan(answer->f_x.value[2]));
  EXPECT_THAT(answer->model, HasSubstr("sand@sha256:"));

  // The same state over gRPC gives the same numbers.
  const auto same = AskOverGrpc(server);
  EXPECT_EQ(same.responses().f_x().value(0), answer->f_x.value[0]);
  EXPECT_EQ(same.responses().torque().high(0), answer->torque.high[0]);

  auto too_many = Query(65);
  EXPECT_THROW(client.Query(&too_many, kTimeout), std::runtime_error);
  auto unknown = Query(1);
  unknown.model = "clay";
  EXPECT_THROW(client.Query(&unknown, kTimeout), std::runtime_error);

  lcm::LCM raw;
  for (const std::string& bytes :
       {std::string(), std::string("garbage"), std::string(60000, 'x')}) {
    raw.publish("GROUSER_QUERY", bytes.data(), static_cast<unsigned>(bytes.size()));
  }
  auto after = Query(64);
  const auto last = client.Query(&after, kTimeout);
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->n, 64);

  const auto cli = testing::RunProgram(
      "grouser-client",
      {"lcm-query", "--vx", "0.08", "--vy", "0", "--rim", "0.1", "--load", "24", "--json"},
      dir_.path());
  EXPECT_EQ(cli.code, 0) << cli.err;
  EXPECT_THAT(cli.out, HasSubstr("\"sinkage\""));
  const auto bench = testing::RunProgram(
      "grouser-bench", {"server", "--seconds", "0", "--starts", "1", "--json"}, dir_.path());
  EXPECT_EQ(bench.code, 0) << bench.err;
  EXPECT_THAT(bench.out, HasSubstr("\"lcm\", \"states\": 4,"));

  server.program().Signal(SIGTERM);
  EXPECT_EQ(server.program().Wait(), 0) << server.program().Stderr();
}

// What is known of measurements is the same over LCM, over gRPC and in both tables.
TEST_F(QueryLcmTest, IntervalsForMeasurementsAreThoseOfGrpc) {
  v1alpha1::Model model = testing::PhysicsModel("sand");
  v1alpha1::FormError* form = model.add_form_by_region();
  form->set_region(v1alpha1::MEASURED_REGION_ANGLED);
  for (int k = 0; k < 6; ++k) {
    form->add_rows(k == 0 ? 4 : 0);
    form->add_sd(k == 0 ? 1.5 : std::numeric_limits<double>::quiet_NaN());
    form->add_factor(k == 0 ? 2 : std::numeric_limits<double>::quiet_NaN());
  }
  testing::MakeStable(dir_.path(), model);
  testing::ServerProcess server(dir_.path(), {});
  client::LcmClient client("");
  auto query = Query(2);
  query.v_y[1] = 0;  // straight: no row
  grouser_lcm::wheel_measured_t measured;
  const auto answer = client.Query(&query, kTimeout, &measured);
  ASSERT_TRUE(answer.has_value());
  ASSERT_EQ(measured.n, 2);
  const auto same = AskOverGrpc(server).responses().f_x();
  EXPECT_EQ(measured.f_x.sd_form[0], same.sd_form(0));
  EXPECT_EQ(measured.f_x.low[0], same.measured_low(0));
  EXPECT_EQ(measured.f_x.high[0], same.measured_high(0));
  EXPECT_LT(measured.f_x.low[0], answer->f_x.low[0]);
  EXPECT_TRUE(std::isnan(measured.f_x.high[1]));
  EXPECT_EQ(measured.torque.n, 0);
  const std::vector<std::string> state = {"--vx",  "0.08", "--vy",   "0.01",
                                          "--rim", "0.1",  "--load", "24"};
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), state.begin(), state.end());
    const auto done = testing::RunProgram("grouser-client", arguments, dir_.path());
    EXPECT_EQ(done.code, 0) << done.err;
    return done.out;
  };
  EXPECT_THAT(run({"lcm-query"}), HasSubstr("for a measurement"));
  EXPECT_THAT(run({"query", "--server", server.address()}), HasSubstr("90 % (MEASURED)"));
  EXPECT_THAT(run({"query", "--server", server.address(), "--tolerance", "sinkage=1", "--against",
                   "measured"}),
              HasSubstr("TOLERANCE_UNMET"));
}

TEST_F(QueryLcmTest, AnsweredQueriesAreLoggedAndReplayWithEqualBits) {
  testing::TempDir folder;  // of this server alone
  v1alpha1::Model model = testing::PhysicsModel("sand");
  v1alpha1::FormError* form = model.add_form_by_region();
  form->set_region(v1alpha1::MEASURED_REGION_ANGLED);
  for (int k = 0; k < 6; ++k) {
    form->add_rows(k == 0 ? 4 : 0);
    form->add_sd(k == 0 ? 1.5 : std::numeric_limits<double>::quiet_NaN());
    form->add_factor(k == 0 ? 2 : std::numeric_limits<double>::quiet_NaN());
  }
  testing::MakeStable(folder.path(), model);
  const std::string log = folder / "queries.log";
  testing::ServerProcess server(folder.path(), {"--query-log", log});
  client::LcmClient client("");
  auto query = Query(64);
  for (std::size_t i = 0; i < 64; ++i) {
    query.v_x[i] = 0.1 * std::cos(0.1 * static_cast<double>(i));
    query.v_y[i] = 0.1 * std::sin(0.1 * static_cast<double>(i));
    query.load[i] = static_cast<double>(i);
  }
  query.rim_speed[3] = std::numeric_limits<double>::quiet_NaN();
  query.load[4] = -1;
  grouser_lcm::wheel_measured_t measured;
  ASSERT_TRUE(client.Query(&query, kTimeout, &measured).has_value());
  EXPECT_EQ(measured.n, 64);
  auto unknown = Query(1);
  unknown.model = "clay";
  EXPECT_THROW(client.Query(&unknown, kTimeout), std::runtime_error) << "is not logged";
  auto one = Query(1);
  ASSERT_TRUE(client.Query(&one, kTimeout).has_value());
  AskOverGrpc(server);
  const auto replay = [&](std::vector<std::string> more) {
    more.insert(more.begin(), log);
    return testing::RunProgram("grouser-replay", more, dir_.path());
  };
  // Counted without the server, which logs what a replay asks it.
  ASSERT_TRUE(testing::Eventually([&] {
    server::QueryLogReader reader(log);
    v1alpha1::LoggedQuery query_of_log;
    int queries = 0;
    while (reader.Next(&query_of_log)) ++queries;
    return queries == 3;
  }));
  const auto by_server = replay({"--server", server.address(), "--allow-cut-tail"});
  EXPECT_THAT(by_server.out, HasSubstr(", 0 differing"));  // of 3 or, as it reads, more
  EXPECT_EQ(by_server.code, 0) << by_server.out << by_server.err;
  server.program().Signal(SIGTERM);
  EXPECT_EQ(server.program().Wait(), 0) << server.program().Stderr();
  // Replay compares no more than a log has: all that a datagram brings must be there.
  server::QueryLogReader reader(log);
  v1alpha1::LoggedQuery logged;
  ASSERT_TRUE(reader.Next(&logged));
  EXPECT_EQ(logged.transport(), v1alpha1::QUERY_TRANSPORT_LCM);
  const v1alpha1::WheelResponses& r = logged.response().responses();
  EXPECT_EQ(r.flags_size(), 64);
  EXPECT_EQ(r.slip().slip_size(), 64);
  EXPECT_EQ(r.slip().attack_angle_rad_size(), 64);
  for (const auto* o : {&r.f_x(), &r.f_y(), &r.f_z(), &r.torque(), &r.m_z(), &r.sinkage()}) {
    for (const auto* numbers : {&o->value(), &o->sd_fit(), &o->sd_patch(), &o->low(), &o->high()}) {
      EXPECT_EQ(numbers->size(), 64);
    }
  }
  ASSERT_EQ(r.f_x().measured_low_size(), 64);
  ASSERT_EQ(r.f_x().measured_high_size(), 64);
  ASSERT_EQ(r.f_x().sd_form_size(), 64);
  for (std::size_t i = 0; i < 64; ++i) {
    const auto at = static_cast<int>(i);
    const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
    EXPECT_TRUE(same(r.f_x().measured_low(at), measured.f_x.low[i])) << i;
    EXPECT_TRUE(same(r.f_x().measured_high(at), measured.f_x.high[i])) << i;
    EXPECT_TRUE(same(r.f_x().sd_form(at), measured.f_x.sd_form[i])) << i;
  }
  const auto done = replay({"--state", folder.path(), "--shipped", ""});
  EXPECT_EQ(done.code, 0) << done.out << done.err;
  EXPECT_THAT(done.out, HasSubstr(", 0 differing"));
}

/// Datagrams of one sender to a group, by the machine's routes or by one interface.
void Send(const std::vector<std::string>& datagrams, const char* group,
          const char* interface = nullptr) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (interface != nullptr) {
    ip_mreqn by{};
    by.imr_ifindex = static_cast<int>(::if_nametoindex(interface));
    ASSERT_EQ(::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &by, sizeof by), 0);
  }
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(7667);
  ::inet_pton(AF_INET, group, &to.sin_addr);
  for (const std::string& bytes : datagrams) {
    EXPECT_EQ(
        ::sendto(fd, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to),
        static_cast<ssize_t>(bytes.size()))
        << std::strerror(errno);
  }
  ::close(fd);
}

std::string BigEndian(std::uint32_t value, int width) {
  std::string bytes;
  for (int i = width - 1; i >= 0; --i) bytes += static_cast<char>((value >> (8 * i)) & 0xff);
  return bytes;
}

std::string Fragment(std::uint32_t offset, std::uint32_t number, const std::string& rest) {
  constexpr std::uint32_t kSequence = 7, kMessageBytes = 1000, kFragments = 2;
  return "LC03" + BigEndian(kSequence, 4) + BigEndian(kMessageBytes, 4) + BigEndian(offset, 4) +
         BigEndian(number, 2) + BigEndian(kFragments, 2) + rest;
}

std::string QueryDatagram(grouser_lcm::wheel_query_t query, std::int64_t sequence) {
  query.sequence = sequence;
  query.sender = "raw";
  std::string payload(static_cast<std::size_t>(query.getEncodedSize()), '\0');
  query.encode(payload.data(), 0, static_cast<int>(payload.size()));
  return "LC02" + BigEndian(0, 4) + std::string("GROUSER_QUERY\0", 14) + payload;
}

/// The next answer on the response channel; an empty one after the time-out.
grouser_lcm::wheel_response_t NextAnswer(lcm_io::GroupReceiver& receiver) {
  grouser_lcm::wheel_response_t response;
  pollfd waiting{receiver.fd(), POLLIN, 0};
  while (::poll(&waiting, 1, static_cast<int>(kTimeout.count())) == 1) {
    const auto message = receiver.Next();
    if (!message || message->channel != "GROUSER_RESPONSE") continue;
    if (client::DecodeResponse(message->payload, &response)) break;
  }
  return response;
}

// liblcm 1.3.1 writes the second one's bytes 4 GB behind its buffer.
TEST_F(QueryLcmTest, FragmentsAndLyingAnswersEndNeitherServerNorClient) {
  testing::ServerProcess server(dir_.path(), {});
  client::LcmClient client("");  // receives what is sent below, too
  Send({Fragment(0, 0, std::string("GROUSER_QUERY\0", 14) + std::string(400, 'x')),
        Fragment(0xffffff80u, 1, std::string(300, 'x'))},
       kGroup);
  lcm::LCM raw;
  grouser_lcm::wheel_response_t lie;
  lie.n = 0;
  for (auto* output : {&lie.f_x, &lie.f_y, &lie.f_z, &lie.torque, &lie.m_z, &lie.sinkage}) {
    output->n = 0;
  }
  std::string bytes(static_cast<std::size_t>(lie.getEncodedSize()), '\0');
  lie.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  bytes.replace(24 + 3 * 5, 4, "\x7f\xff\xff\xff");  // n, behind three empty texts
  raw.publish("GROUSER_RESPONSE", bytes.data(), static_cast<unsigned>(bytes.size()));

  auto query = Query(2);
  const auto answer = client.Query(&query, kTimeout);
  ASSERT_TRUE(answer.has_value());
  EXPECT_NEAR(answer->f_z.value[0], 24, 1e-3);
  const auto same = AskOverGrpc(server);
  EXPECT_EQ(same.responses().f_x().value(0), answer->f_x.value[0]);
  EXPECT_THAT(server.program().Stderr(), HasSubstr("lcm: ignored so far: 2 fragments"));
  server.program().Signal(SIGTERM);
  EXPECT_EQ(server.program().Wait(), 0) << server.program().Stderr();
}

TEST_F(QueryLcmTest, CountsWhatIsLostAndWhatIsIgnored) {
  lcm_io::GroupReceiver receiver(lcm_io::ParseLcmUrl("udpm://"), "lo");
  const auto message = [](std::uint32_t sequence) {
    return "LC02" + BigEndian(sequence, 4) + std::string("C\0x", 3);
  };
  // Fragment() is of sequence 7. The jump to 2^32 - 2 is a new start.
  Send({message(5), "junk", message(6), Fragment(0, 0, "C"), Fragment(1, 1, "x"), message(10),
        message(0xfffffffeu), message(1)},
       kGroup);
  pollfd waiting{receiver.fd(), POLLIN, 0};
  while (receiver.counts().messages < 5) {
    ASSERT_EQ(::poll(&waiting, 1, static_cast<int>(kTimeout.count())), 1);
    while (receiver.Next()) continue;
  }
  EXPECT_EQ(receiver.counts().fragments, 2u);
  EXPECT_EQ(receiver.counts().malformed, 1u);
  EXPECT_EQ(receiver.counts().lost, 2u + 2u);  // 8 and 9, then 2^32 - 1 and 0
}

TEST_F(QueryLcmTest, QueriesByAnotherInterfaceAreReceivedOnlyWhenToldSo) {
  ASSERT_EQ(std::system("PATH=$PATH:/usr/sbin:/sbin; ip link add v0 type veth peer name v1 &&"
                        " ip addr add 10.9.0.1/24 dev v0 && ip link set v0 up &&"
                        " ip link set v1 up && ip route add 239.1.1.1/32 dev v0"),
            0);
  {
    testing::ServerProcess server(dir_.path(), {});
    lcm_io::GroupReceiver answers(lcm_io::ParseLcmUrl("udpm://"), "lo");
    // Another program of this machine has joined on v0, so that copies of what is
    // sent by v0 come in there.
    const int other = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ip_mreqn membership{};
    membership.imr_ifindex = static_cast<int>(::if_nametoindex("v0"));
    ::inet_pton(AF_INET, kGroup, &membership.imr_multiaddr);
    ASSERT_EQ(::setsockopt(other, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership),
              0);
    Send({QueryDatagram(Query(1), 1)}, kGroup, "v0");
    Send({QueryDatagram(Query(1), 2)}, kGroup, "lo");
    EXPECT_EQ(NextAnswer(answers).sequence, 2);
    ::close(other);
  }
  const std::string url = "udpm://239.1.1.1:7667";
  const auto refused = testing::RunProgram(
      "grouser-server", {"--state", dir_.path(), "--grpc", "127.0.0.1:0", "--lcm-url", url},
      dir_.path());
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("239.1.1.1 does not work on lo"),
                                 HasSubstr("did not come back"), HasSubstr("--lcm-interface")));
  testing::ServerProcess server(dir_.path(), {"--lcm-url", url, "--lcm-interface", "v0"});
  client::LcmClient client(url, "v0");
  auto query = Query(1);
  EXPECT_TRUE(client.Query(&query, kTimeout).has_value());
  EXPECT_THROW(client::LcmClient(url, "none"), std::runtime_error);
}

}  // namespace
}  // namespace grouser

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  grouser::g_no_network = grouser::EnterOwnNetwork();
  return RUN_ALL_TESTS();
}
