#ifndef RING_INTERLEAVINGS_H
#define RING_INTERLEAVINGS_H

#include "ring.h"

#ifdef __cplusplus
extern "C" {
#endif

/* core/ring.c once more, with every access to what both sides share announced by a call first. */
extern void (*interleaved_step)(void); /* NOLINT(modernize-redundant-void-arg): C reads this as well */
void interleaved_init(frame_ring* ring, ring_slot* slots, uint32_t capacity);
bool interleaved_push(frame_ring* ring, const ring_slot* slot);
uint32_t interleaved_count(const frame_ring* ring);
void interleaved_read(const frame_ring* ring, ring_slot* slot); /* the oldest, in two halves */
void interleaved_release(frame_ring* ring, uint32_t count);

#ifdef __cplusplus
}
#endif

#endif
