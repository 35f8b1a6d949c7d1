#include "daq/usb_source.h"

#include "daq/sources.h"
#include "daq/usb_board.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

namespace tunnelrig {
namespace {

constexpr std::chrono::milliseconds kQuiet{20};
constexpr int kOpenTries = 3;
constexpr double kStatistics_s = 5;

class UsbSource : public PacketSource {
 public:
  UsbSource(std::string name, const UsbSourceSettings& settings)
      : name_(std::move(name)), settings_(settings), bus_(std::make_shared<UsbBus>()) {
    std::string why;
    for (int attempt = 0; attempt < kOpenTries && !open(why); ++attempt) {
    }
    if (!stream_) throw InputError::in(name_, "{}", why);
    settings_.serial = board_->serial();  // from now on no other board fits
    board_in_use_ = {settings_.serial, settings_.oversampling};
  }

  ~UsbSource() override {
    if (board_ && !broken_) board_->stop();
    stream_.reset();
  }
  UsbSource(const UsbSource&) = delete;
  UsbSource& operator=(const UsbSource&) = delete;

  std::string name() const override { return name_; }
  std::optional<BoardInUse> board() const override { return board_in_use_; }

  std::string problem() const override {
    const std::lock_guard lock(problem_mutex_);
    return problem_;
  }

  std::optional<std::uint64_t> ring_frames() const override {
    const std::int64_t frames = ring_frames_;
    if (frames < 0) return {};
    return static_cast<std::uint64_t>(frames);
  }

  /// What the board sampled while nobody recorded is no part of the run. Where it cannot be stopped just now
  /// (its cable was pulled in the pause), the run's first bytes are those of a board that was opened anew.
  void begin_run() override {
    rest_.clear();
    break_cause_ = nullptr;
    run_begins_ = true;
    silent_ = std::chrono::milliseconds(0);
    if (!stream_ || broken_ || !start_anew()) close();
  }

  std::optional<RunBoundary> boundary() const override { return boundary_; }

  void idle() override {
    if (stream_) stream_->discard(std::chrono::milliseconds(0));
  }

  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds timeout) override {
    if (!rest_.empty()) return read_rest(buffer);
    if (break_cause_ != nullptr) return broken();
    if (!stream_) return {ReadResult::Status::kBroken, 0, steady_seconds()};
    const UsbStream::Got got = stream_->read(buffer, timeout);
    if (got.status == UsbStream::Status::kData) {
      silent_ = std::chrono::milliseconds(0);
      if (got.time_s >= next_statistics_s_) ask_for_statistics(got.time_s);
      return {ReadResult::Status::kData, got.size, got.time_s, got.cause};
    }
    if (got.status == UsbStream::Status::kBroken) return break_off(got.cause, buffer);
    // Waits are counted, not the clock: a program that was held up finds its bytes waiting.
    silent_ += timeout;
    if (silent_ >= silence_limit_) return break_off("silent", buffer);
    return {ReadResult::Status::kNothing, 0, got.time_s};
  }

  /// Only a broken stream is reopened: whether it is silent, the source's own watchdog knows, and to close
  /// one that has just come back would cut off what it is sending.
  bool reopen() override {
    if (stream_ && !broken_) return true;
    std::string why;
    const bool is_back = open(why);
    const std::lock_guard lock(problem_mutex_);
    problem_ = is_back ? "" : why;
    return is_back;
  }

 private:
  /// With the time at which they came: how long a break was is judged by it.
  ReadResult read_rest(std::span<std::byte> buffer) {
    UsbStream::Unread& oldest = rest_.front();
    const std::size_t size = std::min(buffer.size(), oldest.bytes.size());
    std::copy_n(oldest.bytes.begin(), size, buffer.begin());
    const ReadResult result{ReadResult::Status::kData, size, oldest.time_s,
                            std::exchange(oldest.cause, nullptr)};
    oldest.bytes.erase(oldest.bytes.begin(), oldest.bytes.begin() + static_cast<std::ptrdiff_t>(size));
    if (oldest.bytes.empty()) rest_.pop_front();
    return result;
  }

