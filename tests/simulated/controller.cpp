#include "simulated/controller.h"

#include <algorithm>
#include <cstring>

namespace tunnelrig::simulated {

const usb_controller& Controller::table() {
  static const usb_controller functions = {
      .set_address = on_set_address,
      .open_in = on_open,
      .close = on_close,
      .send = on_send,
      .receive = on_receive,
      .stall = on_stall,
      .clear_stall = on_clear_stall,
  };
  return functions;
}

int Controller::take_packet(Endpoint& endpoint, std::uint8_t* out, std::size_t room) {
  if (endpoint.stalled) return kStall;
  if (!endpoint.armed) return kNak;
  const std::size_t size = std::min<std::size_t>(endpoint.size - endpoint.sent, USB_PACKET);
  if (size > room) return kBabble;
  if (size > 0) std::memcpy(out, endpoint.data + endpoint.sent, size);
  endpoint.sent += size;
  endpoint.armed = endpoint.sent < endpoint.size;
  return static_cast<int>(size);
}

int Controller::in_packet(std::uint8_t* out, std::size_t room) {
  if (!stream_.open) return kNak;
  const int size = take_packet(stream_, out, room);
  if (size >= 0 && !stream_.armed) usb_on_sent(&device_, TRW_USB_STREAM_IN);
  return size;
}

void Controller::setup_only(const std::uint8_t setup[8]) {
  control_in_ = {};
  out_armed_ = control_stalled_ = false;
  usb_on_setup(&device_, setup);
}

int Controller::control(const std::uint8_t setup[8], std::uint8_t* data) {
  setup_only(setup);
  const auto length = static_cast<std::uint16_t>(setup[6] | (setup[7] << 8));
  return (setup[0] & 0x80) != 0 && length > 0 ? control_in(length, data) : control_out(length, data);
}

int Controller::control_in(std::uint16_t wanted, std::uint8_t* data) {
  std::size_t got = 0;
  for (int size = USB_PACKET; size == USB_PACKET && got < wanted;) {
    if (control_stalled_) return kStall;
    size = take_packet(control_in_, data + got, wanted - got);
    if (size == kNak) return kHang;
    if (size < 0) return size;
    got += static_cast<std::size_t>(size);
    if (!control_in_.armed) usb_on_sent(&device_, 0x80);
  }
  if (control_stalled_) return kStall;
  if (!out_armed_ || out_size_ != 0) return kHang;
  out_armed_ = false;
  usb_on_received(&device_, 0);
  return static_cast<int>(got);
}

int Controller::control_out(std::uint16_t size, const std::uint8_t* data) {
  if (size > 0) {
    if (control_stalled_) return kStall;
    if (!out_armed_ || out_size_ != size) return kHang;
    out_armed_ = false;
    std::memcpy(out_data_, data, size);
    usb_on_received(&device_, size);
  }
  if (control_stalled_) return kStall;
  if (!control_in_.armed || control_in_.size != 0) return kHang;
  control_in_.armed = false;
  usb_on_sent(&device_, 0x80);
  return size;
}

void Controller::reset() {
  control_in_ = {};
  out_armed_ = control_stalled_ = false;
  address_ = 0;
  usb_on_reset(&device_);
  stream_ = {};
}

void Controller::on_set_address(void* context, std::uint8_t address) {
  static_cast<Controller*>(context)->address_ = address;
}

void Controller::on_open(void* context, std::uint8_t /*endpoint*/, std::uint16_t /*size*/) {
  auto& stream = static_cast<Controller*>(context)->stream_;
  stream = {};
  stream.open = true;
}

void Controller::on_close(void* context, std::uint8_t /*endpoint*/) {
  static_cast<Controller*>(context)->stream_ = {};
}

void Controller::on_send(void* context, std::uint8_t endpoint, const std::uint8_t* data, std::uint16_t size) {
  Endpoint& in = static_cast<Controller*>(context)->in_endpoint(endpoint);
  in.data = data;
  in.size = size;
  in.sent = 0;
  in.armed = true;
}

void Controller::on_receive(void* context, std::uint8_t* data, std::uint16_t size) {
  auto& self = *static_cast<Controller*>(context);
  self.out_data_ = data;
  self.out_size_ = size;
  self.out_armed_ = true;
}

void Controller::on_stall(void* context, std::uint8_t endpoint) {
  auto& self = *static_cast<Controller*>(context);
  if (endpoint == TRW_USB_STREAM_IN) {
    self.stream_.stalled = true;
    self.stream_.armed = false;
  } else {
    self.control_stalled_ = true;
  }
}

void Controller::on_clear_stall(void* context, std::uint8_t /*endpoint*/) {
  auto& self = *static_cast<Controller*>(context);
  self.stream_.stalled = false;
  self.stream_.armed = false;
}

}  // namespace tunnelrig::simulated
