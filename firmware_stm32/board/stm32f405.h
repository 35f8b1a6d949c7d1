/* The registers that this firmware touches, and no others. Sections are those of the reference manual RM0090,
 * unless marked PM0214 (Cortex-M4 programming manual). On the host (REGISTER_MODEL) every access goes through
 * a model of the register file, so that the tests see the sequence of reads and writes. */
#ifndef TUNNELRIG_STM32F405_H
#define TUNNELRIG_STM32F405_H

#include <stdbool.h>
#include <stdint.h>

#ifdef REGISTER_MODEL
uint32_t model_read(uint32_t address);
void model_write(uint32_t address, uint32_t value);
#define RD(address) model_read(address)
#define WR(address, value) model_write((address), (value))
#else
#define RD(address) (*(volatile const uint32_t*)(address))
#define WR(address, value) (*(volatile uint32_t*)(address) = (value))
#endif
#define SET(address, bits) WR((address), RD(address) | (bits))
#define CLEAR(address, bits) WR((address), RD(address) & ~(uint32_t)(bits))
#define BIT(n) (1u << (n))

/* RCC, 7.3 */
#define RCC_CR 0x40023800u      /* 7.3.1: HSION 0, HSIRDY 1, HSEON 16, HSERDY 17, PLLON 24, PLLRDY 25 */
#define RCC_PLLCFGR 0x40023804u /* 7.3.2 */
#define RCC_CFGR 0x40023808u    /* 7.3.3: SW 1:0, SWS 3:2, HPRE 7:4, PPRE1 12:10, PPRE2 15:13 */
#define RCC_AHB1ENR 0x40023830u /* 7.3.10: GPIOA 0, GPIOB 1, GPIOC 2, CRC 12, CCM 20, DMA2 22 */
#define RCC_AHB2ENR 0x40023834u /* 7.3.11: RNG 6, OTGFS 7 */
#define RCC_APB1ENR 0x40023840u /* 7.3.13: TIM2 0, TIM5 3, PWR 28 */
#define RCC_APB2ENR 0x40023844u /* 7.3.14: USART1 4, ADC1 8, SYSCFG 14 */
#define RCC_CSR 0x40023874u     /* 7.3.21: reset causes 31:25, RMVF 24 */

/* FLASH, 3.9.1; PWR, 5.4 */
#define FLASH_ACR 0x40023C00u /* LATENCY 2:0, PRFTEN 8, ICEN 9, DCEN 10 */
#define PWR_CR 0x40007000u    /* DBP 8, VOS 14 */

/* GPIO, 8.4, and the alternate functions of the F405 data sheet, table 9 */
#define GPIOA 0x40020000u
#define GPIOB 0x40020400u
#define GPIOC 0x40020800u
#define GPIO_MODER 0x00u
#define GPIO_OSPEEDR 0x08u
#define GPIO_BSRR 0x18u
#define GPIO_AFRH 0x24u

/* TIM2 and TIM5, 18.4 */
#define TIM2 0x40000000u
#define TIM5 0x40000C00u
#define TIM_CR1 0x00u /* CEN 0 */
#define TIM_CR2 0x04u /* MMS 6:4 */
#define TIM_EGR 0x14u /* UG 0 */
#define TIM_CNT 0x24u
#define TIM_PSC 0x28u
#define TIM_ARR 0x2Cu

/* ADC1, 13.13 */
#define ADC_SR 0x40012000u    /* OVR 5 */
#define ADC_CR1 0x40012004u   /* SCAN 8, OVRIE 26 */
#define ADC_CR2 0x40012008u   /* ADON 0, DMA 8, DDS 9, EXTSEL 27:24, EXTEN 29:28 */
#define ADC_SMPR2 0x40012010u /* three bits per channel 0 to 9 */
#define ADC_SQR1 0x4001202Cu  /* L 23:20 */
#define ADC_SQR3 0x40012034u
#define ADC_DR 0x4001204Cu
#define ADC_CCR 0x40012304u /* ADCPRE 17:16 */

/* DMA2 stream 0, 10.5; ADC1 is its channel 0 (table 43) */
#define DMA2_LISR 0x40026400u /* FEIF0 0, DMEIF0 2, TEIF0 3, HTIF0 4, TCIF0 5 */
#define DMA2_LIFCR 0x40026408u
#define DMA2_S0CR 0x40026410u /* EN 0, DMEIE 1, TEIE 2, TCIE 4, CT 19 */
#define DMA2_S0NDTR 0x40026414u
#define DMA2_S0PAR 0x40026418u
#define DMA2_S0M0AR 0x4002641Cu
#define DMA2_S0M1AR 0x40026420u
#define DMA2_S0FCR 0x40026424u

