#include "firmware/register_model.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

extern "C" {
#include "otg_fs.h"
#include "sampling.h"
#include "stm32f405.h"
}

namespace tunnelrig::test {
namespace {

RegisterModel* current = nullptr;

}  // namespace

extern "C" uint32_t model_read(uint32_t address) { return current->read(address); }
extern "C" void model_write(uint32_t address, uint32_t value) { current->write(address, value); }

RegisterModel::RegisterModel() { current = this; }
RegisterModel::~RegisterModel() { current = nullptr; }

std::uint32_t RegisterModel::read(std::uint32_t address) {
  ++reads;
  const std::uint32_t stored = values[address];
  const auto special = on_read.find(address);
  return special == on_read.end() ? stored : special->second(stored);
}

void RegisterModel::write(std::uint32_t address, std::uint32_t value) {
  writes.push_back({address, value});
  const auto special = on_write.find(address);
  if (special == on_write.end())
    values[address] = value;
  else
    special->second(value);
}

int RegisterModel::last_with(std::uint32_t address, std::uint32_t bits) const {
  for (int i = static_cast<int>(writes.size()) - 1; i >= 0; --i) {
    const Write& write = writes[static_cast<std::size_t>(i)];
    if (write.address == address && (write.value & bits) == bits) return i;
  }
  return -1;
}

int RegisterModel::first_with(std::uint32_t address, std::uint32_t bits) const {
  for (std::size_t i = 0; i < writes.size(); ++i) {
    if (writes[i].address == address && (writes[i].value & bits) == bits) return static_cast<int>(i);
  }
  return -1;
}

void behave_well(RegisterModel& model) {
  model.on_read[RCC_CR] = [](std::uint32_t v) {
    if ((v & BIT(16)) != 0) v |= BIT(17);  // HSE ready
    if ((v & BIT(24)) != 0) v |= BIT(25);  // PLL ready
    return v;
  };
  model.on_read[RCC_CFGR] = [](std::uint32_t v) { return v | ((v & 3u) << 2); };  // SWS follows SW
  model.values[OTG_GRSTCTL] = 0x80000000u;                                        // AHB idle
  model.on_write[OTG_GRSTCTL] = [](std::uint32_t) {};  // resets and flushes end at once
  const auto clear_ones = [&model](std::uint32_t address) {
    model.on_write[address] = [&model, address](std::uint32_t v) { model.values[address] &= ~v; };
  };
  clear_ones(OTG_GINTSTS);
  for (std::uint32_t n = 0; n < 2; ++n) {
    // NAK is granted, and a disabled endpoint is disabled
    model.on_write[OTG_DIEPCTL(n)] = [&model, n](std::uint32_t v) {
      if ((v & BIT(27)) != 0) model.values[OTG_DIEPINT(n)] |= BIT(6);
      if ((v & BIT(30)) != 0) {
        model.values[OTG_DIEPINT(n)] |= BIT(1);
        v &= ~0x80000000u;
      }
      model.values[OTG_DIEPCTL(n)] = v & ~(BIT(26) | BIT(27) | BIT(28) | BIT(30));
    };
  }
}

SamplingHardware::SamplingHardware(RegisterModel& model, std::function<void()> interrupt)
    : model_(model), interrupt_(std::move(interrupt)) {
  model.on_write[DMA2_S0CR] = [this](std::uint32_t v) {
    const bool was_on = (model_.values[DMA2_S0CR] & BIT(0)) != 0, on = (v & BIT(0)) != 0;
    if (!was_on && on && model_.values[DMA2_LISR] != 0) throw std::logic_error("10.3.17: flags of old");
    model_.values[DMA2_S0CR] = v;
    if (!was_on && on) converted_ = 0;
    if (was_on && !on) model_.values[DMA2_LISR] |= BIT(5);  // AN4031: a stream that is disabled sets TCIF
    settle();
  };
  model.on_write[DMA2_LIFCR] = [this](std::uint32_t v) { model_.values[DMA2_LISR] &= ~v; };
  model.on_write[ADC_CR2] = [this](std::uint32_t v) {
    const bool was_on = (model_.values[ADC_CR2] & BIT(0)) != 0;
    if (was_on && (v & BIT(0)) == 0 && (model_.values[DMA2_S0CR] & BIT(0)) != 0)
      throw std::logic_error("10.3.17: the stream is switched off before its peripheral");
    model_.values[ADC_CR2] = v;
  };
  // TIMx_CR2, MMS: 000, the UG bit is the trigger output; 010, the update event, which UG makes.
  model.on_write[TIM2 + TIM_EGR] = [this](std::uint32_t v) {
    const std::uint32_t output = (model_.values[TIM2 + TIM_CR2] >> 4) & 7u;
    if ((v & BIT(0)) != 0 && (output == 0 || output == 2)) trigger();
  };
  model.on_write[NVIC_ICPR(IRQ_DMA2_STREAM0 / 32)] = [this](std::uint32_t v) {
    if ((v & BIT(IRQ_DMA2_STREAM0 % 32)) != 0) pending_ = false;
  };
}

void SamplingHardware::scan_is_due() {
  const bool runs = (model_.values[TIM2 + TIM_CR1] & BIT(0)) != 0;
  if (runs && ((model_.values[TIM2 + TIM_CR2] >> 4) & 7u) == 2) trigger();
}

/// TIM2_TRGO: one scan, where the converter is on and listens to it.
void SamplingHardware::trigger() {
  const std::uint32_t converter = model_.values[ADC_CR2];
  if ((converter & BIT(0)) == 0 || ((converter >> 28) & 3u) != 1 || ((converter >> 24) & 15u) != 6) return;
  if ((model_.values[DMA2_S0CR] & BIT(0)) == 0) return;
  converted_ += SAMPLING_CHANNELS;
  if (converted_ >= model_.values[DMA2_S0NDTR]) fill_buffer();
}

void SamplingHardware::fill_buffer() {
  converted_ = 0;
  model_.values[DMA2_S0CR] ^= BIT(19);
  model_.values[DMA2_LISR] |= BIT(5);
  settle();
}

void SamplingHardware::overrun() {
  model_.values[ADC_SR] |= BIT(5);
  settle();
}

bool SamplingHardware::asserted() const {
  const auto both = [this](std::uint32_t flags, std::uint32_t enables, std::uint32_t flag,
                           std::uint32_t enable) {
    return (model_.values[flags] & BIT(flag)) != 0 && (model_.values[enables] & BIT(enable)) != 0;
  };
  return both(DMA2_LISR, DMA2_S0CR, 5, 4) || both(ADC_SR, ADC_CR1, 5, 26);
}

/// A line that is asserted makes the interrupt pending, within its own handler for another turn.
void SamplingHardware::settle() {
  pending_ |= asserted();
  if (inside_) return;
  for (int turn = 0; pending_; ++turn) {
    if (turn == 10) throw std::logic_error("an interrupt that does not end");
    pending_ = false;
    inside_ = true;
    interrupt_();
    inside_ = false;
    pending_ |= asserted();
  }
}

OtgHost::OtgHost(RegisterModel& model) : model_(model) {
  model.on_read[OTG_GINTSTS] = [this](std::uint32_t v) {
    if (!words_.empty() || status_ != 0) v |= BIT(4);
    std::uint32_t in = 0, out = 0;
    for (const auto& [n, f] : in_flags_) in |= f;
    for (const auto& [n, f] : out_flags_) out |= f;
    const bool wants_data = (model_.values[OTG_DIEPEMPMSK] & 3u) != 0;
    if (in != 0 || wants_data) v |= BIT(18);
    if (out != 0) v |= BIT(19);
    return v;
  };
  model.on_read[OTG_GRXSTSP] = [this](std::uint32_t) { return std::exchange(status_, 0); };
  model.on_read[OTG_FIFO(0)] = [this](std::uint32_t) {
    if (words_.empty()) throw std::logic_error("an empty FIFO was read");
    const std::uint32_t word = words_.front();
    words_.pop_front();
    return word;
  };
  model.on_read[OTG_DAINT] = [this](std::uint32_t) {
    std::uint32_t bits = model_.values[OTG_DIEPEMPMSK] & 3u;
    for (const auto& [n, f] : in_flags_) {
      if (f != 0) bits |= BIT(n);
    }
    return bits;
  };
  model.on_read[OTG_DOEPINT(0)] = [this](std::uint32_t) { return out_flags_[0]; };
  model.on_write[OTG_DOEPINT(0)] = [this](std::uint32_t v) { out_flags_[0] &= ~v; };
  for (std::uint32_t n = 0; n < 2; ++n) {
    model.on_read[OTG_DIEPINT(n)] = [this, n](std::uint32_t v) {
      return v | in_flags_[n] | ((model_.values[OTG_DIEPEMPMSK] & BIT(n)) != 0 ? BIT(7) : 0u);
    };
    model.on_write[OTG_DIEPINT(n)] = [this, n](std::uint32_t v) {
      in_flags_[n] &= ~v;
      model_.values[OTG_DIEPINT(n)] &= ~v;
    };
    model.on_read[OTG_DTXFSTS(n)] = [this, n](std::uint32_t) {
      const std::size_t words = n == 0 ? 32 : 128;
      return static_cast<std::uint32_t>(words - fifo_[n].size());
    };
    model.on_write[OTG_FIFO(n)] = [this, n](std::uint32_t v) { fifo_[n].push_back(v); };
  }
}

void OtgHost::bus_reset() {
  model_.values[OTG_GINTSTS] |= BIT(12);
  otg_fs_interrupt();
}

void OtgHost::enumeration_done() {
  model_.values[OTG_GINTSTS] |= BIT(13);
  otg_fs_interrupt();
}

/// 34.16.2, OTG_FS_GRXSTSP: byte count in bits 14:4, kind in 20:17.
void OtgHost::receive(std::uint32_t kind, const std::vector<std::uint8_t>& bytes) {
  status_ = (kind << 17) | (static_cast<std::uint32_t>(bytes.size()) << 4);
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 4 && i + k < bytes.size(); ++k)
      word |= std::uint32_t{bytes[i + k]} << (8 * k);
    words_.push_back(word);
  }
  otg_fs_interrupt();
  if (!words_.empty()) throw std::logic_error("the receive FIFO was not read to its end");
}

