#include "commands.h"

#include "rig_board.h"

static int identify(const rig_board* b, uint8_t* reply) {
  trw_identity identity = b->identity;
  if (b->running) identity.flags = (uint8_t)(identity.flags | TRW_FLAG_RUNNING);
  trw_put_identity(reply, &identity);
  return TRW_IDENTITY_SIZE;
}

static int statistics(rig_board* b, uint8_t* reply) {
  uint32_t key = b->port->lock(b->port_context);
  const trw_statistics now = {.frames = b->sequence,
                              .ring_peak = b->ring_peak,
                              .overruns = b->overruns,
                              .stalls = b->usb.stalls,
                              .resets = b->usb.resets,
                              .suspends = b->usb.suspends,
                              .adc_errors = b->adc_errors,
                              .transfers = b->transfers,
                              .isr_cycles = b->isr_cycles};
  b->port->unlock(b->port_context, key);
  trw_put_statistics(reply, &now);
  return TRW_STATISTICS_SIZE;
}

static bool has_amplifier(const rig_board* b, const usb_setup* setup) {
  return setup->value < TRW_CHANNELS && ((b->identity.amplifier_mask >> setup->value) & 1u) != 0;
}

static int get_amplifier(const rig_board* b, const usb_setup* setup, uint8_t* reply) {
  if (!has_amplifier(b, setup)) return -1;
  trw_put16(reply, b->amplifier[setup->value].gain);
  trw_put16(reply + 2, b->amplifier[setup->value].offset);
  return TRW_AMPLIFIER_SIZE;
}

static bool set_amplifier(rig_board* b, const usb_setup* setup, const uint8_t* data) {
  if (!has_amplifier(b, setup) || setup->length != TRW_AMPLIFIER_SIZE || b->port->set_amplifier == NULL)
    return false;
  const trw_amplifier wish = {trw_get16(data), trw_get16(data + 2)};
  if (!b->port->set_amplifier(b->port_context, (uint8_t)setup->value, wish)) return false;
  b->amplifier[setup->value] = wish;
  return true;
}

static bool set_rate(rig_board* b, const usb_setup* setup, const uint8_t* data) {
  if (setup->length != TRW_RATE_WISH_SIZE) return false;
  trw_rate_wish wish;
  trw_get_rate_wish(data, &wish);
  return board_set_rate(b, &wish);
}

static bool start(rig_board* b, const usb_setup* setup) {
  if (setup->value > TRW_PATTERN_COUNTER || setup->length != 0) return false;
  board_start(b, setup->value == TRW_PATTERN_COUNTER);
  return true;
}

static bool stop(rig_board* b, const usb_setup* setup) {
  if (setup->value != 0 || setup->length != 0) return false;
  board_stop(b);
  return true;
}

static bool loader(rig_board* b, const usb_setup* setup) {
  if (setup->value != TRW_USB_LOADER_KEY || setup->length != 0) return false;
  board_stop(b);
  b->port->reboot_to_loader(b->port_context);
  return true;
}

int commands_in(void* context, const usb_setup* setup, uint8_t* reply) {
  rig_board* b = (rig_board*)context;
  switch (setup->request) {
    case TRW_USB_IDENTIFY:
      return identify(b, reply);
    case TRW_USB_GET_RATE:
      trw_put_rate(reply, &b->rate);
      return TRW_RATE_SIZE;
    case TRW_USB_GET_AMPLIFIER:
      return get_amplifier(b, setup, reply);
    case TRW_USB_STATISTICS:
      return statistics(b, reply);
    default:
      return -1;
  }
}

bool commands_out(void* context, const usb_setup* setup, const uint8_t* data) {
  rig_board* b = (rig_board*)context;
  switch (setup->request) {
    case TRW_USB_START:
      return start(b, setup);
    case TRW_USB_STOP:
      return stop(b, setup);
    case TRW_USB_SET_RATE:
      return set_rate(b, setup, data);
    case TRW_USB_SET_AMPLIFIER:
      return set_amplifier(b, setup, data);
    case TRW_USB_LOADER:
      return loader(b, setup);
    default:
      return false;
  }
}
