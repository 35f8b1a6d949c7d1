"""make_dfu.py IMAGE.bin OUT.dfu: an image for 0x08000000 in the DfuSe format of the ST loader (ST UM0391)."""

import struct
import sys
import zlib

image = open(sys.argv[1], "rb").read()
element = struct.pack("<II", 0x08000000, len(image)) + image
target = struct.pack("<6sBI255sII", b"Target", 0, 1, b"tunnelrig-f405", len(element), 1) + element
prefix = struct.pack("<5sBIB", b"DfuSe", 1, 11 + len(target), 1)
suffix = struct.pack("<HHHH3sB", 0xFFFF, 0xDF11, 0x0483, 0x011A, b"UFD", 16)
body = prefix + target + suffix
open(sys.argv[2], "wb").write(body + struct.pack("<I", zlib.crc32(body) ^ 0xFFFFFFFF))
