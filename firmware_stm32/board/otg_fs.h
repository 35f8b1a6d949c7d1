/* USB OTG FS as a device, beneath core/usb_device.h. */
#ifndef TUNNELRIG_OTG_FS_H
#define TUNNELRIG_OTG_FS_H

#include "usb_device.h"

extern const usb_controller otg_fs;

/* Pins, core reset, device mode, FIFOs; the device is connected at the end. False where a bounded wait ran
 * out. */
bool otg_fs_init(usb_device* device);

/* The OTG_FS interrupt. */
void otg_fs_interrupt(void);

#endif
