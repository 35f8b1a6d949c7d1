#include "rig_board.h"

#include "commands.h"

enum { kConverterTop = 4095, kDefaultNumerator_hz = 4000, kDefaultDenominator = 3 };

static void on_configured(void* context, bool on);
static void on_sent(void* context);
static void on_halted(void* context, bool on);

static const usb_application kApplication = {commands_in, commands_out, on_configured, on_sent, on_halted};

void board_init(rig_board* b, const board_port* port, void* port_context, const usb_controller* controller,
                void* controller_context, const trw_identity* identity, uint32_t highest_rate_hz,
                uint32_t scan_ticks) {
  memset(b, 0, sizeof *b);
  b->port = port;
  b->port_context = port_context;
  b->identity = *identity;
  b->identity.protocol = TRW_USB_PROTOCOL;
  b->identity.ring_frames = BOARD_RING_FRAMES;
  b->highest_rate_hz = highest_rate_hz;
  b->scan_ticks = scan_ticks;
  ring_init(&b->ring, b->slots, BOARD_RING_FRAMES);
  const trw_rate_wish wish = {kDefaultNumerator_hz, kDefaultDenominator, 1};
  (void)board_set_rate(b, &wish);
  usb_init(&b->usb, controller, controller_context, &kApplication, b, identity->unique_id);
}

/* --- commands
 * --------------------------------------------------------------------------------------------------- */

/* Only a whole number of ticks is exact, and with oversampling a whole number per scan. A scan that is asked
 * for while the last one is under way would not come. */
bool board_set_rate(rig_board* b, const trw_rate_wish* wish) {
  if (b->running || wish->numerator_hz == 0 || wish->denominator == 0) return false;
  if (wish->oversampling != 1 && wish->oversampling != DECIMATION) return false;
  uint64_t dividend = (uint64_t)b->identity.tick_hz * wish->denominator;
  uint64_t ticks = dividend / wish->numerator_hz;
  if (dividend % wish->numerator_hz != 0 || ticks > UINT32_MAX || ticks % wish->oversampling != 0)
    return false;
  if (ticks * b->highest_rate_hz < b->identity.tick_hz) return false;
  if (ticks / wish->oversampling < b->scan_ticks) return false;
  b->rate = (trw_rate){b->identity.tick_hz, (uint32_t)ticks, wish->oversampling};
  uint64_t frames = (uint64_t)b->identity.tick_hz * BOARD_PACKET_MS / (1000u * ticks);
  b->packet_frames = frames == 0 ? 1u : frames > BOARD_PACKET_FRAMES ? BOARD_PACKET_FRAMES : (uint32_t)frames;
  return true;
}

static void reset_filter(rig_board* b) {
  decimator_reset(&b->filter);
  b->clipped_blocks = 0;
}

void board_start(rig_board* b, bool pattern) {
  if (b->running) return;
  b->pattern = pattern;
  b->running = true;
  b->pending_status = 0; /* of the last run */
  reset_filter(b);
  uint32_t ticks_per_scan = b->rate.ticks_per_frame / b->rate.oversampling;
  b->origin_sequence = b->sequence;
  b->origin_ticks = b->port->ticks(b->port_context) + b->rate.ticks_per_frame;
  b->port->start_sampling(b->port_context, ticks_per_scan, b->rate.oversampling);
}

void board_stop(rig_board* b) {
  if (!b->running) return;
  b->port->stop_sampling(b->port_context);
  b->running = false;
  ++b->stops;
  b->drop = true; /* the ring's consumer is the main loop, which does it */
  b->drop_head = ring_head(&b->ring);
}

/* --- sampling interrupt
 * ----------------------------------------------------------------------------------------- */

int16_t board_pattern(uint64_t sequence, uint32_t c) {
  return (int16_t)(uint16_t)(sequence * (2 * c + 1) + c);
}

static uint16_t clipped(const uint16_t* scans, uint32_t conversions) {
  uint32_t bits = 0;
  for (uint32_t i = 0; i < conversions; ++i) {
    if (scans[i] == 0 || scans[i] >= kConverterTop) bits |= 1u << (i % TRW_CHANNELS);
  }
  return (uint16_t)bits;
}

