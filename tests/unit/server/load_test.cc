#include <gtest/gtest.h>

#include "server/net/backlog.h"
#include "server/net/load_control.h"

namespace grouser::server {
namespace {

using Verdict = LoadControl::Verdict;
using std::chrono::milliseconds;

class LoadControlTest : public ::testing::Test {
 protected:
  LoadControlTest() { load_.SetLimits({1000, std::chrono::seconds(10)}); }
  LoadControl load_;
  grpc::CallbackServerContext context_;  // of no call: all are of one connection
};

TEST_F(LoadControlTest,
       OneConnectionHoldsAsMuchAsItLeavesFree) {  // of 1000, and 125 for small ones
  LoadControl::Ticket first, second, third;
  EXPECT_EQ(load_.Begin(first, context_, 100), Verdict::kAdmitted);
  load_.Answer(first, 300);
  EXPECT_EQ(load_.bytes(), 400u);
  EXPECT_EQ(load_.Begin(second, context_, 326), Verdict::kConnectionFull);
  EXPECT_FALSE(second.counted());
  EXPECT_EQ(load_.Begin(second, context_, 325), Verdict::kAdmitted);
  EXPECT_EQ(load_.Begin(third, context_, 401), Verdict::kNoMemory);
  EXPECT_EQ(load_.refused(), 2u);
  load_.End(first);
  load_.End(first);  // idempotent
  EXPECT_EQ(load_.bytes(), 325u);
  load_.End(third);  // never began
  load_.End(second);
  EXPECT_EQ(load_.bytes(), 0u);
}

TEST_F(LoadControlTest, AnAnswerThatIsThereIsNeverRefused) {
  LoadControl::Ticket big, next;
  EXPECT_EQ(load_.Begin(big, context_, 10), Verdict::kAdmitted);
  load_.Answer(big, 5000);
  EXPECT_TRUE(load_.Tight());
  EXPECT_EQ(load_.Begin(next, context_, 1), Verdict::kNoMemory);
  load_.End(big);
  EXPECT_EQ(load_.Begin(next, context_, 1), Verdict::kAdmitted);
  load_.End(next);
}

// What an answer will take is counted before it is made, then what it takes.
TEST_F(LoadControlTest, AnAnswerIsExpectedAndThenCounted) {
  LoadControl::Ticket first, second;
  EXPECT_EQ(load_.Begin(first, context_, 10), Verdict::kAdmitted);
  EXPECT_EQ(load_.Expect(first, 600), Verdict::kAdmitted);
  EXPECT_EQ(load_.bytes(), 610u);
  EXPECT_EQ(load_.Begin(second, context_, 10), Verdict::kConnectionFull);
  load_.Answer(first, 200);
  EXPECT_EQ(load_.bytes(), 210u);
  EXPECT_EQ(load_.Begin(second, context_, 10), Verdict::kAdmitted);
  EXPECT_EQ(load_.Expect(second, 2000), Verdict::kNoMemory);
  EXPECT_EQ(load_.Expect(second, 700), Verdict::kConnectionFull);
  EXPECT_EQ(load_.bytes(), 220u) << "nothing is added";
  EXPECT_EQ(load_.Expect(second, 600), Verdict::kAdmitted);
  load_.End(first);
  EXPECT_EQ(load_.bytes(), 610u);
  load_.End(second);  // without an answer
  EXPECT_EQ(load_.bytes(), 0u);
  EXPECT_EQ(load_.Begin(first, context_, 10), Verdict::kAdmitted);
  EXPECT_EQ(load_.Expect(first, 5000), Verdict::kAdmitted) << "one alone";
  load_.End(first);
  EXPECT_EQ(load_.Expect(first, 1), Verdict::kAdmitted) << "not counted";
  EXPECT_EQ(load_.bytes(), 0u);
}

TEST_F(LoadControlTest, NoBytesAreHeldWhateverTheConnectionHolds) {
  LoadControl::Ticket big, change;
  EXPECT_EQ(load_.Begin(big, context_, 100), Verdict::kAdmitted);
  load_.Answer(big, 5000);
  EXPECT_EQ(load_.Hold(change, context_, 0), Verdict::kAdmitted);
  load_.End(change);
  load_.End(big);
}

TEST_F(LoadControlTest, RefusalsSayWhenToTryAgain) {
  for (const auto verdict : {Verdict::kNoMemory, Verdict::kConnectionFull, Verdict::kBusy}) {
    const auto status = RefusalStatus(verdict);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_NE(status.error_message().find("try again in 50 ms"), std::string::npos);
  }
}

/// Ten messages are done with every 10 ms: one takes 1 ms.
class BacklogTest : public ::testing::Test {
 protected:
  BacklogTest() {
    backlog_.SetCount([this] { return waiting_; });
  }
  bool Pass(int ms) {
    for (int i = 0; i < ms; i += 10) {
      for (int k = 0; k < 10; ++k) backlog_.Done();
      now_ += milliseconds(10);
      too_long_ = backlog_.TooLong(now_);
    }
    return too_long_;
  }
  Backlog backlog_;
  std::size_t waiting_ = 0;
  bool too_long_ = false;
  Backlog::Clock::time_point now_ = Backlog::Clock::now();
};

TEST_F(BacklogTest, ALongWaitThatLastsIsTooLong) {
  waiting_ = 20;
  EXPECT_TRUE(Pass(400));
  waiting_ = 5;
  EXPECT_FALSE(Pass(10));
}

TEST_F(BacklogTest, ABurstIsAnswered) {
  Pass(400);
  waiting_ = 20;
  EXPECT_FALSE(Pass(50));
  waiting_ = 0;
  EXPECT_FALSE(Pass(50));
  waiting_ = 20;
  EXPECT_FALSE(Pass(50));
}

TEST_F(BacklogTest, AShortQueueIsNoBacklog) {
  waiting_ = 9;
  EXPECT_FALSE(Pass(1000));
}

}  // namespace
}  // namespace grouser::server
