/* USB 2.0 full-speed device, chapter 9: one configuration, one vendor interface, one bulk IN endpoint.
 * Portable; the controller stands below a small table of functions, the application above another. */
#ifndef TUNNELRIG_USB_DEVICE_H
#define TUNNELRIG_USB_DEVICE_H

#include "tunnelrig_usb.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { USB_PACKET = 64, USB_CONTROL_BUFFER = 128 };

/* A setup packet, decoded (USB 2.0, 9.3). */
typedef struct {
  uint8_t type, request;
  uint16_t value, index, length;
} usb_setup;

/* What a controller does for the core. All calls return at once; ends of transfers are told by the upcalls
 * below. Endpoint addresses are those of USB: 0x00, 0x80, 0x81. `send` of more than a packet is cut up by the
 * controller; it adds no empty packet at the end. Data given to `send` stays untouched until it is sent or
 * dropped. */
typedef struct {
  void (*set_address)(void* context, uint8_t address);
  void (*open_in)(void* context, uint8_t endpoint, uint16_t packet_size);
  void (*close)(void* context, uint8_t endpoint);
  void (*send)(void* context, uint8_t endpoint, const uint8_t* data, uint16_t size);
  void (*receive)(void* context, uint8_t* data, uint16_t size); /* data or status stage on endpoint 0 */
  void (*stall)(void* context, uint8_t endpoint);               /* 0: both directions, until the next setup */
  void (*clear_stall)(void* context, uint8_t endpoint);         /* the data toggle starts anew */
} usb_controller;

/* What the application does for the core; called as the upcalls are, on the board by the USB interrupt. */
typedef struct {
  /* Fills `reply` (USB_CONTROL_BUFFER bytes) and returns its size; negative: stall. */
  int (*vendor_in)(void* context, const usb_setup* setup, uint8_t* reply);
  /* Returns false to stall. Called after the data stage. */
  bool (*vendor_out)(void* context, const usb_setup* setup, const uint8_t* data);
  void (*configured)(void* context, bool on);
  void (*sent)(void* context);            /* the transfer on the stream endpoint is done */
  void (*halted)(void* context, bool on); /* SET_FEATURE or CLEAR_FEATURE(ENDPOINT_HALT) */
} usb_application;

typedef struct {
  const usb_controller* controller;
  void* controller_context;
  const usb_application* application;
  void* application_context;
  char serial[2 * TRW_USB_UNIQUE_ID_SIZE + 1];

  usb_setup setup; /* the request under way */
  enum { USB_IDLE, USB_DATA_IN, USB_EMPTY_IN, USB_DATA_OUT, USB_STATUS_IN, USB_STATUS_OUT } stage;
  uint8_t control[USB_CONTROL_BUFFER];
  uint8_t address, configuration;
  bool halted, suspended;
  uint32_t stalls, resets, suspends;
} usb_device;

void usb_init(usb_device* usb, const usb_controller* controller, void* controller_context,
              const usb_application* application, void* application_context,
              const uint8_t unique_id[TRW_USB_UNIQUE_ID_SIZE]);

/* Sends on the stream endpoint. False where the device is not configured or the endpoint is halted. */
bool usb_send(usb_device* usb, const uint8_t* data, uint16_t size);

/* Upcalls of the controller, never two at once. */
void usb_on_reset(usb_device* usb);
void usb_on_suspend(usb_device* usb, bool suspended);
void usb_on_setup(usb_device* usb, const uint8_t packet[8]);
void usb_on_sent(usb_device* usb, uint8_t endpoint);
void usb_on_received(usb_device* usb, uint16_t size); /* endpoint 0 */

#ifdef __cplusplus
}
#endif

#endif
