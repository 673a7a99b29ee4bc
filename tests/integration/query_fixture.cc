#include "tests/integration/query_fixture.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "proto/records/model_file.h"
#include "server/core/repository.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::testing {
namespace {

std::string ReadAll(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string NewLogName(const std::string& log_dir) {
  static std::atomic<int> count = 0;
  return log_dir + "/program-" + std::to_string(++count);
}

int ExitCode(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::vector<std::string> ServerArguments(const std::string& state_dir,
                                         std::vector<std::string> more) {
  std::vector<std::string> arguments = {"--state", state_dir, "--port-file", state_dir + "/port"};
  if (std::find(more.begin(), more.end(), "--grpc") == more.end()) {
    arguments.insert(arguments.end(), {"--grpc", "127.0.0.1:0"});
  }
  arguments.insert(arguments.end(), more.begin(), more.end());
  std::filesystem::create_directories(state_dir);
  std::filesystem::remove(state_dir + "/port");
  return arguments;
}

}  // namespace

v1alpha1::Model PhysicsModel(const std::string& name, double k_phi) {
  v1alpha1::Model model;
  model.set_name(name);
  model.set_kind(v1alpha1::MODEL_KIND_BEKKER);
  model.mutable_soil()->set_name("test sand");
  model.mutable_soil()->set_gravity_m_per_s2(9.81);
  model.mutable_wheel()->set_radius_m(0.0625);
  model.mutable_wheel()->set_width_m(0.05);
  surrogate::BekkerParameters parameters;
  parameters.k_phi = k_phi;
  surrogate::SetBekker(parameters, &model);
  auto* domain = model.mutable_domain();
  domain->set_slip_min(-1);
  domain->set_slip_max(1);
  domain->set_attack_angle_max_rad(1.6);
  domain->set_load_min_n(10);
  domain->set_load_max_n(60);
  domain->set_speed_m_per_s(0.1);
  domain->set_froude_max(0.1);
  for (int k = 0; k < surrogate::kOutputs; ++k) {
    model.add_sd_fit_inside(0.1);
    model.add_sd_fit_growth(0.2);
    model.add_sd_patch(0.1);
    model.add_interval_factor(1.645);
    model.add_sd_form(std::numeric_limits<double>::quiet_NaN());
  }
  model.set_interval_level(0.9);
  surrogate::SetGoldenVectors(&model);
  return model;
}

std::string MakeStable(const std::string& state_dir, const v1alpha1::Model& model) {
  std::filesystem::create_directories(state_dir);
  const std::string path = state_dir + "/new.model";
  records::WriteModelFile(path, model);
  server::Repository repository(state_dir, "");
  const auto digest = repository.Publish(path);
  repository.SetAlias(model.name(), "stable", digest, "test", "");
  return digest;
}

Program::Program(const std::string& name, const std::vector<std::string>& arguments,
                 const std::string& log_dir, int descriptors)
    : log_(NewLogName(log_dir)) {
  const std::string path = std::string(GROUSER_BIN_DIR) + "/" + name;
  std::vector<char*> argv = {const_cast<char*>(path.c_str())};
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int out = ::open((log_ + ".out").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  const int err = ::open((log_ + ".err").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit limit{static_cast<rlim_t>(descriptors), static_cast<rlim_t>(descriptors)};
    if (descriptors > 0) ::setrlimit(RLIMIT_NOFILE, &limit);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(err, STDERR_FILENO);
    ::execv(path.c_str(), argv.data());
    ::_exit(127);
  }
  ::close(out);
  ::close(err);
  if (pid_ < 0) throw std::runtime_error("fork failed");
}

Program::~Program() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void Program::Signal(int number) {
  if (pid_ > 0) ::kill(pid_, number);
}

int Program::Wait() {
  if (pid_ < 0) return code_;
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return code_ = ExitCode(status);
}

bool Program::Running() {
  if (pid_ < 0) return false;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return true;
  pid_ = -1;
  code_ = ExitCode(status);
  return false;
}

std::string Program::Stdout() const { return ReadAll(log_ + ".out"); }
std::string Program::Stderr() const { return ReadAll(log_ + ".err"); }

Finished RunProgram(const std::string& name, const std::vector<std::string>& arguments,
                    const std::string& log_dir) {
  Program program(name, arguments, log_dir);
  const int code = program.Wait();
  return {code, program.Stdout(), program.Stderr()};
}

ServerProcess::ServerProcess(const std::string& state_dir, std::vector<std::string> more,
                             const std::string& program, int descriptors)
    : program_(program, ServerArguments(state_dir, std::move(more)), state_dir, descriptors) {
  const bool settled = Eventually([this] {
    return program_.Stderr().find("ready grpc=") != std::string::npos || !program_.Running();
  });
  if (!settled || !program_.Running()) {
    throw std::runtime_error(program + " did not get ready: " + program_.Stderr());
  }
  std::ifstream ports(state_dir + "/port");
  for (std::string line; std::getline(ports, line);) {
    (line.starts_with("http=") ? http_ : address_) = line.substr(5);
  }
}

void SleepMilliseconds(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

}  // namespace grouser::testing
