#include "daq/virtual_board.h"

#include "datasets/raw_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <thread>
#include <utility>

namespace tunnelrig {
namespace {

constexpr std::uint32_t kTick_hz = 84000000;  // TIM2 of an STM32F405 at full clock
constexpr std::uint8_t kFramesPerPacket = 16;
constexpr double kRing_s = 3;  // frames that the real board's ring holds while nobody reads

bool within(double time_s, double from_s, double for_s) {
  return from_s >= 0 && time_s >= from_s && time_s < from_s + for_s;
}

}  // namespace

VirtualBoard::VirtualBoard(const VirtualBoardSettings& settings, SampleFunction sample)
    : settings_(settings),
      sample_(std::move(sample)),
      engine_(settings.seed),
      started_s_(steady_seconds()),
      sequence_(settings.first_sequence),
      boot_id_(settings.boot_id) {}

double VirtualBoard::board_time_s() const {
  return static_cast<double>(clock_frames_) / settings_.frame_rate_hz;
}

/// In real time a packet exists when its last frame has been sampled.
double VirtualBoard::due_in_s() const {
  if (settings_.pace <= 0) return 0;
  const double ready_s = static_cast<double>(clock_frames_ + kFramesPerPacket) / settings_.frame_rate_hz;
  return started_s_ + ready_s / settings_.pace - steady_seconds();
}

bool VirtualBoard::chance(double probability) {
  return probability > 0 && std::uniform_real_distribution<double>()(engine_) < probability;
}

bool VirtualBoard::rebooting() const {
  return within(board_time_s(), settings_.faults.reboot_at_s, settings_.faults.reboot_s);
}

bool VirtualBoard::link_open() const {
  return !within(board_time_s(), settings_.faults.stall_at_s, settings_.faults.stall_s);
}

/// The time of one packet passes.
void VirtualBoard::step() {
  if (rebooting()) {
    down_ = true;
    ring_.clear();
  } else {
    if (std::exchange(down_, false)) {
      ++boot_id_;
      sequence_ = 0;
      overruns_ = 0;
    }
    std::vector<std::byte> packet = sample_packet();
    const double held_s = static_cast<double>(ring_.size() * kFramesPerPacket) / settings_.frame_rate_hz;
    lost_some_ = held_s >= kRing_s;
    if (lost_some_)
      overruns_ += kFramesPerPacket;
    else
      ring_.push_back(std::move(packet));
    ring_peak_ = std::max<std::uint64_t>(ring_peak_, ring_.size() * kFramesPerPacket);
  }
  clock_frames_ += kFramesPerPacket;
  for (; link_open() && !ring_.empty(); ring_.pop_front()) send(std::move(ring_.front()));
}

std::vector<std::byte> VirtualBoard::sample_packet() {
  const trw_header header{
      .boot_id = boot_id_,
      .tick_hz = kTick_hz,
      .first_sequence = sequence_,
      .first_ticks = static_cast<std::uint64_t>(board_time_s() * kTick_hz),
      .ticks_per_frame = static_cast<std::uint32_t>(std::lround(kTick_hz / settings_.frame_rate_hz)),
      .overruns = overruns_,
      .frame_count = kFramesPerPacket};
  std::vector<std::byte> packet(trw_packet_size(kFramesPerPacket));
  auto* out = reinterpret_cast<std::uint8_t*>(packet.data());
  trw_put_header(out, &header);
  for (std::size_t i = 0; i < kFramesPerPacket; ++i) {
    trw_frame frame = sample_();
    if (lost_some_ && i == 0) frame.status = static_cast<std::uint16_t>(frame.status | TRW_STATUS_OVERRUN);
    trw_put_frame(out + TRW_HEADER_SIZE + i * TRW_FRAME_SIZE, &frame);
  }
  const std::size_t body = packet.size() - TRW_CRC_SIZE;
  trw_put32(out + body, crc32c(std::span(packet).first(body)));
  sampled_ += kFramesPerPacket;
  sequence_ += kFramesPerPacket;
  return packet;
}

/// The link, with what it does to a packet.
void VirtualBoard::send(std::vector<std::byte> packet) {
  const Faults& faults = settings_.faults;
  const auto arrive = [this](const std::vector<std::byte>& bytes) {
    arrived_.insert(arrived_.end(), bytes.begin(), bytes.end());
  };
  if (!faults.any()) return arrive(packet);
  if (chance(faults.drop)) return;
  const bool twice = chance(faults.duplicate);
  if (chance(faults.corrupt)) {
    const auto bit = std::uniform_int_distribution<std::size_t>(0, packet.size() * 8 - 1)(engine_);
    packet[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
  }
  if (chance(faults.truncate))
    packet.resize(std::uniform_int_distribution<std::size_t>(1, packet.size() - 1)(engine_));
  if (chance(faults.garbage)) {
    std::vector<std::byte> garbage(std::uniform_int_distribution<std::size_t>(1, 300)(engine_));
    for (std::byte& byte : garbage) byte = static_cast<std::byte>(engine_());
    arrive(garbage);
  }
  if (kept_back_.empty() && chance(faults.reorder)) {
    kept_back_ = std::move(packet);
    return;
  }
  arrive(packet);
  if (twice) arrive(packet);
  arrive(kept_back_);
  kept_back_.clear();
}

ReadResult VirtualBoard::read(std::span<std::byte> buffer, std::chrono::milliseconds timeout) {
  const double patience_s = std::chrono::duration<double>(timeout).count();
  const double deadline_s =
      steady_seconds() + patience_s;  // in real time; as fast as one reads, by the board's clock
  const double board_deadline_s = board_time_s() + patience_s;
  while (arrived_.size() - read_ < buffer.size()) {
    if (settings_.pace <= 0 && board_time_s() >= board_deadline_s) break;
    const double wait_s = due_in_s();
    if (wait_s <= 0) {
      step();
    } else {
      const double left_s = deadline_s - steady_seconds();
      if (read_ < arrived_.size() || left_s <= 0) break;
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(wait_s, left_s)));
    }
  }
  const std::size_t size = std::min(buffer.size(), arrived_.size() - read_);
  if (size > 0) std::memcpy(buffer.data(), arrived_.data() + read_, size);  // nothing has no address
  read_ += size;
  if (read_ == arrived_.size()) {
    arrived_.clear();
    read_ = 0;
  }
  // By the rig's own time, so that a clock that is held against it runs right at any pace.
  const double time_s =
      settings_.pace > 0 ? (steady_seconds() - started_s_) * settings_.pace : board_time_s();
  return {size > 0 ? ReadResult::Status::kData : ReadResult::Status::kNothing, size, time_s};
}

}  // namespace tunnelrig
