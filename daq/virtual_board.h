// The board of the virtual rig: frames in, packets out, in time or as fast as asked, with faults on demand.
#pragma once

#include "daq/faults.h"
#include "daq/packet_source.h"
#include "tunnelrig_wire.h"

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <random>
#include <vector>

namespace tunnelrig {

struct VirtualBoardSettings {
  double frame_rate_hz = 4000.0 / 3.0;
  double pace = 0;  // 1: real time; 0: as fast as one reads
  std::uint32_t boot_id = 1;
  std::uint64_t first_sequence = 0;
  std::uint64_t seed = 1;
  Faults faults;
};

class VirtualBoard : public PacketSource {
 public:
  using SampleFunction = std::function<trw_frame()>;  // the next frame, one per call

  VirtualBoard(const VirtualBoardSettings& settings, SampleFunction sample);

  ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds timeout) override;
  bool reopen() override { return true; }
  std::optional<std::uint64_t> ring_frames() const override { return ring_peak_.load(); }
  std::string name() const override { return "virtual"; }

  /// Frames sampled so far, whatever became of them; while the board reboots it samples none. For tests,
  /// which hold the ledger against it.
  std::uint64_t frames_sampled() const { return sampled_; }

 private:
  double board_time_s() const;
  double due_in_s() const;  // of the next packet; not above 0: now
  bool rebooting() const;
  bool link_open() const;
  void step();
  std::vector<std::byte> sample_packet();
  void send(std::vector<std::byte> packet);
  bool chance(double probability);

  VirtualBoardSettings settings_;
  SampleFunction sample_;
  std::mt19937_64 engine_;
  double started_s_;
  std::uint64_t clock_frames_ = 0;  // time since this object was made, in frames
  std::uint64_t sampled_ = 0;
  std::uint64_t sequence_ = 0;  // as the board counts
  std::uint32_t boot_id_ = 1;
  std::uint32_t overruns_ = 0;
  bool down_ = false;                        // rebooting
  bool lost_some_ = false;                   // the ring was full: the next frame that is kept says so
  std::deque<std::vector<std::byte>> ring_;  // packets on the board
  std::atomic<std::uint64_t> ring_peak_{0};  // frames
  std::vector<std::byte> kept_back_;         // a packet that will be sent behind the next one
  std::vector<std::byte> arrived_;           // bytes on the host's side, not yet read
  std::size_t read_ = 0;
};

}  // namespace tunnelrig
