#include "usb_device.h"

#include "usb_descriptors.h"

/* bmRequestType, 9.3 */
enum { kIn = 0x80, kTypeMask = 0x60, kStandard = 0x00, kVendor = 0x40, kRecipientMask = 0x1F };
enum { kToDevice = 0, kToInterface = 1, kToEndpoint = 2 };

/* bRequest, 9.4 */
enum {
  kGetStatus = 0,
  kClearFeature = 1,
  kSetFeature = 3,
  kSetAddress = 5,
  kGetDescriptor = 6,
  kGetConfiguration = 8,
  kSetConfiguration = 9,
  kGetInterface = 10,
  kSetInterface = 11
};
enum { kEndpointHalt = 0, kMsOsDescriptorIndex = 7, kHighestAddress = 127 };

void usb_init(usb_device* usb, const usb_controller* controller, void* controller_context,
              const usb_application* application, void* application_context,
              const uint8_t unique_id[TRW_USB_UNIQUE_ID_SIZE]) {
  static const char digits[] = "0123456789ABCDEF";
  memset(usb, 0, sizeof *usb);
  usb->controller = controller;
  usb->controller_context = controller_context;
  usb->application = application;
  usb->application_context = application_context;
  for (uint32_t i = 0; i < TRW_USB_UNIQUE_ID_SIZE; ++i) {
    usb->serial[2 * i] = digits[unique_id[i] >> 4];
    usb->serial[2 * i + 1] = digits[unique_id[i] & 15u];
  }
}

/* --- stages of a control transfer, 8.5.3
 * ------------------------------------------------------------------------ */

static void stall_control(usb_device* usb) {
  ++usb->stalls;
  usb->stage = USB_IDLE;
  usb->controller->stall(usb->controller_context, 0);
}

static void reply(usb_device* usb, const uint8_t* data, uint16_t size) {
  if (size > usb->setup.length) size = usb->setup.length;
  if (size == 0) { /* nothing wanted, wLength 0: the status stage is IN */
    usb->stage = USB_STATUS_IN;
  } else {
    /* Shorter than asked for, and yet no short packet: an empty one ends the stage (8.5.3.2). */
    bool needs_empty = size < usb->setup.length && size % USB_PACKET == 0;
    usb->stage = needs_empty ? USB_EMPTY_IN : USB_DATA_IN;
  }
  usb->controller->send(usb->controller_context, 0x80, data, size);
}

static void acknowledge(usb_device* usb) {
  usb->stage = USB_STATUS_IN;
  usb->controller->send(usb->controller_context, 0x80, NULL, 0);
}

/* --- standard requests, 9.4
 * ------------------------------------------------------------------------------------- */

static void set_configured(usb_device* usb, uint8_t configuration) {
  bool was = usb->configuration != 0;
  usb->configuration = configuration;
  usb->halted = false;
  if (configuration != 0) {
    usb->controller->open_in(usb->controller_context, TRW_USB_STREAM_IN, USB_PACKET);
  } else if (was) {
    usb->controller->close(usb->controller_context, TRW_USB_STREAM_IN);
  }
  if (was || configuration != 0) usb->application->configured(usb->application_context, configuration != 0);
}

static bool is_stream(const usb_device* usb) {
  return usb->configuration != 0 && usb->setup.index == TRW_USB_STREAM_IN;
}

static bool is_control_endpoint(const usb_device* usb) { return (usb->setup.index & 0xFF7Fu) == 0; }

/* The interface exists, in the configured state only. */
static bool is_interface(const usb_device* usb) {
  return usb->configuration != 0 && usb->setup.index == TRW_USB_INTERFACE;
}

