/* The instrument: sampler, ring, packetiser, USB device and commands, wired together. One per board, static.
 *
 *   sampling interrupt   board_on_scans -> number -> filter -> ring
 *   USB interrupt        usb_on_...     -> commands, ends of transfers
 *   main loop            board_poll     -> ring -> packets -> usb_send
 */
#ifndef TUNNELRIG_RIG_BOARD_H
#define TUNNELRIG_RIG_BOARD_H

#include "decimator.h"
#include "ring.h"
#include "usb_device.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  BOARD_RING_FRAMES = 4096, /* 64 KiB, 3.07 s at 4000/3 Hz */
  BOARD_TRANSFER = 4096,    /* bytes sent in one go */
  BOARD_PACKET_FRAMES = 16, /* per packet when the host keeps up, fewer at low rates */
  BOARD_PACKET_MS = 12      /* and not older than this */
};

/* What the hardware does for the instrument. */
typedef struct {
  void (*start_sampling)(void* context, uint32_t ticks_per_scan, uint32_t scans_per_frame);
  void (*stop_sampling)(void* context);
  uint64_t (*ticks)(void* context); /* device clock since the boot, at tick_hz */
  uint32_t (*lock)(void* context);  /* holds sampling and USB interrupts off */
  void (*unlock)(void* context, uint32_t key);
  bool (*set_amplifier)(void* context, uint8_t channel, trw_amplifier wish); /* NULL where none is fitted */
  void (*reboot_to_loader)(void* context);                                   /* soon, not at once */
} board_port;

typedef struct {
  const board_port* port;
  void* port_context;
  trw_identity identity; /* flags and the like filled in by whoever starts the board */

  /* written by commands, read by the sampling interrupt while it runs */
  trw_rate rate;
  uint32_t highest_rate_hz; /* of frames: what the stream carries */
  uint32_t scan_ticks;      /* of the clock: what the converter needs for one scan */
  uint32_t packet_frames;
  bool running, pattern;
  uint32_t stops; /* how often it was stopped */

  /* the sampling interrupt's own */
  uint64_t sequence;        /* of the next frame */
  uint64_t origin_sequence; /* a frame and its time, from which all others follow: set at every start */
  uint64_t origin_ticks;
  uint16_t pending_status; /* bits for the next frame that is kept */
  uint32_t ring_peak, overruns, adc_errors, isr_cycles;
  decimator filter;
  uint64_t clipped_blocks; /* of the blocks in the filter, newest lowest: a bit for each channel */

  frame_ring ring;
  ring_slot slots[BOARD_RING_FRAMES];

  /* the main loop's own, but for what the lock guards */
  uint64_t sent_sequence; /* of the last packet, to widen the ring's 32 bits */
  uint8_t transfer[BOARD_TRANSFER];
  uint16_t transfer_size;
  uint8_t carry[USB_PACKET]; /* bytes that the next transfer begins with */
  uint16_t carried;
  uint32_t transfer_stops; /* `stops` when it was filled: what a stop has overtaken is not sent again */
  bool in_flight;          /* guarded: the controller holds `transfer` */
  bool unsent;             /* guarded: it was dropped before it was sent */
  bool drop;               /* guarded: frames up to drop_head are not wanted any more */
  bool flush; /* the last transfer ended on a full packet: an empty one must follow before a pause */
  uint32_t drop_head;
  uint32_t transfers;

  trw_amplifier amplifier[TRW_CHANNELS];
  usb_device usb;
} rig_board;

/* `identity` without describe and fault record is filled in later by the caller, before the bus is connected.
 * Rates above `highest_rate_hz`, or with less than `scan_ticks` of tick_hz from scan to scan, are refused. */
void board_init(rig_board* b, const board_port* port, void* port_context, const usb_controller* controller,
                void* controller_context, const trw_identity* identity, uint32_t highest_rate_hz,
                uint32_t scan_ticks);

/* Sampling interrupt: the scans of one frame (rate.oversampling x TRW_CHANNELS conversions). */
void board_on_scans(rig_board* b, const uint16_t* scans);

/* Frames of time between the last one and `now_ticks` of the device clock, which no sample was taken for. */
uint32_t board_frames_missed(const rig_board* b, uint64_t now_ticks);

/* Frames that the converter has made, kept or not, modulo 2^32. Numbers grow by those that were missed, too.
 */
uint32_t board_frames_made(const rig_board* b);

/* Sampling interrupt: a converter or DMA error; `frames_missed` frames of time went by unsampled. The filter
 * begins anew, as at a start. */
void board_on_adc_error(rig_board* b, uint32_t frames_missed);

/* Main loop: sends what there is to send. */
void board_poll(rig_board* b);

/* The same without USB, for a stream on a serial line: writes the next packet to `out` (TRW_MAX_PACKET bytes)
 * if there is one; its size, or 0. */
uint16_t board_next_packet(rig_board* b, uint8_t* out);

/* Commands, as the vendor requests give them. */
bool board_set_rate(rig_board* b, const trw_rate_wish* wish);
void board_start(rig_board* b, bool pattern);
void board_stop(rig_board* b);

/* The sample of the counter test pattern in channel `c` of frame `sequence`. */
int16_t board_pattern(uint64_t sequence, uint32_t c);

#ifdef __cplusplus
}
#endif

#endif
