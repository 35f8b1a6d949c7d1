#include "otg_fs.h"

#include "stm32f405.h"

/* Words of the 320 there are (34.11): received packets, control IN, stream IN (four packets, so that the bus
 * never waits for the processor). */
enum { kReceiveWords = 96, kControlWords = 32, kStreamWords = 128 };
enum { kPolls = 200000, kAlternateOtg = 10, kTurnaround = 6 /* 34.17.7: AHB above 32 MHz */ };

/* GINTSTS, 34.16.2 */
enum {
  kIntReceive = BIT(4),
  kIntSuspend = BIT(11),
  kIntReset = BIT(12),
  kIntEnumerated = BIT(13),
  kIntIn = BIT(18),
  kIntOut = BIT(19)
};
#define kIntResume 0x80000000u
/* DIEPCTL, DOEPCTL, 34.16.4 */
enum {
  kActive = BIT(15),
  kNak = BIT(17),
  kStall = BIT(21),
  kClearNak = BIT(26),
  kSetNak = BIT(27),
  kData0 = BIT(28),
  kDisable = BIT(30)
};
#define kEnable 0x80000000u
/* DIEPINT, DOEPINT */
enum { kDone = BIT(0), kDisabled = BIT(1), kSetupDone = BIT(3), kNakEffective = BIT(6), kEmpty = BIT(7) };
/* GRXSTSP packet status */
enum { kOutPacket = 2, kSetupPacket = 6 };

typedef struct {
  const uint8_t* data;
  uint16_t left;    /* bytes not yet in the FIFO */
  uint16_t waiting; /* control endpoint: bytes of further transfers, one packet each (34.17.5) */
  bool busy;
} transfer;

static usb_device* device;
static transfer in[2]; /* endpoints 0x80 and 0x81 */
static uint8_t setup[8];
static uint8_t* out_data;
static uint16_t out_room, out_size;

static uint32_t number_of(uint8_t endpoint) { return endpoint & 1u; }

static void flush_transmit(uint32_t fifo) {
  WR(OTG_GRSTCTL, BIT(5) | (fifo << 6));
  (void)wait_for(OTG_GRSTCTL, BIT(5), 0, kPolls);
}

/* Up to four bytes, the first lowest. */
static uint32_t word_of(const uint8_t* data, uint32_t size) {
  if (size >= 4) return trw_get32(data);
  uint32_t word = 0;
  while (size > 0) word = (word << 8) | data[--size];
  return word;
}

/* 34.17.5: a packet goes into the FIFO word by word, once there is room for the whole of it. */
static void fill_fifo(uint32_t n) {
  transfer* t = &in[n];
  while (t->left != 0) {
    uint32_t size = t->left;
    if (size > USB_PACKET) size = USB_PACKET;
    if ((RD(OTG_DTXFSTS(n)) & 0xFFFFu) < (size + 3u) / 4u) return;
    for (uint32_t at = 0; at < size; at += 4) WR(OTG_FIFO(n), word_of(t->data + at, size - at));
    t->data += size;
    t->left = (uint16_t)(t->left - size);
  }
  CLEAR(OTG_DIEPEMPMSK, BIT(n));
}

static void begin_in(uint32_t n, uint16_t size) {
  uint32_t packets = size == 0 ? 1u : (size + USB_PACKET - 1u) / USB_PACKET;
  in[n].left = size;
  in[n].busy = true;
  WR(OTG_DIEPTSIZ(n), size | (packets << 19));
  SET(OTG_DIEPCTL(n), kEnable | kClearNak);
  if (size > 0) SET(OTG_DIEPEMPMSK, BIT(n)); /* the FIFO is filled by the interrupt */
}

/* Takes back an IN transfer (34.17.5, "Disabling an IN endpoint"). */
static void abort_in(uint32_t n) {
  CLEAR(OTG_DIEPEMPMSK, BIT(n));
  in[n].busy = false;
  in[n].left = 0;
  if ((RD(OTG_DIEPCTL(n)) & kEnable) != 0) {
    SET(OTG_DIEPCTL(n), kSetNak);
    (void)wait_for(OTG_DIEPINT(n), kNakEffective, kNakEffective, kPolls);
    SET(OTG_DIEPCTL(n), kSetNak | kDisable);
    (void)wait_for(OTG_DIEPINT(n), kDisabled, kDisabled, kPolls);
    WR(OTG_DIEPINT(n), kDisabled);
  }
  flush_transmit(n);
}

/* Room for setup packets, always; three back to back (34.17.5). */
static void arm_setup(void) { WR(OTG_DOEPTSIZ(0), (3u << 29) | (1u << 19) | USB_PACKET); }

/* --- the seam
 * --------------------------------------------------------------------------------------------------- */

