#pragma once

namespace tunnelrig {

/// Processor time (s) that this process has spent within ioctl(). umockdev answers libusb's ioctl() in place
/// of the kernel: by a message to another thread, and sleeping where that thread is busy. It is no cost of
/// the logger.
double ioctl_processor_s();

}  // namespace tunnelrig
