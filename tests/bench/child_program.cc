#include "tests/bench/child_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

#include "tests/bench/surrogate_bench.h"

namespace grouser::bench {
namespace {

namespace fs = std::filesystem;

bool RunOn(int core) {
  if (core < 0) return true;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(core, &set);
  return ::sched_setaffinity(0, sizeof set, &set) == 0;
}

std::string LastOf(const std::string& log) {
  std::ifstream in(log);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  constexpr std::size_t kMost = 1000;
  return text.substr(text.size() - std::min(text.size(), kMost));
}

}  // namespace

std::string Beside(const std::string& name) {
  return fs::read_symlink("/proc/self/exe").parent_path() / name;
}

Pinned::Pinned(int core) {
  ::sched_getaffinity(0, sizeof before_, &before_);
  if (!RunOn(core)) throw std::runtime_error(fmt::format("core {}: cannot run there", core));
}

Pinned::~Pinned() { ::sched_setaffinity(0, sizeof before_, &before_); }

TempFolder::TempFolder() {
  char folder[] = "/tmp/grouser-bench-XXXXXX";
  if (!::mkdtemp(folder)) throw std::runtime_error("/tmp: cannot make a folder");
  path_ = folder;
}

TempFolder::~TempFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

ChildProgram::ChildProgram(std::vector<std::string> words, const std::string& grpc, int core)
    : program_(words[0]) {
  const std::string port = folder_ / "port";
  words.insert(words.end(), {"--grpc", grpc, "--port-file", port});
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const std::string log = folder_ / "log";
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int fd = ::open(log.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const bool ok = ::getppid() == parent && ::dup2(fd, STDERR_FILENO) >= 0 && RunOn(core);
    if (ok) ::execv(program_.c_str(), argv.data());
    ::_exit(127);
  }
  while (address_.empty()) {
    RssMib();  // throws where it has ended
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::string line;
    if (std::ifstream(port) >> line) address_ = line.substr(line.find('=') + 1);
  }
}

ChildProgram::~ChildProgram() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGTERM);
  ::waitpid(pid_, nullptr, 0);
}

double ChildProgram::RssMib() {
  if (pid_ < 0 || ::waitpid(pid_, nullptr, WNOHANG) != 0) {
    pid_ = -1;
    throw std::runtime_error(program_ + " has ended: " + LastOf(folder_ / "log"));
  }
  std::ifstream in(fmt::format("/proc/{}/statm", pid_));
  double size = 0, resident = 0;
  in >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

std::vector<std::string> ServerWords(const TempFolder& folder, const std::string& program) {
  return {program.empty() ? Beside("grouser-server") : program, "--state", folder / "state",
          "--shipped", FindShipped("surrogate/shipped")};
}

}  // namespace grouser::bench