static void set_address(void* context, uint8_t address) {
  (void)context;
  WR(OTG_DCFG,
     (RD(OTG_DCFG) & ~(0x7Fu << 4)) | ((uint32_t)address << 4)); /* before the status stage (34.17.4) */
}

static void open_in(void* context, uint8_t endpoint, uint16_t packet_size) {
  (void)context;
  (void)endpoint;
  abort_in(1);
  WR(OTG_DIEPCTL(1), kActive | kData0 | (2u << 18) | (1u << 22) | packet_size); /* bulk, FIFO 1, DATA0 */
  SET(OTG_DAINTMSK, BIT(1));
}

static void close_in(void* context, uint8_t endpoint) {
  (void)context;
  (void)endpoint;
  abort_in(1);
  CLEAR(OTG_DAINTMSK, BIT(1));
  CLEAR(OTG_DIEPCTL(1), kActive);
}

static void send(void* context, uint8_t endpoint, const uint8_t* data, uint16_t size) {
  (void)context;
  uint32_t n = number_of(endpoint);
  in[n].data = data;
  uint16_t now = size;
  if (n == 0 && size > USB_PACKET) now = USB_PACKET; /* endpoint 0 counts one packet at a time */
  in[n].waiting = (uint16_t)(size - now);
  begin_in(n, now);
}

static void receive(void* context, uint8_t* data, uint16_t size) {
  (void)context;
  out_data = data;
  out_room = size;
  out_size = 0;
  arm_setup();
  SET(OTG_DOEPCTL(0), kEnable | kClearNak);
}

static void stall(void* context, uint8_t endpoint) {
  (void)context;
  if (endpoint == 0) {
    SET(OTG_DIEPCTL(0), kStall); /* the core clears both at the next setup (34.16.4) */
    SET(OTG_DOEPCTL(0), kStall);
  } else {
    abort_in(1);
    SET(OTG_DIEPCTL(1), kStall);
  }
}

static void clear_stall(void* context, uint8_t endpoint) {
  (void)context;
  (void)endpoint;
  abort_in(1);
  WR(OTG_DIEPCTL(1), (RD(OTG_DIEPCTL(1)) & ~(uint32_t)kStall) | kData0);
}

const usb_controller otg_fs = {set_address, open_in, close_in, send, receive, stall, clear_stall};

/* --- interrupts
 * ------------------------------------------------------------------------------------------------- */

/* 34.17.3, "Initialization on USB reset". */
static void on_reset(void) {
  CLEAR(OTG_DCTL, BIT(0));
  abort_in(0);
  abort_in(1);
  out_data = NULL;
  WR(OTG_DAINTMSK, BIT(0) | BIT(16));
  WR(OTG_DOEPMSK, kDone | kSetupDone);
  WR(OTG_DIEPMSK, kDone);
  WR(OTG_GRXFSIZ, kReceiveWords);
  WR(OTG_DIEPTXF0, ((uint32_t)kControlWords << 16) | kReceiveWords);
  WR(OTG_DIEPTXF1, ((uint32_t)kStreamWords << 16) | (kReceiveWords + kControlWords));
  WR(OTG_DCFG, RD(OTG_DCFG) & ~(0x7Fu << 4));
  arm_setup();
  usb_on_reset(device);
}

/* 34.17.3, "Initialization on enumeration completion". */
static void on_enumerated(void) {
  CLEAR(OTG_DIEPCTL(0), 3u); /* packets of 64 bytes */
  WR(OTG_GUSBCFG, (RD(OTG_GUSBCFG) & ~(15u << 10)) | ((uint32_t)kTurnaround << 10));
}

/* Everything that is received comes through one FIFO (34.17.5); what nobody waits for is read and dropped. */
static void on_receive(void) {
  uint32_t status = RD(OTG_GRXSTSP);
  uint32_t kind = (status >> 17) & 15u, size = (status >> 4) & 0x7FFu;
  uint8_t* to = kind == kSetupPacket ? setup : out_data;
  uint32_t room = kind == kSetupPacket ? sizeof setup : to != NULL ? out_room : 0u;
  for (uint32_t i = 0; i < size; i += 4) {
    uint32_t word = RD(OTG_FIFO(0));
    for (uint32_t k = 0; k < 4 && i + k < size; ++k) {
      if (i + k < room) to[i + k] = (uint8_t)(word >> (8u * k));
    }
  }
  if (kind == kOutPacket) out_size = (uint16_t)size;
}

static void on_out(void) {
  uint32_t flags = RD(OTG_DOEPINT(0));
  WR(OTG_DOEPINT(0), flags);
  if ((flags & kSetupDone) != 0) {
    if (in[0].busy) abort_in(0); /* a new request ends the old one */
    out_data = NULL;
    arm_setup();
    usb_on_setup(device, setup);
  } else if ((flags & kDone) != 0 && out_data != NULL) {
    out_data = NULL;
    arm_setup();
    usb_on_received(device, out_size);
  }
}

