#ifndef WIRE_IN_C_H
#define WIRE_IN_C_H

#include "tunnelrig_wire.h"

#ifdef __cplusplus
extern "C" {
#endif

size_t encode_in_c(uint8_t* out, const trw_header* header, const trw_frame* frames);
trw_result parse_in_c(const uint8_t* in, size_t size, trw_header* header);

#ifdef __cplusplus
}
#endif

#endif
