/* What outlives a reset, and the two ways to reset on purpose. */
#ifndef TUNNELRIG_STARTUP_H
#define TUNNELRIG_STARTUP_H

#include <stdint.h>

enum { FAULT_RECORDED = 0x46415554 };

typedef struct {
  uint32_t magic; /* FAULT_RECORDED where the rest is a record */
  uint32_t pc, lr, cfsr, hfsr, address;
  uint32_t boots; /* counts up as long as the power stays on; random before */
} survivor;

extern survivor survived; /* not cleared at the start */

void reset_into_loader(void);

/* Of the variant. */
int main(void);
void on_sampling(void);
void on_usb(void);
void on_tick(void);

#endif