static void on_in_done(uint32_t n) {
  in[n].busy = false;
  if (n == 0 && in[0].waiting > 0) {
    uint16_t size = in[0].waiting < USB_PACKET ? in[0].waiting : USB_PACKET;
    in[0].waiting = (uint16_t)(in[0].waiting - size);
    begin_in(0, size);
  } else {
    usb_on_sent(device, n == 0 ? 0x80 : TRW_USB_STREAM_IN);
  }
}

static void on_in(void) {
  uint32_t pending = RD(OTG_DAINT) & 3u;
  for (uint32_t n = 0; n < 2; ++n) {
    if ((pending & BIT(n)) == 0) continue;
    uint32_t flags = RD(OTG_DIEPINT(n));
    if ((flags & kDone) != 0) {
      WR(OTG_DIEPINT(n), kDone);
      if (in[n].busy) on_in_done(n);
    }
    if ((flags & kEmpty) != 0 && (RD(OTG_DIEPEMPMSK) & BIT(n)) != 0) fill_fifo(n);
  }
}

void otg_fs_interrupt(void) {
  uint32_t flags = RD(OTG_GINTSTS) & RD(OTG_GINTMSK);
  if ((flags & kIntReset) != 0) {
    WR(OTG_GINTSTS, kIntReset);
    on_reset();
  }
  if ((flags & kIntEnumerated) != 0) {
    WR(OTG_GINTSTS, kIntEnumerated);
    on_enumerated();
  }
  if ((flags & kIntReceive) != 0) on_receive(); /* read-only flag: gone when the FIFO has been read */
  if ((flags & kIntOut) != 0) on_out();
  if ((flags & kIntIn) != 0) on_in();
  if ((flags & kIntSuspend) != 0) {
    WR(OTG_GINTSTS, kIntSuspend);
    usb_on_suspend(device, true);
  }
  if ((flags & kIntResume) != 0) {
    WR(OTG_GINTSTS, kIntResume);
    usb_on_suspend(device, false);
  }
}

/* --- start
 * ------------------------------------------------------------------------------------------------------ */

static void set_up_pins(void) {
  SET(RCC_AHB1ENR, BIT(0));
  SET(GPIOA + GPIO_OSPEEDR, (3u << 22) | (3u << 24));
  WR(GPIOA + GPIO_AFRH, (RD(GPIOA + GPIO_AFRH) & ~((15u << 12) | (15u << 16))) | (kAlternateOtg << 12) |
                            (kAlternateOtg << 16)); /* PA11, PA12 */
  WR(GPIOA + GPIO_MODER, (RD(GPIOA + GPIO_MODER) & ~((3u << 22) | (3u << 24))) | (2u << 22) | (2u << 24));
}

bool otg_fs_init(usb_device* usb) {
  device = usb;
  set_up_pins();
  SET(RCC_AHB2ENR, BIT(7));
  /* 34.16.2: PHYSEL; then the core's own reset, which needs an idle AHB first. */
  SET(OTG_GUSBCFG, BIT(6));
  if (!wait_for(OTG_GRSTCTL, 0x80000000u, 0x80000000u, kPolls)) return false;
  SET(OTG_GRSTCTL, BIT(0));
  if (!wait_for(OTG_GRSTCTL, BIT(0), 0, kPolls)) return false;
  /* The transceiver on, and VBUS sensing off: PA9 is left to the designer, and a bus-powered board has VBUS
   * by nature. On the F405 the bit is NOVBUSSENS (34.16.2, OTG_FS_GCCFG); the F446's VBDEN would do nothing
   * here. */
  WR(OTG_GCCFG, BIT(16) | BIT(21));
  SET(OTG_GUSBCFG, BIT(30)); /* device mode, which takes 25 ms (34.17.1) */
  if (!wait_for(OTG_GINTSTS, BIT(0), 0, 25u * (uint32_t)kPolls)) return false;
  SET(OTG_DCTL, BIT(1)); /* not connected while it is being set up */
  WR(OTG_PCGCCTL, 0);
  SET(OTG_DCFG, 3u); /* full speed */
  WR(OTG_GRXFSIZ, kReceiveWords);
  flush_transmit(0x10); /* all of them */
  WR(OTG_GRSTCTL, BIT(4));
  if (!wait_for(OTG_GRSTCTL, BIT(4), 0, kPolls)) return false;
  WR(OTG_GINTSTS, 0xFFFFFFFFu);
  WR(OTG_GINTMSK, kIntReceive | kIntSuspend | kIntReset | kIntEnumerated | kIntIn | kIntOut | kIntResume);
  WR(OTG_GAHBCFG, BIT(0));
  CLEAR(OTG_DCTL, BIT(1));
  return true;
}