/* A block that was clipped is in as many frames as the filter is blocks long. */
static uint16_t clipped_in_filter(rig_board* b, uint16_t now) {
  const uint64_t memory = (UINT64_C(1) << (TRW_CHANNELS * DECIMATOR_BLOCKS)) - 1u;
  b->clipped_blocks = (b->clipped_blocks << TRW_CHANNELS | now) & memory;
  uint64_t any = b->clipped_blocks;
  for (uint32_t shift = 32; shift >= TRW_CHANNELS; shift /= 2) any |= any >> shift;
  return (uint16_t)(any & TRW_STATUS_CLIPPED_MASK);
}

static void fill_frame(rig_board* b, const uint16_t* scans, trw_frame* frame) {
  frame->status = b->pending_status;
  if (b->pattern) {
    for (uint32_t c = 0; c < TRW_CHANNELS; ++c) frame->sample[c] = board_pattern(b->sequence, c);
    frame->status = (uint16_t)(frame->status | TRW_STATUS_TEST_PATTERN);
    return;
  }
  uint16_t bits = clipped(scans, b->rate.oversampling * TRW_CHANNELS);
  if (b->rate.oversampling == 1) {
    for (uint32_t c = 0; c < TRW_CHANNELS; ++c) frame->sample[c] = (int16_t)scans[c];
  } else {
    bits = clipped_in_filter(b, bits);
    decimator_step(&b->filter, scans, frame->sample);
  }
  frame->status = (uint16_t)(frame->status | bits);
}

void board_on_scans(rig_board* b, const uint16_t* scans) {
  ring_slot slot;
  fill_frame(b, scans, &slot.frame);
  slot.sequence = (uint32_t)b->sequence++; /* numbered here, before anything can be lost */
  if (ring_push(&b->ring, &slot)) {
    b->pending_status = 0;
    uint32_t fill = b->ring.head - __atomic_load_n(&b->ring.tail, __ATOMIC_RELAXED);
    if (fill > b->ring_peak) b->ring_peak = fill;
  } else {
    ++b->overruns;
    b->pending_status = (uint16_t)(b->pending_status | TRW_STATUS_OVERRUN);
  }
}

uint32_t board_frames_made(const rig_board* b) { return ring_head(&b->ring) + b->overruns; }

uint32_t board_frames_missed(const rig_board* b, uint64_t now_ticks) {
  /* The origin is the end of the first frame: before it nothing can have been missed. */
  if (now_ticks < b->origin_ticks) return 0;
  uint64_t due = b->origin_sequence + (now_ticks - b->origin_ticks) / b->rate.ticks_per_frame + 1u;
  return due > b->sequence ? (uint32_t)(due - b->sequence) : 0u;
}

void board_on_adc_error(rig_board* b, uint32_t frames_missed) {
  ++b->adc_errors;
  b->sequence += frames_missed;
  reset_filter(b); /* or it would mix what was before the gap into the frames behind it */
  b->pending_status = (uint16_t)(b->pending_status | TRW_STATUS_ADC_ERROR);
}

/* --- main loop
 * -------------------------------------------------------------------------------------------------- */

/* How many frames from the oldest on follow each other, at most `limit`. */
static uint32_t consecutive(const rig_board* b, uint32_t limit) {
  uint32_t first = ring_at(&b->ring, 0)->sequence, count = 1;
  while (count < limit && ring_at(&b->ring, count)->sequence == first + count) {
    if ((ring_at(&b->ring, count)->frame.status & TRW_STATUS_OVERRUN) != 0) break;
    ++count;
  }
  return count;
}

