// The seam to whatever delivers packets: a board on TCP, serial or USB, a recorded stream, the virtual rig.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace tunnelrig {

struct ReadResult {
  enum class Status {
    kData,     // `size` bytes were read, at least one
    kNothing,  // no byte came within the time-out
    kBroken,   // the connection is gone; reopen may bring it back
    kEnd,      // there will never be another byte
  };
  Status status = Status::kNothing;
  std::size_t size = 0;
  double time_s =
      0;  // when the bytes (or their absence) were seen, on a clock of the source that never runs backwards
  const char* cause =
      nullptr;  // what went wrong before these bytes: a static text for the gap, if there is one
};

/// The board behind a source that knows it. The same from the source's first byte to its last: a run of two
/// boards would be one of two sets of load cells.
struct BoardInUse {
  std::string serial;
  std::uint32_t conversions_per_frame = 0;
};

/// Where a run begins, on a board that says so: what it sampled under lower numbers of this boot was before.
struct RunBoundary {
  std::uint32_t boot_id = 0;
  std::uint64_t first_sequence = 0;
};

/// A stream of bytes in which packets stand (docs/wire-format.md). Used by one thread at a time.
class PacketSource {
 public:
  virtual ~PacketSource() = default;

  /// A run begins: what waits from before may be thrown away.
  virtual void begin_run() {}

  /// Of the run that has begun, where the source knows. Whoever has got a byte of it may ask, on any thread:
  /// it is the same until the next run begins.
  virtual std::optional<RunBoundary> boundary() const { return {}; }

  /// Nobody records, and this is called several times a second meanwhile: what has come since is thrown away,
  /// or the next run would begin with it. Does not wait.
  virtual void idle() {}

  /// Waits for bytes, at most for `timeout`. Never throws for what a device or a cable does.
  virtual ReadResult read(std::span<std::byte> buffer, std::chrono::milliseconds timeout) = 0;

  /// Tries once, without waiting long, to get a silent or broken stream back. True where it may now deliver
  /// again.
  virtual bool reopen() = 0;

  /// The most frames that ever waited on the board, where the source knows. Any thread may ask.
  virtual std::optional<std::uint64_t> ring_frames() const { return {}; }

  /// Any thread may ask.
  virtual std::optional<BoardInUse> board() const { return {}; }

  /// Why the board cannot be had just now, for people; empty where it can, or nobody knows. Any thread may
  /// ask.
  virtual std::string problem() const { return ""; }

  /// As the ledger names it: "tcp:localhost:4000". Any thread may ask.
  virtual std::string name() const = 0;
};

/// Opens "usb[:SERIAL]", "tcp:HOST:PORT", "serial:DEVICE[@BAUD]" or "replay:FILE". Throws InputError naming
/// the source and what is wrong with it. (The virtual rig needs more than a name: virtual_rig.h.)
std::unique_ptr<PacketSource> open_source(const std::string& name);

/// Seconds on the clock of a source that runs in real time. They pass while the computer sleeps, too: the
/// board goes on meanwhile, or has been away for so long.
double steady_seconds();

}  // namespace tunnelrig
