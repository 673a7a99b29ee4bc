#include "tests/bench/echo_server.h"

#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

#include "grouser/v1alpha1/terrain_service.grpc.pb.h"
#include "grouser_lcm/wheel_measured_t.hpp"
#include "grouser_lcm/wheel_query_t.hpp"
#include "grouser_lcm/wheel_response_t.hpp"
#include "proto/lcm/group_receiver.h"

namespace grouser::bench {
namespace {

using Request = v1alpha1::EvaluateWheelsRequest;
using Response = v1alpha1::EvaluateWheelsResponse;

constexpr char kAll[] = ".all", kFields[] = ".fields";

std::string ReadAll(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The saved answers of gRPC.
class Answers {
 public:
  explicit Answers(const std::string& folder) {
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      const std::string name = file.path().filename();
      if (!name.ends_with(kAll) && !name.ends_with(kFields)) continue;
      if (!answers_["/" + name].ParseFromString(ReadAll(file.path()))) {
        throw std::runtime_error(file.path().string() + ": no answer");
      }
    }
  }
  /// Null where none was saved.
  Response* To(const Request& request) {
    const auto it = answers_.find(AnswerPath("", request));
    return it == answers_.end() ? nullptr : &it->second;
  }

 private:
  std::map<std::string, Response> answers_;
};

grpc::Status NoAnswer() { return {grpc::StatusCode::NOT_FOUND, "echo: no saved answer"}; }

/// A request whose memory is reused, and whichever answer: nothing is copied.
class Message final : public grpc::MessageHolder<Request, Response> {
 public:
  Message() {
    set_request(&request_);
    set_response(&none_);
  }
  void Release() override { free_ = true; }
  void Answer(Response* answer) { set_response(answer); }
  bool Take() { return free_.exchange(false); }

 private:
  std::atomic<bool> free_{false};
  Request request_;
  Response none_;
};

class Messages final : public grpc::MessageAllocator<Request, Response> {
 public:
  Message* AllocateMessages() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (auto& message : messages_) {
      if (message->Take()) return message.get();
    }
    return messages_.emplace_back(std::make_unique<Message>()).get();
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Message>> messages_;
};

class Stream final : public grpc::ServerBidiReactor<Request, Response> {
 public:
  explicit Stream(Answers& answers) : answers_(answers) { StartRead(&request_); }
  void OnReadDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::OK);
    Response* answer = answers_.To(request_);
    answer != nullptr ? StartWrite(answer) : Finish(NoAnswer());
  }
  void OnWriteDone(bool) override { StartRead(&request_); }
  void OnDone() override { delete this; }

 private:
  Answers& answers_;
  Request request_;
};

class Service final : public v1alpha1::TerrainService::CallbackService {
 public:
  explicit Service(const std::string& folder) : answers_(folder) {
    SetMessageAllocatorFor_EvaluateWheels(&messages_);
  }
  grpc::ServerUnaryReactor* EvaluateWheels(grpc::CallbackServerContext* context,
                                           const Request* request, Response*) override {
    Response* answer = answers_.To(*request);
    if (answer != nullptr) static_cast<Message*>(context->GetRpcAllocatorState())->Answer(answer);
    auto* reactor = context->DefaultReactor();
    reactor->Finish(answer != nullptr ? grpc::Status::OK : NoAnswer());
    return reactor;
  }
  grpc::ServerBidiReactor<Request, Response>* StreamWheels(grpc::CallbackServerContext*) override {
    return new Stream(answers_);
  }

 private:
  Answers answers_;
  Messages messages_;
};

/// Answers LCM queries of any number of states that an answer was saved for.
class LcmEcho {
 public:
  LcmEcho(const std::string& folder, const lcm_io::LcmUrl& url, const std::string& interface)
      : folder_(folder), receiver_(url, interface), publisher_(url.Text()) {}
  int fd() const { return receiver_.fd(); }
  void Take() {
    while (const auto message = receiver_.Next()) {
      grouser_lcm::wheel_query_t query;
      const auto bytes = message->payload;
      if (message->channel == "GROUSER_QUERY" &&
          query.decode(bytes.data(), 0, static_cast<int>(bytes.size())) >= 0) {
        Answer(query);
      }
    }
  }

 private:
  struct Saved {
    grouser_lcm::wheel_response_t response;
    grouser_lcm::wheel_measured_t measured;
    bool is_measured = false;
  };

  template <class T>
  static bool Decode(const std::string& path, T* to) {
    const std::string bytes = ReadAll(path);
    return to->decode(bytes.data(), 0, static_cast<int>(bytes.size())) >= 0;
  }

  void Answer(const grouser_lcm::wheel_query_t& query) {
    auto [it, is_new] = saved_.try_emplace(query.n);
    Saved& saved = it->second;
    if (is_new) {
      if (!Decode(LcmAnswerPath(folder_, query.n), &saved.response)) {
        throw std::runtime_error("no saved answer to " + std::to_string(query.n) + " states");
      }
      saved.is_measured = Decode(LcmMeasuredPath(folder_, query.n), &saved.measured);
    }
    const auto address = [&query](auto* message) {
      message->utime = query.utime;
      message->sequence = query.sequence;
      message->sender = query.sender;
    };
    address(&saved.response);
    address(&saved.measured);
    if (saved.is_measured) publisher_.publish("GROUSER_MEASURED", &saved.measured);
    publisher_.publish("GROUSER_RESPONSE", &saved.response);
  }

  const std::string folder_;
  lcm_io::GroupReceiver receiver_;
  lcm::LCM publisher_;
  std::map<int, Saved> saved_;
};

/// Readable once SIGTERM has come, which from now on does nothing else.
int TermFd() {
  sigset_t term;
  sigemptyset(&term);
  sigaddset(&term, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &term, nullptr);
  return ::signalfd(-1, &term, SFD_CLOEXEC);
}

void WritePortFile(const std::string& path, const std::string& address) {
  std::ofstream(path + ".new") << "grpc=" << address << "\n";
  std::filesystem::rename(path + ".new", path);
}

}  // namespace

std::string AnswerPath(const std::string& folder, const Request& request) {
  return folder + "/" + std::to_string(request.states().load_n_size()) +
         (request.fields().empty() ? kAll : kFields);
}
std::string LcmAnswerPath(const std::string& folder, int states) {
  return folder + "/" + std::to_string(states) + ".lcm";
}
std::string LcmMeasuredPath(const std::string& folder, int states) {
  return folder + "/" + std::to_string(states) + ".measured";
}

void RunEcho(const EchoOptions& options) {
  const int term = TermFd();  // before there are threads
  Service service(options.answers);
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(options.grpc, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  if (!server) throw std::runtime_error("grpc: cannot listen on " + options.grpc);
  std::unique_ptr<LcmEcho> lcm;
  if (!options.lcm_url.empty()) {
    lcm = std::make_unique<LcmEcho>(options.answers, lcm_io::ParseLcmUrl(options.lcm_url),
                                    options.lcm_interface);
  }
  const bool has_path = options.grpc.starts_with("unix:");
  WritePortFile(options.port_file, has_path ? options.grpc : "127.0.0.1:" + std::to_string(port));
  pollfd waiting[2] = {{term, POLLIN, 0}, {lcm ? lcm->fd() : -1, POLLIN, 0}};
  while (::poll(waiting, 2, -1) >= 0 && waiting[0].revents == 0) {
    if (waiting[1].revents != 0) lcm->Take();
  }
  server->Shutdown(std::chrono::system_clock::now());
}

}  // namespace grouser::bench