void OtgHost::setup(const std::vector<std::uint8_t>& packet) {
  receive(6, packet);
  receive(4, {});
  out_flags_[0] |= BIT(3);
  otg_fs_interrupt();
}

void OtgHost::out(const std::vector<std::uint8_t>& data) {
  receive(2, data);
  receive(3, {});
  out_flags_[0] |= BIT(0);
  otg_fs_interrupt();
}

bool OtgHost::in_armed(std::uint32_t n) const { return (model_.values[OTG_DIEPCTL(n)] & 0x80000000u) != 0; }

std::vector<std::uint8_t> OtgHost::in(std::uint32_t n) {
  if (!in_armed(n)) throw std::logic_error("the device would answer NAK");
  std::size_t left = model_.values[OTG_DIEPTSIZ(n)] & 0x7FFFFu;
  std::vector<std::uint8_t> bytes;
  while (left > 0) {
    otg_fs_interrupt();  // fills the FIFO
    if (fifo_[n].empty()) throw std::logic_error("the FIFO stays empty");
    for (const std::uint32_t word : fifo_[n]) {
      for (unsigned k = 0; k < 4 && left > 0; ++k, --left)
        bytes.push_back(static_cast<std::uint8_t>(word >> (8 * k)));
      if (bytes.size() % 64 == 0) continue;
    }
    fifo_[n].clear();
  }
  model_.values[OTG_DIEPCTL(n)] &= ~0x80000000u;
  in_flags_[n] |= BIT(0);
  otg_fs_interrupt();
  return bytes;
}

}  // namespace tunnelrig::test