static void get_status(usb_device* usb) {
  uint8_t recipient = usb->setup.type & kRecipientMask;
  bool known = (recipient == kToDevice && usb->setup.index == 0) ||
               (recipient == kToInterface && is_interface(usb)) ||
               (recipient == kToEndpoint && (is_stream(usb) || is_control_endpoint(usb)));
  if (!known || usb->setup.value != 0 || usb->setup.length != 2) {
    stall_control(usb);
    return;
  }
  usb->control[0] = recipient == kToEndpoint && is_stream(usb) && usb->halted;
  usb->control[1] = 0;
  reply(usb, usb->control, 2);
}

/* The only feature there is: the halt of an endpoint. Endpoint 0 is never halted, so to clear it is granted.
 */
static void change_feature(usb_device* usb, bool set) {
  bool halt = (usb->setup.type & kRecipientMask) == kToEndpoint && usb->setup.value == kEndpointHalt &&
              usb->setup.length == 0;
  if (halt && is_control_endpoint(usb) && !set) {
    acknowledge(usb);
  } else if (halt && is_stream(usb)) {
    usb->halted = set;
    if (set) {
      ++usb->stalls;
      usb->controller->stall(usb->controller_context, TRW_USB_STREAM_IN);
    } else {
      usb->controller->clear_stall(usb->controller_context, TRW_USB_STREAM_IN);
    }
    usb->application->halted(usb->application_context, set);
    acknowledge(usb);
  } else {
    stall_control(usb);
  }
}

static void set_address(usb_device* usb) {
  if (usb->setup.value > kHighestAddress || usb->setup.index != 0 || usb->setup.length != 0 ||
      usb->configuration != 0) {
    stall_control(usb);
    return;
  }
  usb->address = (uint8_t)usb->setup.value;
  usb->controller->set_address(usb->controller_context, usb->address);
  acknowledge(usb);
}

static void get_descriptor(usb_device* usb) {
  usb_bytes found = usb_descriptor(usb->setup.value, usb->setup.index, usb->serial, usb->control);
  if (found.size == 0) {
    stall_control(usb);
  } else {
    reply(usb, found.data, found.size);
  }
}

static void set_configuration(usb_device* usb) {
  if (usb->setup.value > 1 || usb->setup.index != 0 || usb->setup.length != 0) {
    stall_control(usb);
    return;
  }
  set_configured(usb, (uint8_t)usb->setup.value);
  acknowledge(usb);
}

static void set_interface(usb_device* usb) {
  if (!is_interface(usb) || usb->setup.value != 0 || usb->setup.length != 0) {
    stall_control(usb);
    return;
  }
  set_configured(usb, usb->configuration); /* the data toggle starts anew (9.1.1.5) */
  acknowledge(usb);
}

/* GET_CONFIGURATION and GET_INTERFACE: one byte. */
static void get_byte(usb_device* usb, bool allowed, uint8_t value) {
  if (!allowed || usb->setup.value != 0 || usb->setup.length != 1) {
    stall_control(usb);
    return;
  }
  usb->control[0] = value;
  reply(usb, usb->control, 1);
}

static void standard_in(usb_device* usb) {
  uint8_t recipient = usb->setup.type & kRecipientMask;
  switch (usb->setup.request) {
    case kGetStatus:
      get_status(usb);
      break;
    case kGetDescriptor:
      if (recipient == kToDevice) {
        get_descriptor(usb);
      } else {
        stall_control(usb);
      }
      break;
    case kGetConfiguration:
      get_byte(usb, recipient == kToDevice && usb->setup.index == 0, usb->configuration);
      break;
    case kGetInterface:
      get_byte(usb, recipient == kToInterface && is_interface(usb), 0);
      break;
    default: /* SYNCH_FRAME among them: there is no isochronous endpoint */
      stall_control(usb);
  }
}

static void standard_out(usb_device* usb) {
  uint8_t recipient = usb->setup.type & kRecipientMask;
  uint8_t request = usb->setup.request;
  if (request == kClearFeature || request == kSetFeature) {
    change_feature(usb, request == kSetFeature);
  } else if (request == kSetAddress && recipient == kToDevice) {
    set_address(usb);
  } else if (request == kSetConfiguration && recipient == kToDevice) {
    set_configuration(usb);
  } else if (request == kSetInterface && recipient == kToInterface) {
    set_interface(usb);
  } else { /* SET_DESCRIPTOR among them */
    stall_control(usb);
  }
}

