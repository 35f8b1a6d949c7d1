/* Vendor requests to a board: the application half of usb_device.h. */
#ifndef TUNNELRIG_COMMANDS_H
#define TUNNELRIG_COMMANDS_H

#include "usb_device.h"

int commands_in(void* context, const usb_setup* setup, uint8_t* reply);
bool commands_out(void* context, const usb_setup* setup, const uint8_t* data);

#endif
