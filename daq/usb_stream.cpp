#include "daq/usb_stream.h"

#include "daq/packet_source.h"
#include "tunnelrig_usb.h"

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <new>
#include <vector>

#include <libusb-1.0/libusb.h>

namespace tunnelrig {
namespace {

constexpr int kErrorsInARow = 10;  // a bus that only fails is as good as gone

}  // namespace

/// Shared by the stream and the callbacks of its transfers, which run on the bus's event thread.
struct UsbStream::State {
  struct Transfer {
    libusb_transfer* usb = nullptr;
    std::vector<unsigned char> buffer;
    State* state = nullptr;
    bool pending = false;
  };
  struct Chunk : Unread {
    std::size_t used = 0;  // of its bytes
  };

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::unique_ptr<Transfer>> transfers;
  std::deque<Chunk> chunks;
  std::size_t queued_bytes = 0, limit_bytes = 0;
  int pending = 0, errors_in_a_row = 0;
  bool stopping = false, halted = false, broken = false;
  const char* cause = nullptr;         // since the last bytes
  const char* broken_cause = nullptr;  // for good

  ~State() {
    for (const auto& transfer : transfers) libusb_free_transfer(transfer->usb);
  }

  void break_off(const char* why) {
    if (!broken) broken_cause = why;
    broken = true;
  }

  /// With the lock held. What libusb answers here decides, since a refused transfer never calls back.
  void submit(Transfer& transfer) {
    const int error = libusb_submit_transfer(transfer.usb);
    if (error == 0) {
      transfer.pending = true;
      ++pending;
    } else {
      break_off(error == LIBUSB_ERROR_NO_DEVICE ? "unplugged" : "usb-error");
    }
  }

  void submit_idle() {
    for (const auto& transfer : transfers) {
      if (!transfer->pending && !broken && !stopping && !halted && queued_bytes < limit_bytes)
        submit(*transfer);
    }
  }

  /// Whatever the status, bytes that came are bytes of the stream.
  void take(const libusb_transfer& usb) {
    if (usb.actual_length <= 0) return;
    const auto* begin = reinterpret_cast<const std::byte*>(usb.buffer);
    chunks.push_back({{{begin, begin + usb.actual_length}, steady_seconds(), cause}});
    cause = nullptr;
    queued_bytes += static_cast<std::size_t>(usb.actual_length);
  }

  void note(libusb_transfer_status status) {
    switch (status) {
      case LIBUSB_TRANSFER_COMPLETED:
        errors_in_a_row = 0;
        break;
      case LIBUSB_TRANSFER_STALL:
        halted = true;
        cause = "usb-stall";
        break;
      case LIBUSB_TRANSFER_NO_DEVICE:
        break_off("unplugged");
        break;
      case LIBUSB_TRANSFER_TIMED_OUT:  // a board that is not sampling
      case LIBUSB_TRANSFER_CANCELLED:  // by ourselves
        break;
      case LIBUSB_TRANSFER_OVERFLOW:
        cause = "usb-overflow";
        break;
      default:
        cause = "usb-error";
        if (++errors_in_a_row >= kErrorsInARow) break_off("usb-error");
    }
  }