  /// The stream goes on meanwhile, into its queue. A board that does not answer is not asked again.
  void ask_for_statistics(double time_s) {
    const auto statistics = board_->statistics();
    if (statistics) ring_frames_ = statistics->ring_peak;
    next_statistics_s_ = time_s + (statistics ? kStatistics_s : std::numeric_limits<double>::infinity());
  }

  /// What came before a break is read before the break is told: its cause belongs to the gap behind it. A
  /// source that is silent may just have got something, too.
  ReadResult break_off(const char* cause, std::span<std::byte> buffer) {
    break_cause_ = cause;
    for (UsbStream::Unread& unread : stream_->finish()) rest_.push_back(std::move(unread));
    return rest_.empty() ? broken() : read_rest(buffer);
  }

  ReadResult broken() {
    broken_ = true;
    return {ReadResult::Status::kBroken, 0, steady_seconds(), std::exchange(break_cause_, nullptr)};
  }

  void close() {
    stream_.reset();
    board_.reset();
  }

  /// Drops what the board and the stream hold. Whatever of it is still on its way is known by its number.
  bool start_anew() {
    if (!board_->stop()) return false;
    stream_->discard(kQuiet);
    const auto statistics = board_->statistics();
    if (!statistics || !board_->start(settings_.pattern)) return false;
    if (run_begins_) boundary_ = {board_->identity().boot_id, statistics->frames};
    run_begins_ = false;
    return true;
  }

  /// Within a run a board that is sampling already, since only its cable or its host had gone, goes on
  /// without a break.
  bool open(std::string& why) {
    close();
    board_ = UsbBoard::open(bus_, settings_.serial, why);
    if (!board_) return false;
    if (!set_going(why)) {
      close();
      return false;
    }
    boot_id_ = board_->identity().boot_id;
    silent_ = std::chrono::milliseconds(0);
    next_statistics_s_ = steady_seconds() + kStatistics_s;
    broken_ = false;
    return true;
  }

  bool set_going(std::string& why) {
    auto rate = board_->rate();
    const bool goes_on = !run_begins_ && board_->identity().boot_id == boot_id_ &&
                         (board_->identity().flags & TRW_FLAG_RUNNING) != 0 && rate && is_as_asked(*rate);
    if (!goes_on && rate && !is_as_asked(*rate)) {
      if (!configure(*rate, why)) return false;
      rate = board_->rate();
    }
    stream_ = std::make_unique<UsbStream>(board_->handle(), settings_.stream);
    if (!rate || rate->tick_hz == 0 || (!goes_on && !start_anew())) {
      why = "the board does not start";
      return false;
    }
    demand(*rate);
    // A slow board is not a silent one: three of its packets.
    const double frame_s = static_cast<double>(rate->ticks_per_frame) / rate->tick_hz;
    silence_limit_ =
        std::max(settings_.silence, std::chrono::milliseconds(std::llround(3e3 * std::max(frame_s, 0.012))));
    return true;
  }

  bool is_as_asked(const trw_rate& rate) const {
    const bool rate_is = settings_.rate_numerator_hz == 0 ||
                         std::uint64_t{rate.ticks_per_frame} * settings_.rate_numerator_hz ==
                             std::uint64_t{rate.tick_hz} * settings_.rate_denominator;
    return rate_is && (settings_.oversampling == 0 || settings_.oversampling == rate.oversampling);
  }

  /// A board that was without power is as it was made: from now on it is set as it was when it was opened
  /// first, or the run would go on with another filter.
  void demand(const trw_rate& rate) {
    settings_.rate_numerator_hz = rate.tick_hz;
    settings_.rate_denominator = rate.ticks_per_frame;
    settings_.oversampling = rate.oversampling;
  }