/* OTG_FS, 34.16 */
#define OTG_FS 0x50000000u
#define OTG_GOTGCTL (OTG_FS + 0x000u)
#define OTG_GAHBCFG (OTG_FS + 0x008u) /* GINT 0, TXFELVL 7 */
#define OTG_GUSBCFG (OTG_FS + 0x00Cu) /* PHYSEL 6, TRDT 13:10, FDMOD 30 */
#define OTG_GRSTCTL (OTG_FS + 0x010u) /* CSRST 0, RXFFLSH 4, TXFFLSH 5, TXFNUM 10:6, AHBIDL 31 */
#define OTG_GINTSTS (OTG_FS + 0x014u)
#define OTG_GINTMSK (OTG_FS + 0x018u)
#define OTG_GRXSTSP (OTG_FS + 0x020u)
#define OTG_GRXFSIZ (OTG_FS + 0x024u)
#define OTG_DIEPTXF0 (OTG_FS + 0x028u)
#define OTG_GCCFG (OTG_FS + 0x038u) /* PWRDWN 16, VBUSBSEN 19, NOVBUSSENS 21 */
#define OTG_DIEPTXF1 (OTG_FS + 0x104u)
#define OTG_DCFG (OTG_FS + 0x800u) /* DSPD 1:0, DAD 10:4 */
#define OTG_DCTL (OTG_FS + 0x804u) /* SDIS 1 */
#define OTG_DSTS (OTG_FS + 0x808u)
#define OTG_DIEPMSK (OTG_FS + 0x810u)
#define OTG_DOEPMSK (OTG_FS + 0x814u)
#define OTG_DAINT (OTG_FS + 0x818u)
#define OTG_DAINTMSK (OTG_FS + 0x81Cu)
#define OTG_DIEPEMPMSK (OTG_FS + 0x834u)
#define OTG_DIEPCTL(n) (OTG_FS + 0x900u + 0x20u * (n))
#define OTG_DIEPINT(n) (OTG_FS + 0x908u + 0x20u * (n))
#define OTG_DIEPTSIZ(n) (OTG_FS + 0x910u + 0x20u * (n))
#define OTG_DTXFSTS(n) (OTG_FS + 0x918u + 0x20u * (n))
#define OTG_DOEPCTL(n) (OTG_FS + 0xB00u + 0x20u * (n))
#define OTG_DOEPINT(n) (OTG_FS + 0xB08u + 0x20u * (n))
#define OTG_DOEPTSIZ(n) (OTG_FS + 0xB10u + 0x20u * (n))
#define OTG_PCGCCTL (OTG_FS + 0xE00u)
#define OTG_FIFO(n) (OTG_FS + 0x1000u + 0x1000u * (n))

/* RNG, 24.4; IWDG, 21.4; unique id, 39.1 */
#define RNG_CR 0x50060800u
#define RNG_SR 0x50060804u
#define RNG_DR 0x50060808u
#define IWDG_KR 0x40003000u
#define IWDG_PR 0x40003004u
#define IWDG_RLR 0x40003008u
#define UNIQUE_ID 0x1FFF7A10u

/* USART1, 30.6 (emulator variant) */
#define USART1_SR 0x40011000u /* TXE 7, RXNE 5 */
#define USART1_DR 0x40011004u
#define USART1_BRR 0x40011008u
#define USART1_CR1 0x4001100Cu /* UE 13, TE 3, RE 2 */

/* SysTick, NVIC, SCB, DWT: PM0214 4.5, 4.3, 4.4; DWT: ARMv7-M manual C1.8 */
#define SYST_CSR 0xE000E010u
#define SYST_RVR 0xE000E014u
#define SYST_CVR 0xE000E018u
#define NVIC_ISER(n) (0xE000E100u + 4u * (n))
#define NVIC_ICPR(n) (0xE000E280u + 4u * (n))
#define NVIC_IPR(n) (0xE000E400u + 4u * (n))
#define SCB_AIRCR 0xE000ED0Cu
#define SCB_SHPR3 0xE000ED20u
#define SCB_SHCSR 0xE000ED24u
#define SCB_CFSR 0xE000ED28u
#define SCB_HFSR 0xE000ED2Cu
#define SCB_BFAR 0xE000ED38u
#define SCB_CPACR 0xE000ED88u
#define MPU_CTRL 0xE000ED94u
#define MPU_RNR 0xE000ED98u
#define MPU_RBAR 0xE000ED9Cu
#define MPU_RASR 0xE000EDA0u
#define DEMCR 0xE000EDFCu
#define DWT_CTRL 0xE0001000u
#define DWT_CYCCNT 0xE0001004u

enum { IRQ_DMA2_STREAM0 = 56, IRQ_OTG_FS = 67, IRQ_ADC = 18 };

/* Waits until (RD(address) & mask) == wanted, at most `polls` reads. */
static inline bool wait_for(uint32_t address, uint32_t mask, uint32_t wanted, uint32_t polls) {
  for (uint32_t i = 0; i < polls; ++i) {
    if ((RD(address) & mask) == wanted) return true;
  }
  return false;
}

#endif
