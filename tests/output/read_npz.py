"""Reads a .npz file with Python's own zip reader, which checks every checksum, and prints its arrays as JSON.

read_npz.py FILE.npz
"""
import ast
import json
import struct
import sys
import zipfile

TYPES = {"<i4": "i", "<i8": "q", "<f8": "d"}

arrays = {}
with zipfile.ZipFile(sys.argv[1]) as archive:
    bad = archive.testzip()
    if bad:
        sys.exit(f"damaged: {bad}")
    for name in archive.namelist():
        data = archive.read(name)
        if data[:8] != b"\x93NUMPY\x01\x00":
            sys.exit(f"{name}: not .npy 1.0")
        (length,) = struct.unpack("<H", data[8:10])
        if (10 + length) % 64 or data[9 + length] != ord("\n"):
            sys.exit(f"{name}: header not aligned")
        header = ast.literal_eval(data[10 : 10 + length].decode("latin1"))
        body, descr, count = data[10 + length :], header["descr"], 1
        for extent in header["shape"]:
            count *= extent
        if descr in TYPES:
            values = list(struct.unpack(f"<{count}{TYPES[descr]}", body))
        elif descr[:2] == "<U":
            width = 4 * int(descr[2:])
            values = [body[i * width : (i + 1) * width].decode("utf-32-le").rstrip("\0") for i in range(count)]
        else:
            values = [body.decode("latin1")]
        arrays[name] = {"shape": list(header["shape"]), "values": values}
json.dump(arrays, sys.stdout)
