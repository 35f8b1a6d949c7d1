/* What the firmware needs of string.h; there is no C library in the image. */
#ifndef TUNNELRIG_STRING_H
#define TUNNELRIG_STRING_H

#include <stddef.h>

void* memcpy(void* to, const void* from, size_t size);
void* memset(void* to, int value, size_t size);
int memcmp(const void* a, const void* b, size_t size);

#endif
