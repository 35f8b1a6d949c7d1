/* The descriptors. Sections are those of USB 2.0 unless said otherwise. */
#ifndef TUNNELRIG_USB_DESCRIPTORS_H
#define TUNNELRIG_USB_DESCRIPTORS_H

#include "tunnelrig_usb.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  USB_DEVICE_DESCRIPTOR = 1,
  USB_CONFIGURATION_DESCRIPTOR = 2,
  USB_STRING_DESCRIPTOR = 3,
  USB_INTERFACE_DESCRIPTOR = 4,
  USB_ENDPOINT_DESCRIPTOR = 5,
  USB_BOS_DESCRIPTOR = 15,
  USB_CAPABILITY_DESCRIPTOR = 16
};
enum { USB_STRING_LANGUAGES = 0, USB_STRING_MANUFACTURER, USB_STRING_PRODUCT, USB_STRING_SERIAL };
enum { USB_ENGLISH_US = 0x0409 };

typedef struct {
  const uint8_t* data;
  uint16_t size;
} usb_bytes;

/* Size 0: there is none. `buffer` (64 bytes) takes strings; `serial` is ASCII. */
usb_bytes usb_descriptor(uint16_t value, uint16_t index, const char* serial, uint8_t* buffer);

/* Microsoft OS 2.0 descriptor set: binds WinUSB and names an interface GUID. */
usb_bytes usb_ms_os_descriptors(void);

#ifdef __cplusplus
}
#endif

#endif
