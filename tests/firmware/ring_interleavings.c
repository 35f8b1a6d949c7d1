#include "ring_interleavings.h"

void (*interleaved_step)(void);

static uint32_t stepped_load(const uint32_t* address) {
  interleaved_step();
  return *address;
}

static void stepped_store(uint32_t* address, uint32_t value) {
  interleaved_step();
  *address = value;
}

/* Not at once: the other side may look at a slot that is half written. */
static void stepped_write(ring_slot* to, const ring_slot* from) {
  interleaved_step();
  to->sequence = from->sequence;
  interleaved_step();
  to->frame = from->frame;
}

#define RING_LOAD(address) stepped_load(address)
#define RING_STORE(address, value) stepped_store((address), (value))
#define RING_WRITE_SLOT(to, from) stepped_write((to), (from))
#define ring_init interleaved_init
#define ring_push interleaved_push
#define ring_count interleaved_count
#define ring_at interleaved_at
#define ring_release interleaved_release
#define ring_head interleaved_head
#define ring_drop_until interleaved_drop_until
#include "../../firmware_stm32/core/ring.c"

void interleaved_read(const frame_ring* ring, ring_slot* slot) {
  const ring_slot* oldest = ring_at(ring, 0);
  interleaved_step();
  slot->sequence = oldest->sequence;
  interleaved_step();
  slot->frame = oldest->frame;
}
