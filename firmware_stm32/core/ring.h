/* Frames between the sampling interrupt and the packetiser: one producer, one consumer, no lock, static
 * storage.
 *
 *        tail                 head               Indices run freely through 2^32 and are masked where a slot
 * is v                    v                touched: head - tail is the fill, full is `capacity` and not one
 * less. |  .  |#####|#####|#####|  .  |  .  |        Only the producer writes head, only the consumer writes
 * tail.
 *
 *   empty: head == tail          full: head - tail == capacity, a push fails and the frame is the producer's
 * to count
 */
#ifndef TUNNELRIG_RING_H
#define TUNNELRIG_RING_H

#include "tunnelrig_wire.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  trw_frame frame;
  uint32_t sequence; /* low half of the frame's number */
} ring_slot;

typedef struct {
  ring_slot* slots;
  uint32_t mask; /* capacity - 1 */
  uint32_t head; /* next slot to be written; written by the producer */
  uint32_t tail; /* next slot to be read; written by the consumer */
} frame_ring;

/* `capacity` is a power of two. Not while producer or consumer are at work. */
void ring_init(frame_ring* ring, ring_slot* slots, uint32_t capacity);

/* Producer. False where the ring is full. */
bool ring_push(frame_ring* ring, const ring_slot* slot);

/* Consumer: frames waiting, and the i-th of them (i < count), valid until released. */
uint32_t ring_count(const frame_ring* ring);
const ring_slot* ring_at(const frame_ring* ring, uint32_t i);
void ring_release(frame_ring* ring, uint32_t count);

/* Where the next push goes; what the consumer has to reach to have dropped all that is older. */
uint32_t ring_head(const frame_ring* ring);
void ring_drop_until(frame_ring* ring, uint32_t head);

#ifdef __cplusplus
}
#endif

#endif