static uint16_t put_packet(rig_board* b, uint8_t* out, uint32_t count) {
  /* A stop that came since: these frames are not wanted, and the rate may be another one by now. */
  uint32_t key = b->port->lock(b->port_context);
  if (b->drop) {
    b->port->unlock(b->port_context, key);
    return 0;
  }
  /* The ring carries 32 bits of the number; the rest follows, since numbers only grow. */
  uint32_t step = ring_at(&b->ring, 0)->sequence - (uint32_t)b->sent_sequence;
  b->sent_sequence += step;
  uint64_t since = b->sent_sequence - b->origin_sequence;
  const trw_header header = {.boot_id = b->identity.boot_id,
                             .tick_hz = b->rate.tick_hz,
                             .first_sequence = b->sent_sequence,
                             .first_ticks = b->origin_ticks + since * b->rate.ticks_per_frame,
                             .ticks_per_frame = b->rate.ticks_per_frame,
                             .overruns = b->overruns,
                             .frame_count = (uint8_t)count};
  b->port->unlock(b->port_context, key);
  trw_put_header(out, &header);
  size_t at = TRW_HEADER_SIZE;
  for (uint32_t i = 0; i < count; ++i, at += TRW_FRAME_SIZE)
    trw_put_frame(out + at, &ring_at(&b->ring, i)->frame);
  trw_put32(out + at, trw_crc32c(0, out, at));
  ring_release(&b->ring, count);
  return (uint16_t)(at + TRW_CRC_SIZE);
}

static void drop_unwanted(rig_board* b) {
  uint32_t key = b->port->lock(b->port_context);
  bool drop = b->drop;
  uint32_t head = b->drop_head;
  b->drop = false;
  b->port->unlock(b->port_context, key);
  if (drop) ring_drop_until(&b->ring, head);
}

uint16_t board_next_packet(rig_board* b, uint8_t* out) {
  drop_unwanted(b);
  uint32_t waiting = ring_count(&b->ring);
  if (waiting < b->packet_frames) return 0;
  /* Behind a pause of the host packets are as long as they can be. */
  uint32_t limit = waiting >= TRW_MAX_FRAMES ? TRW_MAX_FRAMES : b->packet_frames;
  return put_packet(b, out, consecutive(b, limit));
}

static void send(rig_board* b) {
  uint32_t key = b->port->lock(b->port_context);
  b->unsent = false;
  b->in_flight = usb_send(&b->usb, b->transfer, b->transfer_size);
  b->unsent = !b->in_flight;
  b->port->unlock(b->port_context, key);
}

/* With more to come only whole USB packets are sent and the rest is carried over: a short packet would end
 * the host's transfer, and large transfers are what a host is quick with. False where there is nothing to
 * send. */
static bool fill_transfer(rig_board* b) {
  b->transfer_stops = b->stops;
  uint16_t size = b->carried, more;
  memcpy(b->transfer, b->carry, size);
  do {
    more = board_next_packet(b, b->transfer + size);
    size = (uint16_t)(size + more);
  } while (more > 0 && size + TRW_MAX_PACKET <= BOARD_TRANSFER);
  /* Where the last transfer ended on a full packet, and nothing follows, the host still waits for its end. */
  if (size == 0 && !b->flush) return false;
  bool backlog = more > 0 && ring_count(&b->ring) >= b->packet_frames;
  b->carried = backlog ? (uint16_t)(size % USB_PACKET) : 0u;
  b->transfer_size = (uint16_t)(size - b->carried);
  memcpy(b->carry, b->transfer + b->transfer_size, b->carried);
  b->flush = b->transfer_size > 0 && b->transfer_size % USB_PACKET == 0;
  return true;
}

void board_poll(rig_board* b) {
  uint32_t key = b->port->lock(b->port_context);
  bool ready = b->usb.configuration != 0 && !b->usb.halted && !b->in_flight;
  bool stale = b->transfer_stops != b->stops;
  if (stale) b->unsent = false;
  bool again = b->unsent;
  b->port->unlock(b->port_context, key);
  if (!ready) {
    drop_unwanted(b);
    return;
  }
  if (stale) b->carried = 0;
  if (!again && !fill_transfer(b)) return;
  send(b);
}

/* --- upcalls of the USB device
 * ---------------------------------------------------------------------------------- */

/* A transfer that the bus cut off goes out again as a whole: what the host has seen of it already it knows by
 * its number. */
static void requeue(rig_board* b) {
  if (b->in_flight) b->unsent = true;
  b->in_flight = false;
}

static void on_configured(void* context, bool on) {
  (void)on; /* sampling goes on while the cable is out */
  requeue((rig_board*)context);
}

static void on_sent(void* context) {
  rig_board* b = (rig_board*)context;
  b->in_flight = false;
  ++b->transfers;
}

static void on_halted(void* context, bool on) {
  (void)on;
  requeue((rig_board*)context);
}