/* --- vendor requests
 * -------------------------------------------------------------------------------------------- */

static void vendor_in(usb_device* usb) {
  if (usb->setup.request == TRW_USB_MS_OS && usb->setup.index == kMsOsDescriptorIndex) {
    usb_bytes set = usb_ms_os_descriptors();
    reply(usb, set.data, set.size);
    return;
  }
  int size = usb->application->vendor_in(usb->application_context, &usb->setup, usb->control);
  if (size < 0) {
    stall_control(usb);
  } else {
    reply(usb, usb->control, (uint16_t)size);
  }
}

static void vendor_out(usb_device* usb) {
  if (usb->application->vendor_out(usb->application_context, &usb->setup, usb->control)) {
    acknowledge(usb);
  } else {
    stall_control(usb);
  }
}

static void start_vendor_out(usb_device* usb) {
  if (usb->setup.length == 0) {
    vendor_out(usb);
  } else if (usb->setup.length <= USB_PACKET) { /* no request of ours has more data than a packet */
    usb->stage = USB_DATA_OUT;
    usb->controller->receive(usb->controller_context, usb->control, usb->setup.length);
  } else {
    stall_control(usb);
  }
}

/* --- upcalls
 * ---------------------------------------------------------------------------------------------------- */

void usb_on_reset(usb_device* usb) {
  ++usb->resets;
  usb->stage = USB_IDLE;
  usb->address = 0;
  usb->suspended = false;
  set_configured(usb, 0);
}

void usb_on_suspend(usb_device* usb, bool suspended) {
  if (suspended && !usb->suspended) ++usb->suspends;
  usb->suspended = suspended;
}

void usb_on_setup(usb_device* usb, const uint8_t packet[8]) {
  usb->setup = (usb_setup){.type = packet[0],
                           .request = packet[1],
                           .value = trw_get16(packet + 2),
                           .index = trw_get16(packet + 4),
                           .length = trw_get16(packet + 6)};
  usb->stage = USB_IDLE; /* whatever was under way is over (8.5.3) */
  uint8_t type = usb->setup.type & kTypeMask;
  bool in = (usb->setup.type & kIn) != 0;
  if (type == kStandard) {
    if (in) {
      standard_in(usb);
    } else {
      standard_out(usb);
    }
  } else if (type == kVendor && (usb->setup.type & kRecipientMask) == kToDevice) {
    if (in) {
      vendor_in(usb);
    } else {
      start_vendor_out(usb);
    }
  } else {
    stall_control(usb);
  }
}

void usb_on_sent(usb_device* usb, uint8_t endpoint) {
  if (endpoint == TRW_USB_STREAM_IN) {
    usb->application->sent(usb->application_context);
  } else if (usb->stage == USB_EMPTY_IN) {
    usb->stage = USB_DATA_IN;
    usb->controller->send(usb->controller_context, 0x80, NULL, 0);
  } else if (usb->stage == USB_DATA_IN) {
    usb->stage = USB_STATUS_OUT;
    usb->controller->receive(usb->controller_context, usb->control, 0);
  } else {
    usb->stage = USB_IDLE;
  }
}

void usb_on_received(usb_device* usb, uint16_t size) {
  if (usb->stage == USB_DATA_OUT && size == usb->setup.length) {
    vendor_out(usb);
  } else if (usb->stage == USB_STATUS_OUT && size == 0) {
    usb->stage = USB_IDLE;
  } else {
    stall_control(usb);
  }
}

bool usb_send(usb_device* usb, const uint8_t* data, uint16_t size) {
  if (usb->configuration == 0 || usb->halted) return false;
  usb->controller->send(usb->controller_context, TRW_USB_STREAM_IN, data, size);
  return true;
}
