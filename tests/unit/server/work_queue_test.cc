#include "server/vehicle/work_queue.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <future>
#include <system_error>

namespace grouser::server {
namespace {

int Nice() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); }

/// A queue whose only thread is held until Release().
struct Held {
  explicit Held(std::size_t most) : queue(1, most, 0) {
    std::promise<void> begun;
    queue.Post(this, [&, future = release.get_future().share()](int) {
      begun.set_value();
      future.wait();
    });
    begun.get_future().wait();
  }
  void Release() { release.set_value(); }

  std::promise<void> release;
  WorkQueue queue;
};

TEST(WorkQueue, WorkThatIsRemovedGivesItsPlaceUpAndIsNotDone) {
  Held held(3);
  int key[4];
  std::vector<int> done;
  const auto post = [&](int k) {
    return held.queue.Post(&key[k], [&, k](int) { done.push_back(k); });
  };
  for (int round = 0; round < 100; ++round) {  // far more than have room
    ASSERT_TRUE(post(0));
    ASSERT_TRUE(held.queue.Remove(&key[0])) << round;
  }
  EXPECT_TRUE(post(0) && post(1) && post(2));
  EXPECT_FALSE(post(3));
  EXPECT_TRUE(held.queue.Remove(&key[1]));
  EXPECT_FALSE(held.queue.Remove(&key[1]));
  EXPECT_FALSE(held.queue.Remove(&held));  // has begun
  EXPECT_TRUE(post(3));
  std::promise<void> end;
  held.Release();
  while (!held.queue.Post(&end, [&](int) { end.set_value(); })) std::this_thread::yield();
  end.get_future().wait();
  EXPECT_EQ(done, (std::vector<int>{0, 2, 3}));
}

TEST(WorkQueue, OneOwnerLeavesAsMuchFreeAsItHas) {
  Held held(8);
  int key[8];
  const auto post = [&](int k, const char* owner) {
    return held.queue.Post(
        &key[k], [](int) {}, owner);
  };
  for (int k = 0; k < 4; ++k) EXPECT_TRUE(post(k, "one")) << k;
  EXPECT_FALSE(post(4, "one"));
  EXPECT_TRUE(post(4, "two") && post(5, "two"));
  EXPECT_FALSE(post(6, "two")) << "two places are left";
  EXPECT_TRUE(post(6, "three"));
  EXPECT_FALSE(post(7, "two"));
  EXPECT_TRUE(held.queue.Remove(&key[0]) && held.queue.Remove(&key[1]));
  EXPECT_TRUE(post(0, "two"));
  EXPECT_FALSE(post(1, "two"));
  EXPECT_TRUE(post(1, "four"));
  held.Release();
}

// Threads begin with the nice value of the one that makes them.
TEST(WorkQueue, NiceIsAddedUpTo19) {
  for (const int more : {0, 3, 17}) {
    std::thread([more] {
      ASSERT_EQ(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), Nice() + more), 0);
      const int expected = std::min(Nice() + 5, 19);
      std::promise<int> nice;
      WorkQueue queue(1, 1, 5);
      queue.Post(&nice, [&](int) { nice.set_value(Nice()); });
      EXPECT_EQ(nice.get_future().get(), expected) << more;
    }).join();
  }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// No memory for the stacks of all 64: those that have started end, and the fault is said.
TEST(WorkQueue, ThreadsThatCannotBeStartedAreNoHang) {
  constexpr std::size_t kStack = std::size_t{256} << 20;
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  rlimit before;
  ASSERT_EQ(::getrlimit(RLIMIT_AS, &before), 0);
  rlimit limit = before;
  limit.rlim_cur = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + 4 * kStack;
  pthread_attr_t usual, large;
  ASSERT_EQ(::pthread_getattr_default_np(&usual), 0);
  ASSERT_EQ(::pthread_getattr_default_np(&large), 0);
  ::pthread_attr_setstacksize(&large, kStack);
  ASSERT_EQ(::pthread_setattr_default_np(&large), 0);
  ASSERT_EQ(::setrlimit(RLIMIT_AS, &limit), 0);
  EXPECT_THROW(WorkQueue(64, 1, 0), std::system_error);
  ::setrlimit(RLIMIT_AS, &before);
  ::pthread_setattr_default_np(&usual);
}
#endif

}  // namespace
}  // namespace grouser::server
