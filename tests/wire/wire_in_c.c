/* The packet header as the firmware compiles it: C11. */
#include "wire_in_c.h"

size_t encode_in_c(uint8_t* out, const trw_header* header, const trw_frame* frames) {
  return trw_encode(out, header, frames);
}

trw_result parse_in_c(const uint8_t* in, size_t size, trw_header* header) {
  return trw_parse(in, size, header);
}