  static void LIBUSB_CALL on_transfer(libusb_transfer* usb) {
    auto& transfer = *static_cast<Transfer*>(usb->user_data);
    State& state = *transfer.state;
    const std::lock_guard lock(state.mutex);
    transfer.pending = false;
    --state.pending;
    state.take(*usb);
    state.note(usb->status);
    state.submit_idle();
    state.changed.notify_all();
  }
};

UsbStream::UsbStream(std::shared_ptr<UsbHandle> handle, const UsbStreamSettings& settings)
    : settings_(settings), handle_(std::move(handle)), state_(std::make_shared<State>()) {
  state_->limit_bytes = settings.queue_bytes;
  for (int i = 0; i < settings.transfers; ++i) {
    auto transfer = std::make_unique<State::Transfer>();
    transfer->buffer.resize(settings.transfer_bytes);
    transfer->state = state_.get();
    transfer->usb = libusb_alloc_transfer(0);
    if (transfer->usb == nullptr) throw std::bad_alloc();
    libusb_fill_bulk_transfer(transfer->usb, handle_->get(), TRW_USB_STREAM_IN, transfer->buffer.data(),
                              static_cast<int>(transfer->buffer.size()), State::on_transfer, transfer.get(),
                              static_cast<unsigned>(settings.transfer_timeout.count()));
    state_->transfers.push_back(std::move(transfer));
  }
  start();
}

UsbStream::~UsbStream() {
  if (stop()) return;
  // Transfers that the system does not give back are left to it, with the bus they are on; freeing them would
  // be worse.
  static std::mutex mutex;
  // Without memory for a list the program may as well end:
  // NOLINTNEXTLINE(bugprone-unhandled-exception-at-new)
  static auto* const left_behind = new std::vector<std::shared_ptr<State>>;  // not even at the exit
  const std::lock_guard lock(mutex);
  left_behind->push_back(state_);
  handle_->bus().abandon();
}

void UsbStream::start() {
  const std::lock_guard lock(state_->mutex);
  state_->stopping = false;
  state_->submit_idle();
}

/// Cancels everything; true where all of it came back in time.
bool UsbStream::stop() {
  std::unique_lock lock(state_->mutex);
  state_->stopping = true;
  std::vector<libusb_transfer*> pending;
  for (const auto& transfer : state_->transfers) {
    if (transfer->pending) pending.push_back(transfer->usb);
  }
  lock.unlock();  // a callback may be waiting for it inside libusb
  for (libusb_transfer* transfer : pending) libusb_cancel_transfer(transfer);
  lock.lock();
  return state_->changed.wait_for(lock, settings_.drain_wait, [&] { return state_->pending == 0; });
}

/// On the reader's thread: a callback must not wait.
bool UsbStream::recover_from_stall() {
  if (!stop() || !handle_->clear_halt(TRW_USB_STREAM_IN)) return false;
  {
    const std::lock_guard lock(state_->mutex);
    state_->halted = false;
  }
  start();
  return true;
}

UsbStream::Got UsbStream::read(std::span<std::byte> buffer, std::chrono::milliseconds timeout) {
  std::unique_lock lock(state_->mutex);
  State& state = *state_;
  state.changed.wait_for(lock, timeout,
                         [&] { return !state.chunks.empty() || state.broken || state.halted; });
  Got got{.time_s = steady_seconds()};
  if (state.chunks.empty()) {
    if (state.broken) {
      got.status = Status::kBroken;
      got.cause = state.broken_cause;
    } else if (state.halted) {
      lock.unlock();
      if (!recover_from_stall()) {
        got.status = Status::kBroken;
        got.cause = "usb-stall";
      }
    }
    return got;
  }
  got.status = Status::kData;
  got.time_s = state.chunks.front().time_s;
  got.cause = state.chunks.front().cause;
  while (got.size < buffer.size() && !state.chunks.empty()) {
    State::Chunk& chunk = state.chunks.front();
    if (got.size > 0 && (chunk.cause != nullptr || chunk.time_s > got.time_s + 0.001)) break;
    const std::size_t size = std::min(buffer.size() - got.size, chunk.bytes.size() - chunk.used);
    std::memcpy(buffer.data() + got.size, chunk.bytes.data() + chunk.used, size);
    got.size += size;
    chunk.used += size;
    chunk.cause = nullptr;
    if (chunk.used == chunk.bytes.size()) state.chunks.pop_front();
  }
  state.queued_bytes -= got.size;
  state.submit_idle();
  return got;
}

std::vector<UsbStream::Unread> UsbStream::finish() {
  stop();
  const std::lock_guard lock(state_->mutex);
  std::vector<Unread> rest;
  for (State::Chunk& chunk : state_->chunks) {
    chunk.bytes.erase(chunk.bytes.begin(), chunk.bytes.begin() + static_cast<std::ptrdiff_t>(chunk.used));
    rest.push_back(std::move(chunk));
  }
  state_->chunks.clear();
  return rest;
}

void UsbStream::discard(std::chrono::milliseconds quiet) {
  std::unique_lock lock(state_->mutex);
  for (int round = 0; round < 10; ++round) {
    state_->chunks.clear();
    state_->queued_bytes = 0;
    state_->cause = nullptr;
    state_->submit_idle();
    if (!state_->changed.wait_for(lock, quiet, [&] { return !state_->chunks.empty() || state_->broken; }))
      break;
    if (state_->broken) break;
  }
  state_->chunks.clear();
  state_->queued_bytes = 0;
}

}  // namespace tunnelrig
