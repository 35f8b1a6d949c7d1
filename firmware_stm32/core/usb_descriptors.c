#include "usb_descriptors.h"

#include "usb_device.h"

enum {
  kConfigurationSize = 9 + 9 + 7,
  kMsOsSize = 10 + 20 + 132,
  kBosSize = 5 + 28,
  kLongestString = 31 /* characters, so that a descriptor fits 64 bytes */
};

#define LOW(value) ((uint8_t)((value)&0xFF))
#define HIGH(value) ((uint8_t)((value) >> 8))
#define WIDE(character) (character), 0

/* 9.6.1. bcdUSB 2.01: there is a BOS descriptor. */
static const uint8_t kDevice[18] = {18,
                                    USB_DEVICE_DESCRIPTOR,
                                    0x01,
                                    0x02,
                                    0xFF,
                                    0,
                                    0,
                                    USB_PACKET,
                                    LOW(TRW_USB_VENDOR),
                                    HIGH(TRW_USB_VENDOR),
                                    LOW(TRW_USB_PRODUCT),
                                    HIGH(TRW_USB_PRODUCT),
                                    0x00,
                                    0x01,
                                    USB_STRING_MANUFACTURER,
                                    USB_STRING_PRODUCT,
                                    USB_STRING_SERIAL,
                                    1};

/* 9.6.3, 9.6.5, 9.6.6. Bus-powered, 200 mA, no remote wake-up. */
static const uint8_t kConfiguration[kConfigurationSize] = {
    9, USB_CONFIGURATION_DESCRIPTOR, kConfigurationSize, 0, 1,          1,    0, 0x80, 100,
    9, USB_INTERFACE_DESCRIPTOR,     TRW_USB_INTERFACE,  0, 1,          0xFF, 0, 0,    0,
    7, USB_ENDPOINT_DESCRIPTOR,      TRW_USB_STREAM_IN,  2, USB_PACKET, 0,    0};

static const uint8_t kLanguages[4] = {4, USB_STRING_DESCRIPTOR, LOW(USB_ENGLISH_US), HIGH(USB_ENGLISH_US)};

/* USB 3.2, 9.6.2, and "Microsoft OS 2.0 Descriptors Specification", table 4: the platform capability. */
static const uint8_t kBos[kBosSize] = {5,
                                       USB_BOS_DESCRIPTOR,
                                       kBosSize,
                                       0,
                                       1,
                                       28,
                                       USB_CAPABILITY_DESCRIPTOR,
                                       5,
                                       0,
                                       0xDF,
                                       0x60,
                                       0xDD,
                                       0xD8,
                                       0x89,
                                       0x45,
                                       0xC7,
                                       0x4C,
                                       0x9C,
                                       0xD2,
                                       0x65,
                                       0x9D,
                                       0x9E,
                                       0x64,
                                       0x8A,
                                       0x9F,
                                       0x00,
                                       0x00,
                                       0x03,
                                       0x06, /* from Windows 8.1 on */
                                       kMsOsSize,
                                       0,
                                       TRW_USB_MS_OS,
                                       0};

/* The same specification, tables 10, 13 and 15. */
static const uint8_t kMsOs[kMsOsSize] = {
    10,        0,         0x00,      0x00,      0x00,      0x00,
    0x03,      0x06,      kMsOsSize, 0,         20,        0,
    0x03,      0x00,      'W',       'I',       'N',       'U',
    'S',       'B',       0,         0,         0,         0,
    0,         0,         0,         0,         0,         0,
    132,       0,         0x04,      0x00,      7,         0 /* REG_MULTI_SZ */,
    42,        0,         WIDE('D'), WIDE('e'), WIDE('v'), WIDE('i'),
    WIDE('c'), WIDE('e'), WIDE('I'), WIDE('n'), WIDE('t'), WIDE('e'),
    WIDE('r'), WIDE('f'), WIDE('a'), WIDE('c'), WIDE('e'), WIDE('G'),
    WIDE('U'), WIDE('I'), WIDE('D'), WIDE('s'), WIDE(0),   80,
    0,         WIDE('{'), WIDE('8'), WIDE('B'), WIDE('1'), WIDE('6'),
    WIDE('F'), WIDE('0'), WIDE('5'), WIDE('C'), WIDE('-'), WIDE('3'),
    WIDE('D'), WIDE('2'), WIDE('A'), WIDE('-'), WIDE('4'), WIDE('E'),
    WIDE('9'), WIDE('7'), WIDE('-'), WIDE('A'), WIDE('C'), WIDE('4'),
    WIDE('0'), WIDE('-'), WIDE('7'), WIDE('5'), WIDE('2'), WIDE('D'),
    WIDE('6'), WIDE('1'), WIDE('B'), WIDE('8'), WIDE('E'), WIDE('0'),
    WIDE('3'), WIDE('9'), WIDE('}'), WIDE(0),   WIDE(0)};

static usb_bytes string_descriptor(const char* text, uint8_t* buffer) {
  uint8_t size = 2;
  for (; *text != 0 && size < 2 * kLongestString; ++text) {
    buffer[size++] = (uint8_t)*text;
    buffer[size++] = 0;
  }
  buffer[0] = size;
  buffer[1] = USB_STRING_DESCRIPTOR;
  return (usb_bytes){buffer, size};
}

static usb_bytes string_by_number(uint8_t number, uint16_t language, const char* serial, uint8_t* buffer) {
  if (number == USB_STRING_LANGUAGES) return (usb_bytes){kLanguages, sizeof kLanguages};
  if (language != USB_ENGLISH_US) return (usb_bytes){NULL, 0};
  switch (number) {
    case USB_STRING_MANUFACTURER:
      return string_descriptor("tunnelrig", buffer);
    case USB_STRING_PRODUCT:
      return string_descriptor("tunnelrig load-cell board", buffer);
    case USB_STRING_SERIAL:
      return string_descriptor(serial, buffer);
    default:
      return (usb_bytes){NULL, 0};
  }
}

usb_bytes usb_descriptor(uint16_t value, uint16_t index, const char* serial, uint8_t* buffer) {
  uint8_t type = HIGH(value), number = LOW(value);
  if (type == USB_STRING_DESCRIPTOR) return string_by_number(number, index, serial, buffer);
  if (number != 0 || index != 0) return (usb_bytes){NULL, 0};
  switch (type) {
    case USB_DEVICE_DESCRIPTOR:
      return (usb_bytes){kDevice, sizeof kDevice};
    case USB_CONFIGURATION_DESCRIPTOR:
      return (usb_bytes){kConfiguration, sizeof kConfiguration};
    case USB_BOS_DESCRIPTOR:
      return (usb_bytes){kBos, sizeof kBos};
    default: /* a full-speed device has no device qualifier (9.6.2) */
      return (usb_bytes){NULL, 0};
  }
}

usb_bytes usb_ms_os_descriptors(void) { return (usb_bytes){kMsOs, sizeof kMsOs}; }