  bool configure(const trw_rate& now, std::string& why) {
    trw_rate_wish wish{now.tick_hz, now.ticks_per_frame, now.oversampling};
    if (settings_.rate_numerator_hz != 0) {
      wish.numerator_hz = settings_.rate_numerator_hz;
      wish.denominator = settings_.rate_denominator;
    }
    if (settings_.oversampling != 0) wish.oversampling = settings_.oversampling;
    if (!board_->stop()) {
      why = "the board does not answer";
      return false;
    }
    if (board_->set_rate(wish)) return true;
    why = fmt::format(
        "the board refuses {}/{} Hz with {} conversions per frame; its clock of {} Hz must make the rate "
        "exactly, and its converter keep up",
        wish.numerator_hz, wish.denominator, wish.oversampling, now.tick_hz);
    return false;
  }

  std::string name_;
  UsbSourceSettings settings_;
  BoardInUse board_in_use_;
  std::shared_ptr<UsbBus> bus_;
  std::unique_ptr<UsbBoard> board_;
  std::unique_ptr<UsbStream> stream_;
  std::deque<UsbStream::Unread> rest_;  // of a stream that broke
  const char* break_cause_ = nullptr;   // of a break that is not told yet
  std::uint32_t boot_id_ = 0;
  bool run_begins_ = true;  // and has got no byte yet: no board goes on
  std::optional<RunBoundary> boundary_;
  std::chrono::milliseconds silent_{0}, silence_limit_{0};
  double next_statistics_s_ = 0;
  std::atomic<std::int64_t> ring_frames_{-1};  // none yet
  bool broken_ = false;
  mutable std::mutex problem_mutex_;
  std::string problem_;
};

std::optional<std::uint32_t> whole(std::string_view text) {
  const auto value = parse_number(text);
  if (!value || *value < 1 || *value > 1e9 || *value != std::floor(*value)) return {};
  return static_cast<std::uint32_t>(*value);
}

void parse_option(const std::string& name, std::string_view option, UsbSourceSettings& settings) {
  const auto equals = option.find('=');
  const std::string_view key = option.substr(0, equals);
  const std::string_view value =
      equals == std::string_view::npos ? std::string_view() : option.substr(equals + 1);
  if (option == "test-pattern") {
    settings.pattern = true;
  } else if (key == "oversampling" && (value == "1" || value == "8")) {
    settings.oversampling = value == "8" ? 8 : 1;
  } else if (const auto slash = value.find('/'); key == "rate" && whole(value.substr(0, slash))) {
    settings.rate_numerator_hz = *whole(value.substr(0, slash));
    const auto denominator =
        slash == std::string_view::npos ? std::optional(1u) : whole(value.substr(slash + 1));
    if (!denominator) throw InputError::in(name, "'{}': write rate=4000/3 or rate=1000", option);
    settings.rate_denominator = *denominator;
  } else {
    throw InputError::in(name, "'{}': write usb[:SERIAL][,test-pattern][,rate=4000/3][,oversampling=1 or 8]",
                         option);
  }
}

}  // namespace

UsbSourceSettings parse_usb_source(const std::string& name, std::string_view text) {
  UsbSourceSettings settings;
  const auto comma = text.find(',');
  settings.serial = text.substr(0, comma);
  while (!text.empty() && text.find(',') != std::string_view::npos) {
    text.remove_prefix(text.find(',') + 1);
    parse_option(name, text.substr(0, text.find(',')), settings);
  }
  return settings;
}

std::unique_ptr<PacketSource> open_usb_source(const std::string& name, const UsbSourceSettings& settings) {
  return std::make_unique<UsbSource>(name, settings);
}

std::unique_ptr<PacketSource> open_usb(const std::string& name, std::string_view board) {
  return open_usb_source(name, parse_usb_source(name, board));
}

}  // namespace tunnelrig
