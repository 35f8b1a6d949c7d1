// `log --plan` at a terminal, between two runs: the operator moves the rig while the board goes on sending.
#include "cli/program.h"
#include "daq/packets.h"
#include "daq/tcp_server.h"
#include "datasets/csv.h"
#include "datasets/raw_store.h"
#include "support/temporary_folder.h"

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>

namespace tunnelrig {
namespace {

using Clock = std::chrono::steady_clock;

/// A board that samples at the rig's rate, whoever reads.
class Board {
 public:
  Board() : thread_([this] { run(); }) {}
  ~Board() {
    ended_ = true;
    thread_.join();
  }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  std::string name() const { return server_.name(); }
  std::uint64_t sent() const { return sent_; }

 private:
  void run() {
    const int fd = server_.accept();
    for (auto due = Clock::now(); !ended_; due += std::chrono::milliseconds(12)) {
      std::this_thread::sleep_until(due);
      const auto bytes = test::packet_bytes({.first = sent_, .ticks_per_frame = 63000});
      ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      sent_ += 16;
    }
    ::close(fd);
  }

  test::Server server_;
  std::atomic<std::uint64_t> sent_{0};
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

/// `log --plan` of one run, on a terminal of its own.
class Terminal {
 public:
  Terminal(const std::filesystem::path& folder, const std::string& source, const char* duration_s = "0.2") {
    write_text(folder / "plan.csv",
               std::string("session,location,repeat,duration_s\nS1,OT,1,") + duration_s + "\n");
    pid_ = ::forkpty(&fd_, nullptr, nullptr, nullptr);
    if (pid_ != 0) return;
    if (::chdir(folder.c_str()) == 0)
      ::execl(TUNNELRIG_PROGRAM, TUNNELRIG_PROGRAM, "log", "--db", "c.db", "--plan", "plan.csv", "--source",
              source.c_str(), nullptr);
    ::_exit(127);
  }
  ~Terminal() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
    hang_up();
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  bool shows(const std::string& text) {
    return until([&] { return shown_.find(text) != std::string::npos; });
  }
  /// The window is closed.
  void hang_up() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  void type(const std::string& keys) {
    ASSERT_EQ(::write(fd_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  /// The exit code; -1 where it does not end.
  int ended() {
    int status = 0;
    if (!until([&] { return ::waitpid(pid_, &status, WNOHANG) == pid_; })) return -1;
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  template <typename Condition>
  bool until(const Condition& condition) {
    const auto deadline = Clock::now() + std::chrono::seconds(20);
    while (!condition()) {
      if (Clock::now() > deadline) return false;
      pollfd output{fd_, POLLIN, 0};
      std::array<char, 4096> text{};
      const bool some = ::poll(&output, 1, 50) > 0;
      const ssize_t size = some ? ::read(fd_, text.data(), text.size()) : 0;
      if (size > 0) shown_.append(text.data(), static_cast<std::size_t>(size));
    }
    return true;
  }

  int fd_ = -1;
  pid_t pid_ = -1;
  std::string shown_;
};

TEST(Operator, WhatCameWhileTheRigWasMovedIsNoPartOfTheRun) {
  const test::TemporaryFolder folder;
  const Board board;
  Terminal terminal(folder.path(), board.name());
  ASSERT_TRUE(terminal.shows("Enter when ready"));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  const std::uint64_t ready = board.sent();
  terminal.type("\n");
  ASSERT_NE(terminal.ended(), -1);
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  const auto ledger = ledger_of(file, raw_run(file, "R0001").value().id).value();
  EXPECT_GT(ready, 1600u);
  EXPECT_GT(ledger.first_sequence + 800, ready)
      << "at most a tenth of a second, and what a busy machine adds";
  EXPECT_EQ(ledger.frames_lost, 0u);
}

TEST(Operator, CtrlCAtTheQuestionEndsThereWithoutARun) {
  const test::TemporaryFolder folder;
  const Board board;
  Terminal terminal(folder.path(), board.name());
  ASSERT_TRUE(terminal.shows("Enter when ready"));
  terminal.type("\x03");
  EXPECT_EQ(terminal.ended(), 0);
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  EXPECT_THAT(raw_runs(file), testing::IsEmpty());
}

TEST(Operator, AClosedTerminalEndsTheRunAsCtrlCDoes) {
  const test::TemporaryFolder folder;
  const Board board;
  Terminal terminal(folder.path(), board.name(), "60");
  ASSERT_TRUE(terminal.shows("Enter when ready"));
  terminal.type("\n");
  ASSERT_TRUE(terminal.shows(" frames, "));
  terminal.hang_up();
  EXPECT_NE(terminal.ended(), -1);
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  const RawRun run = raw_run(file, "R0001").value();
  EXPECT_EQ(run.state, RunState::kPartial);
  EXPECT_EQ(ledger_of(file, run.id)->end_reason, "stopped by the user");
}

/// What the program says on a terminal; `setting` for its environment.
std::string said_on_a_terminal(const char* setting) {
  int fd = -1;
  const pid_t pid = ::forkpty(&fd, nullptr, nullptr, nullptr);
  if (pid == 0) {
    const std::array<const char*, 2> environment = {setting, nullptr};
    const std::array<const char*, 4> arguments = {TUNNELRIG_PROGRAM, "doctor", "--db=none.db", nullptr};
    ::execve(TUNNELRIG_PROGRAM, const_cast<char* const*>(arguments.data()),
             const_cast<char* const*>(environment.data()));
    ::_exit(127);
  }
  std::string said;
  std::array<char, 4096> text{};
  for (ssize_t size = 0; (size = ::read(fd, text.data(), text.size())) > 0;)
    said.append(text.data(), static_cast<std::size_t>(size));
  ::close(fd);
  ::waitpid(pid, nullptr, 0);
  return said;
}

TEST(Operator, ColoursAreLeftOutOnRequest) {
  EXPECT_THAT(said_on_a_terminal("NO_COLOR="), testing::HasSubstr("\x1b[31mtunnelrig:\x1b[0m none.db"));
  EXPECT_THAT(said_on_a_terminal("NO_COLOR=1"), testing::StartsWith("tunnelrig: none.db"));
}

}  // namespace
}  // namespace tunnelrig
