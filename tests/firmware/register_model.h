// The registers of the F405 as far as the drivers touch them: every access is written down, and some bits
// answer as the hardware's would. Simulated from the reference manual, not from the drivers.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace tunnelrig::test {

class RegisterModel {
 public:
  struct Write {
    std::uint32_t address, value;
    bool operator==(const Write&) const = default;
  };

  RegisterModel();
  ~RegisterModel();
  RegisterModel(const RegisterModel&) = delete;
  RegisterModel& operator=(const RegisterModel&) = delete;

  std::uint32_t read(std::uint32_t address);
  void write(std::uint32_t address, std::uint32_t value);

  /// Where the last write to `address` with all of `bits` set stands in `writes`; -1 where there is none.
  int last_with(std::uint32_t address, std::uint32_t bits) const;
  int first_with(std::uint32_t address, std::uint32_t bits) const;

  std::map<std::uint32_t, std::uint32_t> values;
  std::map<std::uint32_t, std::function<std::uint32_t(std::uint32_t)>> on_read;  // value stored -> value read
  std::map<std::uint32_t, std::function<void(std::uint32_t)>> on_write;          // instead of storing
  std::vector<Write> writes;
  std::uint64_t reads = 0;
};

/// A F405 whose oscillators start, and whose stream, converter and OTG core do as they are told.
void behave_well(RegisterModel& model);

/// TIM2, the converter, stream 0 of DMA2 and their one interrupt, which comes before the write that asked for
/// it has returned: it stands above whatever starts and stops the sampling.
class SamplingHardware {
 public:
  SamplingHardware(RegisterModel& model, std::function<void()> interrupt);

  /// The timer's time for one scan has passed: where it runs, an update.
  void scan_is_due();
  /// The stream has filled a buffer and goes on with the other one.
  void fill_buffer();
  /// The converter had a result that nobody took.
  void overrun();

 private:
  bool asserted() const;
  void settle();
  void trigger();

  RegisterModel& model_;
  std::function<void()> interrupt_;
  bool pending_ = false, inside_ = false;
  std::uint32_t converted_ = 0;  // since the stream was switched on, or filled a buffer
};

/// What a host puts into the OTG core's one receive FIFO, and what it finds in the transmit FIFOs.
class OtgHost {
 public:
  explicit OtgHost(RegisterModel& model);

  void bus_reset();
  void enumeration_done();
  void setup(const std::vector<std::uint8_t>& packet);
  void out(const std::vector<std::uint8_t>& data);
  /// The bytes of the IN transfer of endpoint `n` that is armed, which then is done; empty where it is a
  /// status stage.
  std::vector<std::uint8_t> in(std::uint32_t n);
  bool in_armed(std::uint32_t n) const;

 private:
  void receive(std::uint32_t kind, const std::vector<std::uint8_t>& bytes);

  RegisterModel& model_;
  std::uint32_t status_ = 0;
  std::deque<std::uint32_t> words_;
  std::map<std::uint32_t, std::vector<std::uint32_t>> fifo_;
  std::map<std::uint32_t, std::uint32_t> in_flags_, out_flags_;
};

}  // namespace tunnelrig::test
