// Queues of pages: bounded; display events are dropped, how things stand never is.
#include "cli/live/viewers.h"

#include "cli/live/alarms.h"

#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig::live {
namespace {

using testing::HasSubstr;

constexpr std::chrono::milliseconds kNow{0};

TEST(Viewers, ANewOneIsToldHowThingsStand) {
  Viewers viewers;
  viewers.tell("hello", "1");
  viewers.show("frames", "2");
  viewers.tell("state", "3");
  viewers.tell("state", "4");
  const auto viewer = viewers.join();
  EXPECT_EQ(*viewer->next(kNow), "event: hello\ndata: 1\n\n");
  EXPECT_EQ(*viewer->next(kNow), "event: state\ndata: 4\n\n");
  EXPECT_EQ(viewer->next(kNow), nullptr);
}

TEST(Viewers, ASlowOneLosesDisplayEventsAlone) {
  Viewers viewers;
  const auto slow = viewers.join(), fast = viewers.join();
  viewers.tell("campaign", "first");
  for (int i = 0; i < 1000; ++i) {
    viewers.show("frames", std::to_string(i));
    viewers.tell("state", std::to_string(i));
    while (fast->next(kNow)) {
    }
  }
  viewers.tell("alarms", "loss");
  EXPECT_EQ(viewers.dropped(), 1000u - Viewer::kMostDisplay);
  std::vector<std::string> got;
  while (const EventText text = slow->next(kNow)) got.push_back(*text);
  ASSERT_EQ(got.size(), Viewer::kMostDisplay + 3);
  EXPECT_EQ(got[0], "event: campaign\ndata: first\n\n");
  EXPECT_EQ(got[1], "event: frames\ndata: 960\n\n") << "the oldest are dropped";
  EXPECT_EQ(got[got.size() - 2], "event: state\ndata: 999\n\n") << "the newest state, once";
  EXPECT_EQ(got.back(), "event: alarms\ndata: loss\n\n");
}

TEST(Viewers, AreSoManyAndNoMore) {
  Viewers viewers;
  std::vector<std::shared_ptr<Viewer>> joined;
  for (std::size_t i = 0; i < Viewers::kMost; ++i) joined.push_back(viewers.join());
  EXPECT_EQ(viewers.join(), nullptr);
  joined.pop_back();
  EXPECT_EQ(viewers.count(), Viewers::kMost - 1);
  EXPECT_NE(viewers.join(), nullptr);
}

TEST(Viewers, ClosingWakesThem) {
  Viewers viewers;
  const auto viewer = viewers.join();
  std::thread closer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    viewers.close();
  });
  EXPECT_EQ(viewer->next(std::chrono::seconds(20)), nullptr);
  EXPECT_TRUE(viewer->closed());
  closer.join();
  EXPECT_EQ(viewers.join(), nullptr);
}

TEST(Alarms, StayForAWhileAndMarkTheRun) {
  using std::chrono::seconds;
  const Alarms::Time start{};
  Alarms alarms;
  EXPECT_TRUE(alarms.settle(start)) << "that there are none is news at first";
  alarms.set("clipping", 2, true, "10 samples", start);
  EXPECT_TRUE(alarms.settle(start));
  EXPECT_THAT(alarms.json(), HasSubstr(R"("kind":"clipping","rotor":2,"text":"10 samples")"));
  alarms.set("clipping", 2, false, "", start + seconds(1));
  EXPECT_FALSE(alarms.settle(start + seconds(4)));
  EXPECT_TRUE(alarms.settle(start + seconds(6)));
  EXPECT_EQ(alarms.json(), R"({"active":[]})");
  EXPECT_EQ(alarms.of_run(), "clipping");
  alarms.set("loss", 0, true, "1 lost", start);
  alarms.set("disk", 0, true, "full", start);
  EXPECT_EQ(alarms.of_run(), "clipping;disk;loss");
  alarms.begin_run();
  EXPECT_EQ(alarms.of_run(), "");
  EXPECT_THAT(alarms.json(), HasSubstr("disk"));
  EXPECT_THAT(alarms.json(), testing::Not(HasSubstr("loss")));
}

}  // namespace
}  // namespace tunnelrig::live
