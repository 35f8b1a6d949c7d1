/* Vectors, start-up, faults. Compiled without the loop-to-memcpy pass: memcpy and memset are here. */
#include "startup.h"

#include "stm32f405.h"

#include <string.h>

extern uint32_t data_load_start[], data_start[], data_end[], bss_start[], bss_end[],
    stack_top[]; /* f405.ld */

enum { kLoaderWanted = 0x44465521, kSystemMemory = 0x1FFF0000 };

__attribute__((section(".survives"))) survivor survived;
__attribute__((section(".survives"))) static volatile uint32_t loader_wish;

void* memcpy(void* to, const void* from, size_t size) {
  uint8_t* t = (uint8_t*)to;
  const uint8_t* f = (const uint8_t*)from;
  for (size_t i = 0; i < size; ++i) t[i] = f[i];
  return to;
}

void* memset(void* to, int value, size_t size) {
  uint8_t* t = (uint8_t*)to;
  for (size_t i = 0; i < size; ++i) t[i] = (uint8_t)value;
  return to;
}

int memcmp(const void* a, const void* b, size_t size) {
  const uint8_t *x = (const uint8_t*)a, *y = (const uint8_t*)b;
  for (size_t i = 0; i < size; ++i) {
    if (x[i] != y[i]) return x[i] < y[i] ? -1 : 1;
  }
  return 0;
}

_Noreturn static void reset(void) {
  __asm volatile("dsb" ::: "memory");
  WR(SCB_AIRCR, 0x05FA0004u); /* PM0214 4.4.5: SYSRESETREQ */
  for (;;) {
  }
}

void reset_into_loader(void) {
  loader_wish = kLoaderWanted;
  reset();
}

/* AN2606: with the state of a reset, stack and entry from the system memory. */
static void enter_loader(void) {
  uint32_t stack = RD(kSystemMemory), entry = RD(kSystemMemory + 4u);
  __asm volatile("msr msp, %0\n bx %1" : : "r"(stack), "r"(entry) : "memory");
}

void reset_handler(void) {
  if (loader_wish == kLoaderWanted) {
    loader_wish = 0;
    enter_loader();
  }
  const uint32_t* from = data_load_start;
  for (uint32_t* to = data_start; to != data_end;) *to++ = *from++;
  for (uint32_t* to = bss_start; to != bss_end;) *to++ = 0;
  ++survived.boots;
  (void)main();
  reset();
}

/* `frame` is what the processor stacked, where there was stack left to do it. */
__attribute__((used)) void record_fault(const uint32_t* frame, uint32_t inside) {
  survived.magic = FAULT_RECORDED;
  survived.lr = inside != 0 ? frame[5] : 0;
  survived.pc = inside != 0 ? frame[6] : 0;
  survived.cfsr = RD(SCB_CFSR);
  survived.hfsr = RD(SCB_HFSR);
  survived.address = RD(SCB_BFAR);
  reset();
}

/* The stack stands at the bottom of the RAM, so that one that overflows runs into nothing and faults: the
 * record is then made on a fresh one. r0: the frame, r1: whether it lies in the RAM. */
__attribute__((naked)) void fault_handler(void) {
  __asm volatile(
      "mrs r0, msp\n"
      "ldr r2, =stack_bottom\n"
      "ldr r3, =stack_top\n"
      "movs r1, #0\n"
      "cmp r0, r2\n"
      "blo 1f\n"
      "adds r2, r0, #32\n"
      "cmp r2, r3\n"
      "it ls\n"
      "movls r1, #1\n"
      "1: msr msp, r3\n"
      "b record_fault\n"
      ".ltorg\n");
}

/* An interrupt that nobody asked for is a fault. */
typedef void (*vector)(void);
__attribute__((section(".vectors"), used)) static const vector vectors[16 + 82] = {
    [0] = (vector)stack_top,
    [1] = reset_handler,
    [2 ... 14] = fault_handler,
    [15] = on_tick,
    [16 ... 15 + IRQ_ADC] = fault_handler,
    [16 + IRQ_ADC] = on_sampling,
    [17 + IRQ_ADC... 15 + IRQ_DMA2_STREAM0] = fault_handler,
    [16 + IRQ_DMA2_STREAM0] = on_sampling,
    [17 + IRQ_DMA2_STREAM0... 15 + IRQ_OTG_FS] = fault_handler,
    [16 + IRQ_OTG_FS] = on_usb,
    [17 + IRQ_OTG_FS... 97] = fault_handler,
};
