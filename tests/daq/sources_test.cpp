// TCP and serial against real sockets and a real terminal; a peer that hangs up, and one that falls silent.
#include "daq/logging.h"
#include "daq/packets.h"
#include "daq/tcp_server.h"
#include "datasets/error.h"
#include "support/message_of.h"

#include <array>
#include <fstream>
#include <functional>
#include <thread>

#include <gtest/gtest.h>
#include <pty.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

/// Sends frames [from, to) in packets of 16, at the pace of the rig where asked.
void send_frames(int fd, std::uint64_t from, std::uint64_t to, bool paced) {
  for (std::uint64_t first = from; first < to; first += 16) {
    const auto bytes = test::packet_bytes({.first = first});
    ASSERT_EQ(::write(fd, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    if (paced) std::this_thread::sleep_for(std::chrono::milliseconds(12));
  }
}

/// In a process whose clock says that the computer has slept for 1000 s since its start.
int in_a_computer_that_slept(const std::function<bool()>& is_well) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (::unshare(CLONE_NEWTIME) != 0) ::_exit(77);
    std::ofstream offsets("/proc/self/timens_offsets");
    if (!(offsets << "boottime 1000 0" << std::flush)) ::_exit(77);
    const pid_t inside = ::fork();  // children of the process are in the new name space, not it itself
    if (inside == 0) ::_exit(is_well() ? 0 : 1);
    int status = 0;
    ::waitpid(inside, &status, 0);
    ::_exit(WEXITSTATUS(status));
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WEXITSTATUS(status);
}

TEST(SourceClock, RunsOnWhileTheComputerSleeps) {
  const double before_s = steady_seconds();
  const int code = in_a_computer_that_slept([&] { return steady_seconds() >= before_s + 1000; });
  if (code == 77) GTEST_SKIP() << "no right to a name space of its own";
  EXPECT_EQ(code, 0);
}

TEST(Tcp, AHangUpIsAGapAndTheRunGoesOn) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const test::Server server;
  std::thread board([&] {
    const int first = server.accept();
    send_frames(first, 0, 800, true);
    ::close(first);
    const int second = server.accept();
    send_frames(second, 1600, 8000, false);
    ::close(second);
  });
  const auto source = open_source(server.name());
  const LogOutcome outcome = log_run(*source, file, test::cells("R1"), {.duration_s = 8}, test::summarizer(),
                                     {}, test::never_stop());
  board.join();
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_EQ(outcome.ledger.frames_emitted, 8000u) << "8 s of this board, which says 1000 Hz";
  EXPECT_EQ(outcome.ledger.frames_lost, 800u);
  EXPECT_EQ(outcome.ledger.source, server.name());
}

TEST(Tcp, SilenceIsNoticedAndTheSourceReopened) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const test::Server server;
  std::thread board([&] {
    const int first = server.accept();
    send_frames(first, 0, 160, true);
    const int second = server.accept();  // nothing was closed: the logger came back by itself
    send_frames(second, 160, 2000, false);
    ::close(second);
    ::close(first);
  });
  const auto source = open_source(server.name());
  bool seen_silent = false;
  const LogOutcome outcome = log_run(
      *source, file, test::cells("R1"), {.duration_s = 1.5}, test::summarizer(),
      [&](const LogProgress& progress) { seen_silent |= progress.silent; }, test::never_stop());
  board.join();
  EXPECT_TRUE(seen_silent);
  EXPECT_EQ(outcome.ledger.silences, 1u);
  EXPECT_EQ(outcome.ledger.frames_lost, 0u);
  EXPECT_EQ(outcome.state, RunState::kComplete);
}

TEST(Tcp, WhatCameWhileNobodyRecordedIsNoPartOfTheRun) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const test::Server server;
  const auto source = open_source(server.name());
  const int board = server.accept();
  send_frames(board, 0, 1600, false);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  source->idle();
  send_frames(board, 1600, 3200, false);
  const LogOutcome outcome = log_run(*source, file, test::cells("R1"), {.duration_s = 1}, test::summarizer(),
                                     {}, test::never_stop());
  ::close(board);
  EXPECT_EQ(outcome.ledger.first_sequence, 1600u);
  EXPECT_EQ(outcome.ledger.bytes_skipped, 0u);
}

/// A bridge that is in use answers so. It is called a few times a second, not as often as it hangs up.
TEST(Tcp, APeerThatHangsUpIsNotCalledAllTheTime) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const test::Server server;
  std::atomic<bool> ended{false};
  int calls = 0;
  std::thread peer([&] {
    for (; !ended; ++calls) ::close(server.accept());
  });
  const auto source = open_source(server.name());
  const LogOutcome outcome =
      log_run(*source, file, test::cells("R1"), {.duration_s = 1, .silence_s = 5, .give_up_s = 1},
              test::summarizer(), {}, test::never_stop());
  ended = true;
  open_source(server.name());
  peer.join();
  EXPECT_EQ(outcome.ledger.end_reason, "no frame for 1 s");
  EXPECT_LE(calls, 10);
}

TEST(Serial, ReadsARawTerminal) {
  int master = -1, slave = -1;
  std::array<char, 128> name{};
  ASSERT_EQ(::openpty(&master, &slave, name.data(), nullptr, nullptr), 0);
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  const auto source = open_source(std::string("serial:") + name.data() + "@115200");
  std::thread board([&] { send_frames(master, 0, 2000, true); });
  const LogOutcome outcome = log_run(*source, file, test::cells("R1"), {.duration_s = 1}, test::summarizer(),
                                     {}, test::never_stop());
  board.join();
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_EQ(outcome.ledger.frames_lost, 0u) << "every byte value must pass, 0x03 and 0x11 too";
  ::close(slave);
  ::close(master);
}

TEST(Sources, NamesAreChecked) {
  using test::message_of;
  EXPECT_NE(message_of([] { open_source("usbx"); }).find("is no source"), std::string::npos);
  EXPECT_NE(message_of([] { open_source("tcp:nowhere"); }).find("write tcp:HOST:PORT"), std::string::npos);
  EXPECT_NE(message_of([] { open_source("tcp:127.0.0.1:99999"); }).find("port 99999: must be"),
            std::string::npos);
  EXPECT_NE(message_of([] { open_source("tcp:127.0.0.1:1"); }).find("cannot be opened: Connection refused"),
            std::string::npos);
  EXPECT_NE(message_of([] { open_source("serial:/dev/none"); }).find("No such file"), std::string::npos);
  EXPECT_NE(message_of([] { open_source("serial:/dev/ttyS0@12"); }).find("baud rate"), std::string::npos);
  EXPECT_NE(message_of([] { open_source("replay:/nowhere"); }).find("cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace tunnelrig
