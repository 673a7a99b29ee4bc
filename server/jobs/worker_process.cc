#include "server/jobs/worker_process.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <linux/close_range.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "proto/records/os/descriptor_limit.h"
#include "proto/records/os/regular_file.h"

namespace grouser::server {
namespace {

using os::UniqueFd;

constexpr int kOutput = O_WRONLY | O_CREAT | O_TRUNC;

/// All that the child needs, made before the fork: between fork and exec only
/// async-signal-safe calls are allowed (another thread may hold any lock).
struct ChildPlan {
  const char* program;
  char* const* argv;
  char* const* environment;
  const char* folder;
  int in, out, log, report;
  int nice;
  bool idle;
  rlim_t memory, file;
  pid_t parent;
};

void CloseAboveStdio() {
  // Marked rather than closed: the report pipe must last until exec succeeds.
  if (::close_range(3, ~0U, CLOSE_RANGE_CLOEXEC) == 0) return;
  struct rlimit limit {};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  for (rlim_t fd = 3; fd < limit.rlim_cur; ++fd) {
    ::fcntl(static_cast<int>(fd), F_SETFD, FD_CLOEXEC);
  }
}

void ResetSignals() {
  struct sigaction standard {};
  standard.sa_handler = SIG_DFL;
  for (int signal = 1; signal < NSIG; ++signal) ::sigaction(signal, &standard, nullptr);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

[[noreturn]] void RunChild(const ChildPlan& plan) {
  ::setsid();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != plan.parent) ::_exit(127);  // it died before the line above
  ResetSignals();
  bool ok = ::dup2(plan.in, 0) == 0 && ::dup2(plan.out, 1) == 1 && ::dup2(plan.log, 2) == 2;
  [[maybe_unused]] const int nice = ::nice(plan.nice);  // added; where refused, as this program
  const struct sched_param unused {};
  if (plan.idle) ::sched_setscheduler(0, SCHED_IDLE, &unused);  // needs no right
  const struct rlimit no_core { 0, 0 };
  ::setrlimit(RLIMIT_CORE, &no_core);
  os::RestoreDescriptorLimit();
  if (plan.memory != 0) {
    const struct rlimit memory { plan.memory, plan.memory };
    ok = ok && ::setrlimit(RLIMIT_AS, &memory) == 0;
  }
  if (plan.file != 0) {
    const struct rlimit file { plan.file, plan.file };
    ok = ok && ::setrlimit(RLIMIT_FSIZE, &file) == 0;
  }
  ok = ok && ::chdir(plan.folder) == 0;
  if (ok) {
    CloseAboveStdio();
    ::execve(plan.program, plan.argv, plan.environment);
  }
  const int cause = errno;
  [[maybe_unused]] const ssize_t n = ::write(plan.report, &cause, sizeof cause);
  ::_exit(127);
}

/// Zero when the pipe closed by exec, else the child's errno.
int ReadReport(int fd) {
  int cause = 0;
  ssize_t n = 0;
  do {
    n = ::read(fd, &cause, sizeof cause);
  } while (n < 0 && errno == EINTR);
  return n == static_cast<ssize_t>(sizeof cause) ? cause : 0;
}

}  // namespace

std::string WorkerEnd::Text() const {
  if (!spawn_error.empty()) return "could not be started: " + spawn_error;
  if (timed_out) return "was stopped: it ran past its time limit";
  if (signal != 0) return fmt::format("was killed by signal {} ({})", signal, ::strsignal(signal));
  return fmt::format("exited with {}", exit_code);
}

WorkerProcess WorkerProcess::Spawn(WorkerCommand command) {
  const UniqueFd out = os::OpenRegular(command.stdout_path, kOutput);
  const UniqueFd log = os::OpenRegular(command.log_path, kOutput);
  UniqueFd in = command.lock.valid() ? UniqueFd(::fcntl(command.lock.get(), F_DUPFD_CLOEXEC, 3))
                                     : UniqueFd(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  int ends[2];
  if (!in.valid() || ::pipe2(ends, O_CLOEXEC) != 0) {
    throw std::runtime_error(command.argv[0] + ": " + std::strerror(errno));
  }
  const UniqueFd report_read(ends[0]);
  UniqueFd report_write(ends[1]);
  std::vector<char*> argv;
  for (auto& word : command.argv) argv.push_back(word.data());
  argv.push_back(nullptr);
  const ChildPlan plan{argv[0],
                       argv.data(),
                       environ,
                       command.folder.c_str(),
                       in.get(),
                       out.get(),
                       log.get(),
                       report_write.get(),
                       command.limits.nice,
                       command.limits.idle,
                       command.limits.memory_bytes,
                       command.limits.file_bytes,
                       ::getpid()};
  // _Fork: no fork handlers of libraries, which may lock.
  const pid_t pid = ::_Fork();
  if (pid < 0) throw std::runtime_error(command.argv[0] + ": fork: " + std::strerror(errno));
  if (pid == 0) RunChild(plan);
  report_write.Reset();
  // The child is ours and not collected, so its number cannot be reused.
  UniqueFd pidfd(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  const int pidfd_errno = errno;
  WorkerProcess process(pid, std::move(pidfd), std::move(command.lock));
  const int cause = ReadReport(report_read.get());
  if (cause != 0 || !process.pidfd_.valid()) {
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
    process.reaped_ = true;
    throw std::runtime_error(command.argv[0] + ": " +
                             std::strerror(cause != 0 ? cause : pidfd_errno));
  }
  return process;
}

WorkerProcess::~WorkerProcess() {
  if (!pidfd_.valid()) return;  // moved from
  SignalGroup(SIGKILL);
  Reap();
}

void WorkerProcess::SignalGroup(int signal) const {
  if (!reaped_) ::kill(-pid_, signal);
}

WorkerEnd WorkerProcess::Reap() {
  siginfo_t info{};
  const auto wait = [&](int flags) {
    int rc = 0;
    do {
      rc = ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | flags);
    } while (rc != 0 && errno == EINTR);
    return rc == 0;
  };
  WorkerEnd end;
  if (reaped_ || !wait(WNOWAIT)) return end;
  // While the leader is not collected its group number is ours.
  ::kill(-pid_, SIGKILL);
  wait(0);
  reaped_ = true;
  if (info.si_code == CLD_EXITED) {
    end.exit_code = info.si_status;
  } else {
    end.signal = info.si_status;
  }
  lock_.Reset();
  return end;
}

}  // namespace grouser::server
