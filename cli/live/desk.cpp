#include "cli/live/desk.h"

#include "datasets/error.h"
#include "datasets/run_marks.h"

#include <fmt/format.h>

namespace tunnelrig::live {
namespace {

constexpr std::chrono::seconds kPatience{3};

}  // namespace

Desk::Desk(std::filesystem::path campaign, LiveFeed& feed, Book& book, std::atomic<bool>& stop,
           std::function<void()> changed)
    : campaign_(std::move(campaign)), feed_(feed), book_(book), stop_(stop), changed_(std::move(changed)) {}

CommandResult Desk::execute(const Command& command) {
  const std::string& name = command.name;
  if (name == "note" || name == "exclude" || name == "include") return mark(command);
  if (name == "target") return aim(command);
  if (name == "metadata") {
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [column, value] : command.values) metadata_[column] = value;
    }
    changed_();
    return {.problem = "", .text = "from the next run on"};
  }
  if (name == "stop") return stop(command);
  const Position position = feed_.position();
  if (position.phase == Phase::kRecording)
    return {.problem = fmt::format("{} is being recorded; stop it first", position.run.run), .text = ""};
  return hand_over(command);
}

/// A page names the run that it shows: by the time its command is here, that may be over and the next begun.
CommandResult Desk::stop(const Command& command) {
  const Position position = feed_.raise_in_run(command.run, stop_);
  const std::string& run = position.run.run;
  if (position.phase != Phase::kRecording) return {.problem = "nothing is being recorded", .text = ""};
  if (!command.run.empty() && command.run != run)
    return {.problem = fmt::format("{} is being recorded, not {}", run, command.run), .text = ""};
  return {.problem = "", .text = fmt::format("{} ends here; it is kept as partial", run)};
}

CommandResult Desk::hand_over(const Command& command) {
  std::future<CommandResult> answer;
  {
    const std::lock_guard lock(mutex_);
    if (order_) return {.problem = "another command is waiting; try again", .text = ""};
    order_ = std::make_unique<Order>(command);
    answer = order_->answered();
    came_.notify_all();
  }
  try {
    if (answer.wait_for(kPatience) == std::future_status::ready) return answer.get();
  } catch (const std::future_error&) {
    return {.problem = "the program is ending", .text = ""};
  }
  return {.problem = "", .text = "asked for; it has not begun yet"};
}

std::unique_ptr<Order> Desk::wait(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, patience, [&] { return order_ != nullptr; });
  return std::move(order_);
}

std::map<std::string, std::optional<double>> Desk::metadata() const {
  const std::lock_guard lock(mutex_);
  return metadata_;
}

CommandResult Desk::mark(const Command& command) {
  const std::string run = command.run.empty() ? feed_.position().run.run : command.run;
  if (run.empty()) return {.problem = "no run has been recorded yet; name one", .text = ""};
  {
    const std::lock_guard lock(marking_);
    CampaignFile file(campaign_, CampaignFile::Access::kWrite);
    if (command.name == "note")
      add_note(file, run, command.text);
    else if (command.name == "exclude")
      exclude_run(file, run, command.reason);
    else
      include_run(file, run);
  }
  book_.look();
  return {};
}

CommandResult Desk::aim(const Command& command) {
  Target target = feed_.target();
  target.c_t_u95 = command.c_t_u95.value_or(target.c_t_u95);
  target.u_percent_u95 = command.u_percent_u95.value_or(target.u_percent_u95);
  feed_.aim(target);
  return {};
}

}  // namespace tunnelrig::live
