#include "ring.h"

/* The test that walks through all interleavings replaces these four by versions that hand over to the other
 * side. */
#ifndef RING_LOAD
#define RING_LOAD(address) __atomic_load_n((address), __ATOMIC_ACQUIRE)
#define RING_STORE(address, value) __atomic_store_n((address), (value), __ATOMIC_RELEASE)
#define RING_WRITE_SLOT(to, from) (*(to) = *(from))
#endif

_Static_assert(sizeof(ring_slot) == 16, "the ring's size is counted in slots of 16 bytes");

void ring_init(frame_ring* ring, ring_slot* slots, uint32_t capacity) {
  ring->slots = slots;
  ring->mask = capacity - 1u;
  ring->head = 0;
  ring->tail = 0;
}

bool ring_push(frame_ring* ring, const ring_slot* slot) {
  uint32_t head = ring->head; /* its own index needs no ordering */
  if (head - RING_LOAD(&ring->tail) > ring->mask) return false;
  RING_WRITE_SLOT(&ring->slots[head & ring->mask], slot);
  RING_STORE(&ring->head, head + 1u);
  return true;
}

uint32_t ring_count(const frame_ring* ring) { return RING_LOAD(&ring->head) - ring->tail; }

const ring_slot* ring_at(const frame_ring* ring, uint32_t i) {
  return &ring->slots[(ring->tail + i) & ring->mask];
}

void ring_release(frame_ring* ring, uint32_t count) { RING_STORE(&ring->tail, ring->tail + count); }

uint32_t ring_head(const frame_ring* ring) { return RING_LOAD(&ring->head); }

void ring_drop_until(frame_ring* ring, uint32_t head) {
  if ((int32_t)(head - ring->tail) > 0) RING_STORE(&ring->tail, head);
}
